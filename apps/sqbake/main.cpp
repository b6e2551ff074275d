// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>

#include "commands.hpp"

namespace {

using sqmap::apps::Command;

constexpr std::array<Command, 2> kCommands{{
    {"bake", "Bake meshes into superquadric map bundles", sqmap::apps::declare_bake},
    {"check", "Report what is wrong with a mesh and what repair would do", sqmap::apps::declare_check},
}};

constexpr const char* kExamples =
    "  sqbake bake hand.off -o hand.h5\n"
    "  sqbake bake models/ --recursive --out-dir bundles/ --max-error 0.1%\n"
    "  sqbake check hand.off\n";

}  // namespace

int main(int argc, char** argv) {
  return sqmap::apps::run(
      {"sqbake", "Turns triangle meshes into superquadric map bundles.", kExamples, kCommands}, argc, argv);
}
