// SPDX-License-Identifier: Apache-2.0
#include "program.hpp"

#include <algorithm>
#include <exception>
#include <map>
#include <memory>
#include <new>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sqmap/asset/version.hpp"

#include "choices.hpp"
#include "shell_docs.hpp"
#include "spelling.hpp"

namespace sqmap::apps {
namespace {

/// The first line of a text.
std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

class HelpFormatter : public CLI::Formatter {
 public:
  explicit HelpFormatter(const Program& program) {
    for (const Command& command : program.commands) summaries_.emplace(command.name, command.summary);
  }

  /// One line a command, where CLI11 would print its whole description.
  std::string make_subcommand(const CLI::App* sub) const override {
    const bool is_nested = sub->get_parent() != nullptr && sub->get_parent()->get_parent() != nullptr;
    const auto summary = is_nested ? summaries_.end() : summaries_.find(sub->get_name());
    std::ostringstream line;
    CLI::detail::format_help(
        line, sub->get_name(),
        summary != summaries_.end() ? summary->second : first_line(sub->get_description()), column_width_);
    return line.str();
  }

  /// CLI11 shows --no-cache, a flag that means false, as --no-cache{false}.
  std::string make_option_name(const CLI::Option* option, bool is_positional) const override {
    constexpr std::string_view kMark = "{false}";
    std::string name = CLI::Formatter::make_option_name(option, is_positional);
    if (const std::size_t at = name.find(kMark); at != std::string::npos) name.erase(at, kMark.size());
    return name;
  }

 private:
  std::map<std::string, std::string> summaries_;
};

std::string command_names(const Program& program) {
  std::string names;
  for (const Command& command : program.commands)
    names += (names.empty() ? "" : ", ") + std::string(command.name);
  return names;
}

std::vector<std::string> names_of(const Program& program) {
  std::vector<std::string> names;
  for (const Command& command : program.commands) names.emplace_back(command.name);
  return names;
}

/// The subcommand that was named last.
const CLI::App& deepest(const CLI::App& app) {
  const CLI::App* at = &app;
  while (!at->get_subcommands().empty()) at = at->get_subcommands().back();
  return *at;
}

/// The first argument that looks like an option but is none, and which it probably was meant to be, if any.
struct Mistyped {
  std::string word, guess;
};

std::optional<Mistyped> mistyped_option(const CLI::App& app, int argc, char** argv) {
  std::vector<std::string> names;
  for (const CLI::App* at = &deepest(app); at != nullptr; at = at->get_parent())
    for (const CLI::Option* option : at->get_options())
      for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  for (int k = 1; k < argc; ++k) {
    const std::string_view word(argv[k]);
    const std::string name(word.substr(0, word.find('=')));
    if (name == "--") break;
    if (name.starts_with("--") && std::ranges::find(names, name) == names.end())
      return Mistyped{name, did_you_mean(name, names)};
  }
  return std::nullopt;
}

/// CLI11 would call an unknown command an unexpected argument.
const char* unknown_command(const Program& program, int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-') return nullptr;
  const auto is_named = [&](const Command& command) { return std::string_view(command.name) == argv[1]; };
  return std::ranges::any_of(program.commands, is_named) ? nullptr : argv[1];
}

/// Of a command with commands of its own, none of which was named: the first word that could be meant for
/// one, and which it probably was meant to be. Empty when there is no such word.
std::string unknown_below(const CLI::App& app, int argc, char** argv) {
  const std::vector<const CLI::App*> below = app.get_subcommands([](const CLI::App*) { return true; });
  if (below.empty() || app.get_parent() == nullptr) return "";
  for (int k = 2; k < argc; ++k) {
    const std::string word(argv[k]);
    if (word.starts_with('-')) {
      const CLI::Option* option = app.get_option_no_throw(word);
      if (option != nullptr && option->get_items_expected_max() > 0) ++k;  // its value
      continue;
    }
    std::vector<std::string> names;
    for (const CLI::App* each : below) names.push_back(each->get_name());
    const std::string guess = did_you_mean(word, names);
    return fmt::format("unknown command `{} {}`{}", app.get_name(), word,
                       guess.empty() ? fmt::format("; the commands are {}", fmt::join(names, ", ")) : guess);
  }
  return "";
}

std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  while (!text.empty() && text.back() == ' ') text.pop_back();
  // CLI11's words for an option that is given twice.
  constexpr std::string_view kTooMany = ": At Most 1 required but received ";
  if (const std::size_t at = text.find(kTooMany); at != std::string::npos)
    text = fmt::format("{}: given {} times, may be given once", text.substr(0, at),
                       text.substr(at + kTooMany.size()));
  return text;
}

Exit parse_and_run(const Program& program, Console& console, int argc, char** argv) {
  if (const char* name = unknown_command(program, argc, argv)) {
    const std::string_view word(name);
    const bool is_option = word == "help" || word == "version";  // a command of other programs
    const std::string guess =
        is_option ? fmt::format("; did you mean `--{}`?", word) : did_you_mean(word, names_of(program));
    console.error(fmt::format("unknown command `{}`{}", name,
                              guess.empty() ? "; the commands are " + command_names(program) : guess));
    return Exit::kUsage;
  }
  CLI::App app(std::string(program.summary) + "\n\nExamples:\n" + program.examples, program.name);
  app.set_version_flag("--version", fmt::format("{} {} (bundle format {}.{})", program.name, kVersion,
                                                kFormatMajor, kFormatMinor));
  app.require_subcommand(1);
  app.footer(exit_code_table());
  app.formatter(std::make_shared<HelpFormatter>(program));
  app.get_formatter()->column_width(34);

  When color = When::kAuto;
  std::vector<std::pair<CLI::App*, std::function<Exit(Console&)>>> runners;
  for (const Command& command : program.commands) {
    CLI::App* sub = app.add_subcommand(command.name, command.summary);
    runners.emplace_back(sub, command.declare(*sub));
    add_choice<When>(*sub, "--color", color,
                     {{"auto", When::kAuto}, {"always", When::kAlways}, {"never", When::kNever}},
                     "Colour messages (default auto; NO_COLOR is honoured)");
    sub->footer(exit_code_table());
    for (CLI::Option* option : sub->get_options())
      if (option->get_positional()) option->type_name("");
  }

  // Not for users: the build makes man pages and completion scripts by it.
  if (argc == 3 && std::string_view(argv[1]) == "--generate") {
    const Result<std::string> document = shell_document(app, argv[2]);
    if (document) console.out(document.value());
    if (!document) console.error(document.error().finding);
    return document ? Exit::kOk : Exit::kUsage;
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
    if (const std::string unknown = unknown_below(deepest(app), argc, argv); !unknown.empty()) {
      console.error(unknown);
      return Exit::kUsage;
    }
    const std::optional<Mistyped> mistyped = mistyped_option(deepest(app), argc, argv);
    const auto is = [&](CLI::ExitCodes code) { return problem.get_exit_code() == static_cast<int>(code); };
    // What is missing may stand there, mistyped; CLI11 looks for what is missing first.
    std::string finding = one_line(problem.what());
    if (is(CLI::ExitCodes::RequiredError) && mistyped)
      finding = fmt::format("The following argument was not expected: {}", mistyped->word);
    if (mistyped && (is(CLI::ExitCodes::RequiredError) || is(CLI::ExitCodes::ExtrasError)))
      finding += mistyped->guess;
    std::string names;
    for (const CLI::App* at = &deepest(app); at != nullptr; at = at->get_parent())
      names.insert(0, at->get_name() + (names.empty() ? "" : " "));
    console.error(fmt::format("{}; see `{} --help`", finding, names));
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
