// SPDX-License-Identifier: GPL-3.0-or-later
#include "quantities.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace sqmap::apps {
namespace {

struct Unit {
  std::string_view name;
  double metres;
};
constexpr std::array<Unit, 6> kUnits{
    {{"m", 1}, {"cm", 1e-2}, {"mm", 1e-3}, {"um", 1e-6}, {"in", 0.0254}, {"ft", 0.3048}}};

const Unit* find_unit(std::string_view name) {
  for (const Unit& unit : kUnits)
    if (unit.name == name) return &unit;
  return nullptr;
}

/// A finite number > 0 at the start of the text, and what follows it.
bool split_number(std::string_view text, double& number, std::string_view& rest) {
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (code != std::errc{} || !std::isfinite(number) || !(number > 0)) return false;
  rest = text.substr(static_cast<std::size_t>(end - text.data()));
  while (!rest.empty() && rest.front() == ' ') rest.remove_prefix(1);
  return true;
}

Error bad(std::string_view text, const char* required) {
  return {Status::kBadOption, fmt::format("`{}`, must be {}", text, required), ""};
}

}  // namespace

Result<double> parse_unit(std::string_view text) {
  if (const Unit* unit = find_unit(text)) return unit->metres;
  double metres = 0;
  std::string_view rest;
  if (split_number(text, metres, rest) && rest.empty()) return metres;
  return bad(text, "m, cm, mm, um, in, ft or a number of metres > 0");
}

Result<ErrorTarget> parse_error_target(std::string_view text) {
  double number = 0;
  std::string_view rest;
  if (split_number(text, number, rest)) {
    if (rest.empty() || rest == "%") return ErrorTarget{number, 0};
    if (const Unit* unit = find_unit(rest)) return ErrorTarget{0, number * unit->metres};
  }
  return bad(text, "a percentage of R_max such as 0.1%, or a length such as 0.5mm, > 0");
}

Result<std::uint64_t> parse_bytes(std::string_view text) {
  std::uint64_t number = 0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), number);
  const std::string_view suffix = text.substr(static_cast<std::size_t>(end - text.data()));
  constexpr std::array<std::pair<std::string_view, int>, 7> kSuffixes{
      {{"", 0}, {"K", 10}, {"KiB", 10}, {"M", 20}, {"MiB", 20}, {"G", 30}, {"GiB", 30}}};
  if (code == std::errc{} && number > 0)
    for (const auto& [name, shift] : kSuffixes)
      if (suffix == name && number <= (std::numeric_limits<std::uint64_t>::max() >> shift))
        return number << shift;
  return bad(text, "a number of bytes > 0, with K, M or G for powers of 1024");
}

Result<double> parse_duration(std::string_view text) {
  if (text == "none") return 0.0;
  constexpr std::array<std::pair<std::string_view, double>, 4> kSuffixes{
      {{"", 1}, {"s", 1}, {"m", 60}, {"h", 3600}}};
  constexpr double kLongest_s = 1e7;  // fits every clock's integers
  double number = 0;
  std::string_view rest;
  if (split_number(text, number, rest))
    for (const auto& [name, seconds] : kSuffixes)
      if (rest == name && number * seconds <= kLongest_s) return number * seconds;
  return bad(text, "a time > 0 such as 90s, 5m or 2h, or none");
}

}  // namespace sqmap::apps
