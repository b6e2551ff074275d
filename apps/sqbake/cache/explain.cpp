// SPDX-License-Identifier: GPL-3.0-or-later
#include "explain.hpp"

#include <algorithm>
#include <map>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace sqmap::apps {
namespace {

using Json = nlohmann::json;

std::optional<std::string> input_change(const BakeInput* last, const BakeInput* now, bool is_mesh) {
  const std::string what =
      fmt::format("{} {}", is_mesh ? "mesh" : "file", now != nullptr ? now->name : last->name);
  const bool was_there = last != nullptr && !last->hash.empty(),
             is_there = now != nullptr && !now->hash.empty();
  if (was_there && is_there) return last->hash == now->hash ? std::nullopt : std::optional(what + " changed");
  if (is_there) return what + " is new";
  if (was_there) return what + " is gone";
  return std::nullopt;
}

const BakeInput* find(const std::vector<BakeInput>& inputs, const std::string& name) {
  const auto found =
      std::find_if(inputs.begin() + 1, inputs.end(), [&](const BakeInput& i) { return i.name == name; });
  return found == inputs.end() ? nullptr : &*found;
}

void add_input_changes(const OutputRecord& last, const OutputRecord& now, std::vector<std::string>& lines) {
  const BakeInput &last_mesh = last.inputs.front(), &mesh = now.inputs.front();
  if (last_mesh.name != mesh.name)
    lines.push_back(fmt::format("mesh is called {}, was {}", mesh.name, last_mesh.name));
  if (const auto line = input_change(&last_mesh, &mesh, true)) lines.push_back(*line);
  for (std::size_t i = 1; i < now.inputs.size(); ++i)
    if (const auto line = input_change(find(last.inputs, now.inputs[i].name), &now.inputs[i], false))
      lines.push_back(*line);
  for (std::size_t i = 1; i < last.inputs.size(); ++i)
    if (find(now.inputs, last.inputs[i].name) == nullptr)
      if (const auto line = input_change(&last.inputs[i], nullptr, false)) lines.push_back(*line);
}

/// Every value by its path: {"fit": {"quick": true}} gives "fit.quick" -> "true".
void flatten(const Json& json, const std::string& path, std::map<std::string, std::string>& values) {
  if (!json.is_object()) {
    values[path] = json.dump(-1, ' ', false, Json::error_handler_t::replace);
    return;
  }
  for (const auto& [name, value] : json.items())
    flatten(value, path.empty() ? name : fmt::format("{}.{}", path, name), values);
}

std::map<std::string, std::string> options_of(const std::string& text) {
  std::map<std::string, std::string> values;
  flatten(Json::parse(text, nullptr, false), "", values);
  return values;
}

void add_option_changes(const std::string& last, const std::string& now, std::vector<std::string>& lines) {
  if (last == now) return;
  const std::map<std::string, std::string> before = options_of(last), after = options_of(now);
  for (const auto& [name, value] : after) {
    const auto old = before.find(name);
    if (old == before.end()) {
      lines.push_back(fmt::format("option {}: {}, was not there", name, value));
    } else if (old->second != value) {
      lines.push_back(fmt::format("option {}: {}, was {}", name, value, old->second));
    }
  }
  for (const auto& [name, value] : before)
    if (!after.contains(name)) lines.push_back(fmt::format("option {}: no more, was {}", name, value));
}

}  // namespace

std::vector<std::string> differences(const OutputRecord& last, const OutputRecord& now) {
  std::vector<std::string> lines;
  add_input_changes(last, now, lines);
  add_option_changes(last.options_json, now.options_json, lines);
  if (last.algorithm != now.algorithm)
    lines.push_back(fmt::format("algorithm {}, was {}", now.algorithm, last.algorithm));
  if (last.format != now.format)
    lines.push_back(fmt::format("bundle format {}, was {}", now.format, last.format));
  return lines;
}

}  // namespace sqmap::apps
