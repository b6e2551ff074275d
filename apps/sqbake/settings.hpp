// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>

#include "sqmap/asset/result.hpp"
#include "sqmap/bake/bake.hpp"

namespace CLI {
class App;
}

namespace sqmap::apps {

/// What to write where a mesh cannot be baked as asked.
enum class Fallback { kNone, kSuperquadric };

/// Stands for as many bytes as the machine has.
inline constexpr std::uint64_t kMemoryOfTheMachine = ~std::uint64_t{0};

/// Everything that can be chosen for one mesh.
struct AssetOptions {
  bake::BakeOptions bake;
  double timeout_s = 900;                            ///< of one worker; 0: none
  std::uint64_t memory_bytes = kMemoryOfTheMachine;  ///< of one worker; 0: no limit
  Fallback fallback = Fallback::kNone;
};

/// One of those choices. Its name is that of the command line's option and of the key in a TOML file.
struct Setting {
  const char* name;
  const char* type_name;
  const char* help;
  std::string (*default_text)();
  Outcome (*apply)(AssetOptions& options, std::string_view text);
};

/// All of them, in the order they are shown and applied in: a quality before the limits it sets.
std::span<const Setting> all_settings();
const Setting* find_setting(std::string_view name);

/// Texts by the name of the setting.
using SettingTexts = std::map<std::string, std::string, std::less<>>;

/// A text and where it was given, e.g. `command line` or `models/sqbake.toml:3`.
struct SettingValue {
  std::string text;
  std::string source;
};
using SettingValues = std::map<std::string, SettingValue, std::less<>>;

/// The texts alone.
SettingTexts texts_of(const SettingValues& values);

/// What a quality stands for: texts of max-error, max-parts and max-bytes; none where there is no such
/// quality.
SettingTexts limits_of(std::string_view quality);

/// Limits that are given hold, whatever the quality. Errors: kBadOption with the setting and what it must be.
Result<AssetOptions> options_from(const SettingTexts& texts);

/// A message of libbake, or a difference of two sets of its options, with the first option that it names
/// replaced by that of the command line: `max_parts = 0` becomes `--max-parts = 0`.
std::string with_setting_names(std::string text);

/// Adds `--NAME` for each named setting. A text that cannot be right is refused while parsing. `texts` must
/// outlive the parsing.
void add_setting_options(CLI::App& app, std::span<const std::string_view> names, SettingTexts& texts);
void add_all_setting_options(CLI::App& app, SettingTexts& texts);

}  // namespace sqmap::apps
