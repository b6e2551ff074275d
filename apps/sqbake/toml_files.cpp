// SPDX-License-Identifier: GPL-3.0-or-later
#include "toml_files.hpp"

#include <optional>
#include <sstream>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <toml++/toml.h>

#include "../common/files.hpp"
#include "../common/spelling.hpp"
#include "glob.hpp"

namespace sqmap::apps {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kLargestFile_bytes = std::uint64_t{64} << 20;

std::string place(const fs::path& path, const toml::node& node) {
  return fmt::format("{}:{}", path.string(), node.source().begin.line);
}

Error wrong(const fs::path& path, const toml::node& node, const std::string& finding,
            std::string remedy = "") {
  return {Status::kBadOption, fmt::format("{}: {}", place(path, node), finding), std::move(remedy)};
}

Result<toml::table> parse(const fs::path& path) {
  const Result<std::vector<std::uint8_t>> bytes = read_file(path, kLargestFile_bytes);
  if (!bytes) return bytes.error();
  try {
    return toml::parse(as_text(bytes.value()));
  } catch (const toml::parse_error& error) {
    return Error{Status::kBadOption,
                 fmt::format("{}:{}: {}", path.string(), error.source().begin.line, error.description()),
                 "see https://toml.io for the syntax"};
  }
}

/// The text of a value as the command line would give it. No setting takes true or false: the message that
/// refuses them says what it takes.
std::optional<std::string> text_of(const toml::node& node) {
  if (auto text = node.value_exact<std::string>()) return text;
  if (const auto number = node.value_exact<std::int64_t>()) return fmt::to_string(*number);
  if (const auto number = node.value_exact<double>()) return fmt::format("{}", *number);
  if (const auto truth = node.value_exact<bool>()) return *truth ? "true" : "false";
  return std::nullopt;
}

/// Takes the settings of a table; `others` are the keys that the caller reads itself.
Result<SettingValues> settings_in(const toml::table& table, const fs::path& path,
                                  std::initializer_list<const char*> others) {
  SettingValues values;
  std::vector<std::string> known(others.begin(), others.end());
  for (const Setting& setting : all_settings()) known.emplace_back(setting.name);
  for (const auto& [key, node] : table) {
    const std::string_view name = key.str();
    bool is_other = false;
    for (const char* other : others) is_other = is_other || name == other;
    if (is_other) continue;
    const Setting* setting = find_setting(name);
    if (setting == nullptr)
      return wrong(path, node, fmt::format("unknown key `{}`{}", name, did_you_mean(name, known)));
    const std::optional<std::string> text = text_of(node);
    if (!text) return wrong(path, node, fmt::format("{}: must be a string or a number", name));
    SettingTexts alone{{setting->name, *text}};
    if (const Result<AssetOptions> ok = options_from(alone); !ok)
      return wrong(path, node, ok.error().finding);
    values[setting->name] = {*text, place(path, node)};
  }
  return values;
}

/// The tables of `[[name]]`; none when the key is absent.
Result<std::vector<const toml::table*>> tables_of(const toml::table& root, const char* name,
                                                  const fs::path& path) {
  std::vector<const toml::table*> tables;
  const toml::node* node = root.get(name);
  if (node == nullptr) return tables;
  const toml::array* array = node->as_array();
  if (array == nullptr) return wrong(path, *node, fmt::format("`{0}` must be given as [[{0}]]", name));
  for (const toml::node& entry : *array) {
    if (entry.as_table() == nullptr)
      return wrong(path, entry, fmt::format("`{0}` must be given as [[{0}]]", name));
    tables.push_back(entry.as_table());
  }
  return tables;
}

Result<SettingValues> defaults_in(const toml::table& root, const fs::path& path) {
  const toml::node* node = root.get("default");
  if (node == nullptr) return SettingValues{};
  if (node->as_table() == nullptr) return wrong(path, *node, "`default` must be given as [default]");
  return settings_in(*node->as_table(), path, {});
}

/// Refuses keys at the top of a file other than the two that it may have.
Outcome check_top(const toml::table& root, const fs::path& path, const char* list) {
  const std::vector<std::string> known{"default", list};
  for (const auto& [key, node] : root) {
    if (key.str() == "default" || key.str() == list) continue;
    return wrong(path, node, fmt::format("unknown key `{}`{}", key.str(), did_you_mean(key.str(), known)),
                 fmt::format("settings stand below [default] or [[{}]]", list));
  }
  return Done{};
}

Result<std::string> required_text(const toml::table& table, const char* key, const fs::path& path) {
  const toml::node* node = table.get(key);
  const auto text = node == nullptr ? std::nullopt : node->value_exact<std::string>();
  if (!text || text->empty()) return wrong(path, table, fmt::format("`{}` is missing or no text", key));
  return *text;
}

}  // namespace

Result<ProjectFile> read_project_file(const fs::path& path) {
  const Result<toml::table> root = parse(path);
  if (!root) return root.error();
  if (const Outcome ok = check_top(root.value(), path, "rule"); !ok) return ok.error();
  ProjectFile file{path, {}, {}};
  Result<SettingValues> defaults = defaults_in(root.value(), path);
  if (!defaults) return defaults.error();
  file.defaults = std::move(defaults).value();
  const auto tables = tables_of(root.value(), "rule", path);
  if (!tables) return tables.error();
  for (const toml::table* table : tables.value()) {
    Result<std::string> pattern = required_text(*table, "match", path);
    if (!pattern) return pattern.error();
    if (const std::string fault = glob_fault(pattern.value()); !fault.empty())
      return wrong(path, *table->get("match"), fmt::format("match `{}`: {}", pattern.value(), fault));
    Result<SettingValues> values = settings_in(*table, path, {"match"});
    if (!values) return values.error();
    for (auto& [name, value] : values.value()) value.source += fmt::format(" (rule `{}`)", pattern.value());
    file.rules.push_back({std::move(pattern).value(), std::move(values).value()});
  }
  return file;
}

Result<Manifest> read_manifest(const fs::path& path) {
  const Result<toml::table> root = parse(path);
  if (!root) return root.error();
  if (const Outcome ok = check_top(root.value(), path, "asset"); !ok) return ok.error();
  Manifest manifest{path, {}, {}};
  Result<SettingValues> defaults = defaults_in(root.value(), path);
  if (!defaults) return defaults.error();
  manifest.defaults = std::move(defaults).value();
  const auto tables = tables_of(root.value(), "asset", path);
  if (!tables) return tables.error();
  for (const toml::table* table : tables.value()) {
    const Result<std::string> input = required_text(*table, "input", path);
    if (!input) return input.error();
    ManifestAsset asset{input.value(), {}, {}};
    if (const toml::node* node = table->get("output")) {
      const Result<std::string> output = required_text(*table, "output", path);
      if (!output) return output.error();
      asset.output = fs::path(output.value()).lexically_normal();
      if (asset.output.is_absolute() || *asset.output.begin() == ".." || asset.output.extension() != ".h5")
        return wrong(
            path, *node,
            fmt::format("output `{}`, must be a name ending in .h5 below the output folder", output.value()));
    }
    Result<SettingValues> values = settings_in(*table, path, {"input", "output"});
    if (!values) return values.error();
    asset.values = std::move(values).value();
    manifest.assets.push_back(std::move(asset));
  }
  if (manifest.assets.empty())
    return Error{Status::kBadOption, fmt::format("{}: names no [[asset]]", path.string()), ""};
  return manifest;
}

Result<SettingValues> read_sidecar(const fs::path& path) {
  const Result<toml::table> root = parse(path);
  if (!root) return root.error();
  return settings_in(root.value(), path, {});
}

}  // namespace sqmap::apps
