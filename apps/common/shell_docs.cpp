// SPDX-License-Identifier: Apache-2.0
#include "shell_docs.hpp"

#include <algorithm>
#include <cctype>
#include <functional>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "sqmap/asset/version.hpp"

namespace sqmap::apps {
namespace {

std::vector<const CLI::App*> subcommands(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App*) { return true; });
}

/// "sqbake cache gc"
std::string path_of(const CLI::App& app) {
  return app.get_parent() != nullptr ? path_of(*app.get_parent()) + " " + app.get_name() : app.get_name();
}

/// The program, then every command below it.
void visit(const CLI::App& app, const std::function<void(const CLI::App&)>& each) {
  each(app);
  for (const CLI::App* sub : subcommands(app)) visit(*sub, each);
}

/// Those of an app that are shown; of a nested command also those it takes over from the one above.
std::vector<const CLI::Option*> options_of(const CLI::App& app) {
  std::vector<const CLI::Option*> options;
  for (const CLI::Option* option : app.get_options())
    if (!option->get_group().empty() && !option->get_positional()) options.push_back(option);
  if (app.get_fallthrough() && app.get_parent() != nullptr)
    for (const CLI::Option* option : options_of(*app.get_parent()))
      if (option->get_lnames() != std::vector<std::string>{"help"}) options.push_back(option);
  return options;
}

bool takes_value(const CLI::Option& option) { return option.get_items_expected_max() > 0; }
bool takes_path(const CLI::Option& option) {
  return takes_value(option) &&
         (option.get_type_name().starts_with("FILE") || option.get_type_name() == "DIR");
}

/// Of an option whose value is one of a few words, these: its type is `text|json`.
std::vector<std::string> words_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const auto is_of_words = [](unsigned char c) {
    return std::islower(c) != 0 || std::isdigit(c) != 0 || c == '|';
  };
  std::vector<std::string> words;
  if (type.find('|') == std::string::npos || !std::ranges::all_of(type, is_of_words)) return words;
  for (std::size_t start = 0, end; start <= type.size(); start = end + 1) {
    end = std::min(type.find('|', start), type.size());
    words.push_back(type.substr(start, end - start));
  }
  return words;
}

/// "-j", "--jobs"
std::vector<std::string> names_of(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  return names;
}

std::string joined(const std::vector<std::string>& words, const char* between) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : between) + word;
  return text;
}

/// Help text on one line.
std::string one_line(const std::string& text) {
  std::string line;
  for (const char c : text)
    if (c != '\n' || line.empty() || line.back() != ' ') line += c == '\n' ? ' ' : c;
  return line;
}

/// Up to the first semicolon, colon or bracket: what fits beside an option in a menu.
std::string short_help(const CLI::Option& option) {
  const std::string line = one_line(option.get_description());
  const std::size_t end = std::min({line.find(';'), line.find(": "), line.find(" ("), line.size()});
  return line.substr(0, end);
}

/// The first sentence of an app's description.
std::string summary_of(const CLI::App& app) {
  const std::string line = one_line(app.get_description());
  return line.substr(0, line.find_first_of(".:"));
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
  return text;
}

std::string troff(const std::string& text) { return replaced(replaced(text, "\\", "\\e"), "-", "\\-"); }

/// Text with examples: lines that begin with two spaces are set as they are.
std::string troff_text(const std::string& text) {
  std::string page;
  bool is_literal = false;
  for (std::size_t start = 0; start < text.size();) {
    const std::size_t end = std::min(text.find('\n', start), text.size());
    const std::string line = text.substr(start, end - start);
    start = end + 1;
    if (const bool is_example = line.starts_with("  "); is_example != is_literal) {
      page += is_example ? ".PP\n.nf\n" : ".fi\n";
      is_literal = is_example;
    }
    if (line.empty()) {
      page += ".PP\n";
    } else {
      // A line that begins with a full stop or an apostrophe would be a request.
      page += (line[0] == '.' || line[0] == '\'' ? "\\&" : "") + troff(line) + "\n";
    }
  }
  return page + (is_literal ? ".fi\n" : "");
}

std::string troff_option(const CLI::Option& option) {
  std::string names = "\\fB" + troff(joined(names_of(option), ", ")) + "\\fR";
  if (takes_value(option)) names += " \\fI" + troff(option.get_type_name()) + "\\fR";
  return ".TP\n" + names + "\n" + troff_text(one_line(option.get_description()));
}

std::string man_page(const CLI::App& program) {
  std::string upper = program.get_name();
  std::ranges::transform(upper, upper.begin(),
                         [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  const std::string description = program.get_description(), summary = summary_of(program);
  std::string page = fmt::format(".TH {} 1 \"\" \"sqmap {}\" \"sqmap\"\n.SH NAME\n{} \\- {}\n.SH SYNOPSIS\n",
                                 upper, kVersion, program.get_name(), troff(summary));
  bool is_first = true;
  visit(program, [&](const CLI::App& app) {
    if (!subcommands(app).empty()) return;
    std::string arguments;
    for (const CLI::Option* option : app.get_options())
      if (option->get_positional())
        arguments += " " + option->get_name(true) + (option->get_items_expected_max() > 1 ? "..." : "");
    page += fmt::format("{}.B {}\n[\\fIOPTION\\fR]...{}\n", is_first ? "" : ".br\n", troff(path_of(app)),
                        troff(arguments));
    is_first = false;
  });
  page += ".SH DESCRIPTION\n" + troff_text(description);
  visit(program, [&](const CLI::App& app) {
    if (&app == &program) return;
    page += fmt::format(".SH \"{}\"\n", troff(path_of(app))) + troff_text(app.get_description());
    for (const CLI::Option* option : app.get_options())
      if (option->get_positional())
        page += ".TP\n\\fI" + troff(option->get_name(true)) + "\\fR\n" +
                troff_text(one_line(option->get_description()));
    for (const CLI::Option* option : options_of(app)) page += troff_option(*option);
  });
  return page + ".SH \"EXIT STATUS\"\n" + troff_text(program.get_footer());
}

/// The commands named so far decide what can follow; the word after an option that takes a path is a path,
/// and after one that takes one of a few words, one of these.
std::string bash_script(const CLI::App& program) {
  const std::string& name = program.get_name();
  std::string words, values;
  visit(program, [&](const CLI::App& app) {
    std::vector<std::string> choices;
    for (const CLI::App* sub : subcommands(app)) choices.push_back(sub->get_name());
    for (const CLI::Option* option : options_of(app)) {
      for (const std::string& each : names_of(*option)) {
        choices.push_back(each);
        if (takes_value(*option))
          values += fmt::format(
              "    '{} {}') kind={} ;;\n", path_of(app), each,
              takes_path(*option) ? "path" : fmt::format("'word {}'", joined(words_of(*option), " ")));
      }
    }
    words += fmt::format("    '{}') words='{}' ;;\n", path_of(app), joined(choices, " "));
  });
  std::string commands;
  visit(program,
        [&](const CLI::App& app) { commands += fmt::format("      '{}') path=$next ;;\n", path_of(app)); });
  return fmt::format(
      "# bash completion for {0}, made by `{0} --generate bash`\n"
      "_{0}() {{\n"
      "  local path={0} next word words='' kind='' current=${{COMP_WORDS[COMP_CWORD]}}\n"
      "  for word in \"${{COMP_WORDS[@]:1:COMP_CWORD-1}}\"; do\n"
      "    next=\"$path $word\"\n"
      "    case $next in\n{1}    esac\n"
      "  done\n"
      "  case \"$path ${{COMP_WORDS[COMP_CWORD-1]}}\" in\n{2}  esac\n"
      "  case $path in\n{3}  esac\n"
      "  compopt +o filenames 2>/dev/null\n"
      "  if [[ $kind == word* ]]; then\n"
      "    mapfile -t COMPREPLY < <(compgen -W \"${{kind#word}}\" -- \"$current\")\n"
      "    return\n"
      "  fi\n"
      "  if [[ $kind != path && ( $current == -* || ( -z $current && $words != -* ) ) ]]; then\n"
      "    mapfile -t COMPREPLY < <(compgen -W \"$words\" -- \"$current\")\n"
      "    return\n"
      "  fi\n"
      "  compopt -o filenames 2>/dev/null\n"
      "  mapfile -t COMPREPLY < <(compgen -f -- \"$current\")\n"
      "  if [[ -z $kind ]]; then\n"
      "    mapfile -t -O \"${{#COMPREPLY[@]}}\" COMPREPLY < <(compgen -W \"$words\" -- \"$current\")\n"
      "  fi\n"
      "}}\n"
      "complete -F _{0} {0}\n",
      name, commands, values, words);
}

std::string shell_quoted(const std::string& text) { return "'" + replaced(text, "'", "'\\''") + "'"; }

/// What offers the values of an option.
std::string zsh_action(const CLI::Option& option) {
  if (takes_path(option)) return "_files";
  const std::vector<std::string> words = words_of(option);
  return words.empty() ? "" : "(" + joined(words, " ") + ")";
}

std::string zsh_script(const CLI::App& program) {
  const auto function = [](const CLI::App& app) { return "_" + replaced(path_of(app), " ", "_"); };
  std::string script = fmt::format("#compdef {0}\n# zsh completion for {0}, made by `{0} --generate zsh`\n",
                                   program.get_name());
  visit(program, [&](const CLI::App& app) {
    script += function(app) + "() {\n  local curcontext=$curcontext state line\n  _arguments -C";
    for (const CLI::Option* option : options_of(app)) {
      const std::string help =
          replaced(replaced(replaced(short_help(*option), "[", "("), "]", ")"), ":", "\\:");
      for (const std::string& each : names_of(*option)) {
        std::string spec = fmt::format("{}[{}]", each, help);
        if (takes_value(*option))
          spec += fmt::format(":{}:{}", replaced(option->get_type_name(), ":", " "), zsh_action(*option));
        script += " \\\n    " + shell_quoted(spec);
      }
    }
    const std::vector<const CLI::App*> subs = subcommands(app);
    if (subs.empty()) {
      script += " \\\n    '*:file:_files'\n}\n";
      return;
    }
    script +=
        " \\\n    '1: :->command' \\\n    '*:: :->rest'\n  case $state in\n  command)\n    local -a "
        "commands=(";
    for (const CLI::App* sub : subs) {
      script += "\n      " + shell_quoted(sub->get_name() + ":" + replaced(summary_of(*sub), ":", "\\:"));
    }
    script += ")\n    _describe command commands ;;\n  rest)\n    case $line[1] in\n";
    for (const CLI::App* sub : subs)
      script += fmt::format("    {}) {} ;;\n", sub->get_name(), function(*sub));
    script += "    esac ;;\n  esac\n}\n";
  });
  return script + function(program) + " \"$@\"\n";
}

std::string fish_script(const CLI::App& program) {
  const std::string& name = program.get_name();
  std::string script = fmt::format("# fish completion for {0}, made by `{0} --generate fish`\n", name);
  visit(program, [&](const CLI::App& app) {
    std::vector<std::string> below, here;
    for (const CLI::App* sub : subcommands(app)) below.push_back(sub->get_name());
    for (const CLI::App* at = &app; at->get_parent() != nullptr; at = at->get_parent())
      here.insert(here.begin(), "__fish_seen_subcommand_from " + at->get_name());
    if (&app == &program) here.emplace_back("__fish_use_subcommand");
    std::string condition = joined(here, "; and ");
    for (const CLI::App* sub : subcommands(app)) {
      std::string only = condition;
      if (&app != &program) only += "; and not __fish_seen_subcommand_from " + joined(below, " ");
      script += fmt::format("complete -c {} -f -n {} -a {} -d {}\n", name, shell_quoted(only),
                            sub->get_name(), shell_quoted(summary_of(*sub)));
    }
    for (const CLI::Option* option : options_of(app)) {
      std::string line = fmt::format("complete -c {} -n {}", name, shell_quoted(condition));
      for (const std::string& each : option->get_snames()) line += " -s " + each;
      for (const std::string& each : option->get_lnames()) line += " -l " + each;
      if (takes_value(*option)) line += takes_path(*option) ? " -r -F" : " -x";
      if (const std::vector<std::string> words = words_of(*option); !words.empty())
        line += " -a " + shell_quoted(joined(words, " "));
      script += line + " -d " + shell_quoted(short_help(*option)) + "\n";
    }
  });
  return script;
}

}  // namespace

Result<std::string> shell_document(const CLI::App& program, std::string_view kind) {
  if (kind == "man") return man_page(program);
  if (kind == "bash") return bash_script(program);
  if (kind == "zsh") return zsh_script(program);
  if (kind == "fish") return fish_script(program);
  return Error{Status::kBadOption, fmt::format("--generate {}: must be man, bash, zsh or fish", kind), ""};
}

}  // namespace sqmap::apps
