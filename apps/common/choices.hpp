// SPDX-License-Identifier: Apache-2.0
// Options that take one of a few words, as the help names them and in no other form: CLI11's own transformers
// also take the numbers behind the words, and print both in messages.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "spelling.hpp"

namespace sqmap::apps {

/// Adds an option that sets `value`, which must outlive the parsing, to what stands behind the word given.
/// Its type is the words, `auto|always|never`, as help and completion show them.
template <class Value>
CLI::Option* add_choice(CLI::App& app, const std::string& name, Value& value,
                        std::vector<std::pair<std::string, Value>> choices, const std::string& help) {
  std::string type;
  for (const auto& [word, meaning] : choices) type += (type.empty() ? "" : "|") + word;
  CLI::Option* option = app.add_option_function<std::string>(
      name,
      [name, &value, choices = std::move(choices)](const std::string& word) {
        std::vector<std::string> words;
        for (const auto& [known, meaning] : choices) {
          if (known == word) {
            value = meaning;
            return;
          }
          words.push_back(known);
        }
        throw CLI::ValidationError(name, none_of(word, words));
      },
      help);
  return option->type_name(type);
}

/// The same, where the word itself is the value.
inline CLI::Option* add_words(CLI::App& app, const std::string& name, std::string& value,
                              const std::vector<std::string>& words, const std::string& help) {
  std::vector<std::pair<std::string, std::string>> choices;
  for (const std::string& word : words) choices.emplace_back(word, word);
  return add_choice(app, name, value, std::move(choices), help);
}

}  // namespace sqmap::apps
