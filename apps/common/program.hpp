// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <span>

#include "console.hpp"
#include "exit_codes.hpp"

namespace CLI {
class App;
}

namespace sqmap::apps {

/// A subcommand. `declare` adds its options to `app`, its examples to the description, and returns what runs
/// once the options have been parsed.
struct Command {
  const char* name;
  const char* summary;
  std::function<Exit(Console&)> (*declare)(CLI::App& app);
};

struct Program {
  const char* name;
  const char* summary;
  const char* examples;
  std::span<const Command> commands;
};

/// Parses the command line, runs the subcommand and returns the exit code of main. Catches everything.
int run(const Program& program, int argc, char** argv);

}  // namespace sqmap::apps
