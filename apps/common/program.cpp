// SPDX-License-Identifier: Apache-2.0
#include "program.hpp"

#include <algorithm>
#include <exception>
#include <map>
#include <new>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "sqmap/asset/version.hpp"

namespace sqmap::apps {
namespace {

const std::map<std::string, When> kWhenNames{
    {"auto", When::kAuto}, {"always", When::kAlways}, {"never", When::kNever}};

std::string command_names(const Program& program) {
  std::string names;
  for (const Command& command : program.commands)
    names += (names.empty() ? "" : ", ") + std::string(command.name);
  return names;
}

/// CLI11 would call an unknown command an unexpected argument.
const char* unknown_command(const Program& program, int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-') return nullptr;
  const auto is_named = [&](const Command& command) { return std::string_view(command.name) == argv[1]; };
  return std::ranges::any_of(program.commands, is_named) ? nullptr : argv[1];
}

std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

Exit parse_and_run(const Program& program, Console& console, int argc, char** argv) {
  if (const char* name = unknown_command(program, argc, argv)) {
    console.error(fmt::format("unknown command `{}`; the commands are {}", name, command_names(program)));
    return Exit::kUsage;
  }
  CLI::App app(std::string(program.summary) + "\n\nExamples:\n" + program.examples, program.name);
  app.set_version_flag("--version", fmt::format("{} {} (bundle format {}.{})", program.name, kVersion,
                                                kFormatMajor, kFormatMinor));
  app.require_subcommand(1);
  app.footer(exit_code_table());
  app.get_formatter()->column_width(34);

  When color = When::kAuto;
  std::vector<std::pair<CLI::App*, std::function<Exit(Console&)>>> runners;
  for (const Command& command : program.commands) {
    CLI::App* sub = app.add_subcommand(command.name, command.summary);
    runners.emplace_back(sub, command.declare(*sub));
    sub->add_option("--color", color,
                    "Colour messages: auto, always, never (default auto; NO_COLOR is honoured)")
        ->transform(CLI::CheckedTransformer(kWhenNames).description(""))
        ->type_name("WHEN");
    sub->footer(exit_code_table());
    for (CLI::Option* option : sub->get_options())
      if (option->get_positional()) option->type_name("");
  }

  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    console.out(app.help());
    return Exit::kOk;
  } catch (const CLI::CallForVersion& version) {
    console.out(std::string(version.what()) + "\n");
    return Exit::kOk;
  } catch (const CLI::ParseError& problem) {
    const std::vector<CLI::App*> used = app.get_subcommands();
    console.error(fmt::format("{}; see `{}{} --help`", one_line(problem.what()), program.name,
                              used.empty() ? "" : " " + used.front()->get_name()));
    return Exit::kUsage;
  }
  console.set_color(color);
  for (const auto& [sub, runner] : runners)
    if (sub->parsed()) return runner(console);
  return Exit::kUsage;
}

}  // namespace

int run(const Program& program, int argc, char** argv) {
  Console console(program.name);
  Exit code = Exit::kInternal;
  try {
    code = parse_and_run(program, console, argc, argv);
  } catch (const std::bad_alloc&) {
    console.error("out of memory");
  } catch (const std::exception& problem) {
    console.error(fmt::format("internal error: {}", problem.what()));
  }
  return static_cast<int>(console.finish(code));
}

}  // namespace sqmap::apps
