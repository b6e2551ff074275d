// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>

#include "commands.hpp"

namespace {

using sqmap::apps::Command;

constexpr std::array<Command, 1> kCommands{{
    {"run", "Measure sqmap and its rivals, and draw the results", sqmap::apps::declare_run},
}};

constexpr const char* kExamples =
    "  sqbench run frames -o build/bench\n"
    "  sqbench run all --smoke -o build/smoke\n"
    "  scripts/bench_compare before/results.json after/results.json\n";

}  // namespace

int main(int argc, char** argv) {
  return sqmap::apps::run(
      {"sqbench", "Measures what accuracy costs in time and memory, against other methods.", kExamples,
       kCommands},
      argc, argv);
}
