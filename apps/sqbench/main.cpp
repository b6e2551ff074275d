// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>

#include "commands.hpp"

namespace {

using sqmap::apps::Command;

constexpr std::array<Command, 2> kCommands{{
    {"run", "Measure sqmap and its rivals, and draw the results", sqmap::apps::declare_run},
    {"draw", "Draw the results of a run again", sqmap::apps::declare_draw},
}};

constexpr const char* kExamples =
    "  sqbench run frames -o build/bench\n"
    "  sqbench run all --smoke -o build/smoke\n"
    "  sqbench draw results/bench.json -o build/page\n"
    "  scripts/bench_compare before/results.json after/results.json\n";

}  // namespace

int main(int argc, char** argv) {
  return sqmap::apps::run(
      {"sqbench", "Measures what accuracy costs in time and memory, against other methods.", kExamples,
       kCommands},
      argc, argv);
}
