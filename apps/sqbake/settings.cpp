// SPDX-License-Identifier: GPL-3.0-or-later
#include "settings.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "../common/spelling.hpp"
#include "quantities.hpp"

namespace sqmap::apps {
namespace {

// With much less a worker cannot even say that it has too little.
constexpr std::uint64_t kLeastMemory_bytes = std::uint64_t{16} << 20;

template <class Value>
using Names = std::span<const std::pair<std::string_view, Value>>;

constexpr std::array<std::pair<std::string_view, bake::UpAxis>, 3> kUpNames{
    {{"x", bake::UpAxis::kX}, {"y", bake::UpAxis::kY}, {"z", bake::UpAxis::kZ}}};
constexpr std::array<std::pair<std::string_view, bake::Repair>, 3> kRepairNames{
    {{"none", bake::Repair::kNone}, {"safe", bake::Repair::kSafe}, {"all", bake::Repair::kAll}}};
constexpr std::array<std::pair<std::string_view, bake::Quality>, 3> kQualityNames{
    {{"draft", bake::Quality::kDraft},
     {"standard", bake::Quality::kStandard},
     {"fine", bake::Quality::kFine}}};
constexpr std::array<std::pair<std::string_view, bool>, 2> kSwitchNames{{{"off", false}, {"on", true}}};
constexpr std::array<std::pair<std::string_view, Fallback>, 2> kFallbackNames{
    {{"none", Fallback::kNone}, {"superquadric", Fallback::kSuperquadric}}};

template <class Value>
Outcome choose(std::string_view text, Names<Value> names, Value& value) {
  std::vector<std::string> words;
  for (const auto& [name, named] : names) {
    if (name == text) {
      value = named;
      return Done{};
    }
    words.emplace_back(name);
  }
  return Error{Status::kBadOption, none_of(text, words), ""};
}

template <class Value>
std::string name_of(Value value, Names<Value> names) {
  for (const auto& [name, named] : names)
    if (named == value) return std::string(name);
  return "";
}

Outcome apply_unit(AssetOptions& options, std::string_view text) {
  const Result<double> metres = parse_unit(text);
  if (!metres) return metres.error();
  options.bake.read.metres_per_unit = metres.value();
  return Done{};
}

Outcome apply_up(AssetOptions& options, std::string_view text) {
  return choose<bake::UpAxis>(text, kUpNames, options.bake.read.up);
}

Outcome apply_repair(AssetOptions& options, std::string_view text) {
  return choose<bake::Repair>(text, kRepairNames, options.bake.repair.policy);
}

Outcome apply_quality(AssetOptions& options, std::string_view text) {
  bake::Quality quality{};
  if (const Outcome ok = choose<bake::Quality>(text, kQualityNames, quality); !ok) return ok.error();
  options.bake.set(quality);
  return Done{};
}

Outcome apply_max_error(AssetOptions& options, std::string_view text) {
  const Result<ErrorTarget> target = parse_error_target(text);
  if (!target) return target.error();
  // The one that does not hold is as by default, so that it does not show in what is recorded.
  const bool is_length = target.value().length_m > 0;
  options.bake.max_error_percent = is_length ? bake::BakeOptions{}.max_error_percent : target.value().percent;
  options.bake.max_error_m = target.value().length_m;
  return Done{};
}

Outcome apply_max_parts(AssetOptions& options, std::string_view text) {
  std::uint32_t count = 0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), count);
  if (code != std::errc{} || end != text.data() + text.size())
    return Error{Status::kBadOption, fmt::format("`{}`, must be a number in [1, {}]", text, kMaxParts), ""};
  options.bake.max_parts = count;  // BakeOptions::check knows the range
  return Done{};
}

Outcome apply_max_bytes(AssetOptions& options, std::string_view text) {
  const Result<std::uint64_t> bytes = parse_bytes(text);
  if (!bytes) return bytes.error();
  options.bake.max_bytes = bytes.value();
  return Done{};
}

Outcome apply_conservative(AssetOptions& options, std::string_view text) {
  return choose<bool>(text, kSwitchNames, options.bake.conservative);
}

Outcome apply_taper(AssetOptions& options, std::string_view text) {
  return choose<bool>(text, kSwitchNames, options.bake.fit.taper);
}

Outcome apply_bend(AssetOptions& options, std::string_view text) {
  return choose<bool>(text, kSwitchNames, options.bake.fit.bend);
}

Outcome apply_timeout(AssetOptions& options, std::string_view text) {
  const Result<double> seconds = parse_duration(text);
  if (!seconds) return seconds.error();
  options.timeout_s = seconds.value();
  return Done{};
}

Outcome apply_memory(AssetOptions& options, std::string_view text) {
  if (text == "none" || text == "machine") {
    options.memory_bytes = text == "none" ? 0 : kMemoryOfTheMachine;
    return Done{};
  }
  const Result<std::uint64_t> bytes = parse_bytes(text);
  if (!bytes) return Error{Status::kBadOption, bytes.error().finding + ", or machine, or none", ""};
  if (bytes.value() < kLeastMemory_bytes)
    return Error{Status::kBadOption,
                 fmt::format("`{}`, must be at least 16M: a worker needs more by itself", text), ""};
  options.memory_bytes = bytes.value();
  return Done{};
}

Outcome apply_fallback(AssetOptions& options, std::string_view text) {
  return choose<Fallback>(text, kFallbackNames, options.fallback);
}

constexpr AssetOptions kDefaults;

std::string default_unit() { return "m"; }
std::string default_up() { return name_of<bake::UpAxis>(kDefaults.bake.read.up, kUpNames); }
std::string default_repair() { return name_of<bake::Repair>(kDefaults.bake.repair.policy, kRepairNames); }
std::string max_error_text(const bake::BakeOptions& options) {
  return fmt::format("{}%", options.max_error_percent);
}
std::string max_parts_text(const bake::BakeOptions& options) { return fmt::to_string(options.max_parts); }
std::string max_bytes_text(const bake::BakeOptions& options) {
  return fmt::format("{}K", options.max_bytes / 1024);
}
std::string default_quality() { return "standard"; }
std::string default_max_error() { return max_error_text(kDefaults.bake); }
std::string default_max_parts() { return max_parts_text(kDefaults.bake); }
std::string default_max_bytes() { return max_bytes_text(kDefaults.bake); }
std::string default_conservative() { return name_of<bool>(kDefaults.bake.conservative, kSwitchNames); }
std::string default_taper() { return name_of<bool>(kDefaults.bake.fit.taper, kSwitchNames); }
std::string default_bend() { return name_of<bool>(kDefaults.bake.fit.bend, kSwitchNames); }
std::string default_timeout() { return fmt::format("{}s", kDefaults.timeout_s); }
std::string default_memory() { return "machine"; }
std::string default_fallback() { return name_of<Fallback>(kDefaults.fallback, kFallbackNames); }

constexpr std::array<Setting, 13> kSettings{{
    {"unit", "UNIT", "Unit of the coordinates: m, cm, mm, um, in, ft or a number of metres", default_unit,
     apply_unit},
    {"up", "x|y|z", "Axis of the input that points up; turned to z", default_up, apply_up},
    {"repair", "none|safe|all",
     "none: drop only faces without area; safe: also weld, drop duplicates,\norient; all: also fill small "
     "holes",
     default_repair, apply_repair},
    {"quality", "draft|standard|fine", "Sets the three limits below, where they are not given themselves",
     default_quality, apply_quality},
    {"max-error", "PCT|LENGTH",
     "Stop refining at this mean error of eq. 35: a percentage of R_max, the\nlargest distance between two "
     "vertices, or a length such as 0.2mm",
     default_max_error, apply_max_error},
    {"max-parts", "COUNT", "Use at most this many parts", default_max_parts, apply_max_parts},
    {"max-bytes", "BYTES", "Encoded size of the maps, about; K, M and G are powers of 1024",
     default_max_bytes, apply_max_bytes},
    {"conservative", "on|off",
     "Also store bounds of the surface, which tell what is surely inside or outside;\nneeds a closed mesh",
     default_conservative, apply_conservative},
    {"taper", "on|off",
     "Taper superquadrics where that saves memory at the target error; a bake takes\nabout 1.5 times as long",
     default_taper, apply_taper},
    {"bend", "on|off",
     "Bend superquadrics where that saves memory at the target error; not with\n--conservative", default_bend,
     apply_bend},
    {"timeout", "TIME", "End the bake of a mesh after this time: 90s, 5m, 2h or none", default_timeout,
     apply_timeout},
    {"memory", "BYTES",
     "Memory (heap) that the bake of a mesh may take: e.g. 2G; machine: as much as the\nmachine has, which "
     "stops what could never fit; or none",
     default_memory, apply_memory},
    {"fallback", "none|superquadric",
     "For a mesh that ran into a limit, crashed or could not be baked:\nnone, or superquadric: bake one for "
     "the "
     "whole mesh, marked as degraded",
     default_fallback, apply_fallback},
}};

}  // namespace

std::span<const Setting> all_settings() { return kSettings; }

const Setting* find_setting(std::string_view name) {
  const auto entry =
      std::ranges::find_if(kSettings, [&](const Setting& setting) { return setting.name == name; });
  return entry == kSettings.end() ? nullptr : &*entry;
}

SettingTexts texts_of(const SettingValues& values) {
  SettingTexts texts;
  for (const auto& [name, value] : values) texts.emplace(name, value.text);
  return texts;
}

SettingTexts limits_of(std::string_view quality) {
  AssetOptions options;
  if (!apply_quality(options, quality)) return {};
  return {{"max-error", max_error_text(options.bake)},
          {"max-parts", max_parts_text(options.bake)},
          {"max-bytes", max_bytes_text(options.bake)}};
}

Result<AssetOptions> options_from(const SettingTexts& texts) {
  for (const auto& [name, text] : texts)
    if (find_setting(name) == nullptr)
      return Error{Status::kBadOption, fmt::format("unknown setting `{}`", name), ""};
  AssetOptions options;
  for (const Setting& setting : kSettings) {
    const auto given = texts.find(setting.name);
    if (given == texts.end()) continue;
    if (const Outcome ok = setting.apply(options, given->second); !ok)
      return Error{Status::kBadOption, fmt::format("{}: {}", setting.name, ok.error().finding), ""};
  }
  if (const Outcome ok = options.bake.check(); !ok)
    return Error{ok.error().status, with_setting_names(ok.error().finding), ok.error().remedy};
  return options;
}

std::string with_setting_names(std::string text) {
  // Options of the library, as its messages and its JSON call them, and the settings they come from.
  constexpr std::array<std::pair<std::string_view, std::string_view>, 7> kNames{
      {{"max_error_percent", "max-error (percent)"},
       {"max_error_m", "max-error (metres)"},
       {"max_parts", "max-parts"},
       {"max_bytes", "max-bytes"},
       {"read.metres_per_unit", "unit (metres)"},
       {"read.up", "up"},
       {"repair.policy", "repair"}}};
  for (const auto& [option, setting] : kNames)
    if (const std::size_t at = text.find(option); at != std::string::npos)
      return text.replace(at, option.size(), fmt::format("--{}", setting));
  return text;
}

void add_setting_options(CLI::App& app, std::span<const std::string_view> names, SettingTexts& texts) {
  for (const std::string_view name : names) {
    const Setting& setting = *find_setting(name);
    const std::string option = fmt::format("--{}", setting.name);
    app.add_option_function<std::string>(
           option,
           [&setting, &texts, option](const std::string& text) {
             AssetOptions scratch;
             if (const Outcome ok = setting.apply(scratch, text); !ok)
               throw CLI::ValidationError(option, ok.error().finding);
             texts[setting.name] = text;
           },
           fmt::format("{} (default {})", setting.help, setting.default_text()))
        ->type_name(setting.type_name);
  }
}

void add_all_setting_options(CLI::App& app, SettingTexts& texts) {
  std::array<std::string_view, kSettings.size()> names{};
  std::ranges::transform(kSettings, names.begin(), &Setting::name);
  add_setting_options(app, names, texts);
}

}  // namespace sqmap::apps
