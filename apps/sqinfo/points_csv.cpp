// SPDX-License-Identifier: Apache-2.0
#include "points_csv.hpp"

#include <charconv>
#include <cmath>
#include <cstddef>

#include <fmt/format.h>

namespace sqmap::apps {
namespace {

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r";
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

bool parse_number(std::string_view field, float& value) {
  if (field.starts_with('+')) field.remove_prefix(1);
  const auto [end, code] = std::from_chars(field.data(), field.data() + field.size(), value);
  return code == std::errc{} && end == field.data() + field.size() && std::isfinite(value);
}

bool parse_point(std::string_view line, Vec3f& point) {
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t comma = axis < 2 ? line.find(',') : line.size();
    if (comma == std::string_view::npos || !parse_number(trimmed(line.substr(0, comma)), point[axis]))
      return false;
    if (axis < 2) line.remove_prefix(comma + 1);
  }
  return true;
}

bool is_header(std::string_view line) {
  float ignored = 0;
  return !parse_number(trimmed(line.substr(0, line.find(','))), ignored) &&
         line.find_first_of("0123456789") != 0;
}

}  // namespace

Result<std::vector<Vec3f>> parse_points(std::string_view text) {
  std::vector<Vec3f> points;
  bool is_first = true;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::size_t end = text.find('\n');
    const std::string_view line = trimmed(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (line.empty()) continue;
    Vec3f point;
    if (parse_point(line, point)) {
      points.push_back(point);
    } else if (!is_first || !is_header(line)) {
      return Error{
          Status::kInvalidAsset,
          fmt::format("line {}: `{}`, must be three finite numbers x,y,z", number, line.substr(0, 60)),
          "correct the line; coordinates are in metres"};
    }
    is_first = false;
  }
  return points;
}

}  // namespace sqmap::apps
