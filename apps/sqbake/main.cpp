// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>
#include <string_view>

#include "commands.hpp"
#include "plain_math.hpp"
#include "worker.hpp"
#include "worker_messages.hpp"

namespace {

using sqmap::apps::Command;

constexpr std::array kCommands{
    Command{"bake", "Bake meshes into superquadric map bundles", sqmap::apps::declare_bake},
    Command{"check", "Report what is wrong with a mesh and what repair would do", sqmap::apps::declare_check},
    Command{"cache", "Show, check and tidy the cache of finished bundles", sqmap::apps::declare_cache},
    Command{"config", "Show the settings of a mesh and where they come from", sqmap::apps::declare_config},
    Command{"report", "Make one HTML page of the records of a bake", sqmap::apps::declare_report},
    Command{"plan", "Deal meshes out to several machines", sqmap::apps::declare_plan},
    Command{"merge", "Join the records of several runs, and find what is missing",
            sqmap::apps::declare_merge},
};

constexpr const char* kExamples =
    "  sqbake bake hand.off -o hand.h5\n"
    "  sqbake bake models/ --recursive --out-dir bundles/ --max-error 0.1%\n"
    "  sqbake check hand.off\n";

}  // namespace

int main(int argc, char** argv) {
  sqmap::apps::use_plain_math(argv);
  // Not a command for people: how sqbake starts itself.
  if (argc == 3 && std::string_view(argv[1]) == sqmap::apps::kWorkerCommand)
    return sqmap::apps::run_worker(argv[2]);
  return sqmap::apps::run(
      {"sqbake", "Turns triangle meshes into superquadric map bundles.", kExamples, kCommands}, argc, argv);
}
