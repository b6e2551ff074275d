// SPDX-License-Identifier: Apache-2.0
#include "spelling.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace sqmap::apps {
namespace {

// Longer texts are no misspelt names; the bound keeps the table small.
constexpr std::size_t kLongestName = 64;

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

/// Optimal string alignment distance, where capitals are as good as small letters.
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  for (std::size_t k = 0; k <= b.size(); ++k) last[k] = k;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t k = 1; k <= b.size(); ++k) {
      row[k] =
          std::min({last[k] + 1, row[k - 1] + 1, last[k - 1] + (lower(a[i - 1]) == lower(b[k - 1]) ? 0 : 1)});
      if (i > 1 && k > 1 && lower(a[i - 1]) == lower(b[k - 2]) && lower(a[i - 2]) == lower(b[k - 1]))
        row[k] = std::min(row[k], before[k - 2] + 1);
    }
    before.swap(last);
    last.swap(row);
  }
  return last[b.size()];
}

}  // namespace

std::string nearest_name(std::string_view text, std::span<const std::string> names) {
  if (text.size() > kLongestName) return "";
  std::string nearest;
  std::size_t least = std::max<std::size_t>(1, text.size() / 3) + 1;
  for (const std::string& name : names) {
    const std::size_t edits = distance(text, name);
    // Edits of every letter make any word of any other.
    if (edits < least && edits < std::max(text.size(), name.size())) {
      least = edits;
      nearest = name;
    }
  }
  return nearest;
}

std::string did_you_mean(std::string_view text, std::span<const std::string> names) {
  const std::string name = nearest_name(text, names);
  return name.empty() ? "" : fmt::format("; did you mean `{}`?", name);
}

std::string none_of(std::string_view text, std::span<const std::string> names) {
  return fmt::format("`{}`, must be one of {}{}", text, fmt::join(names, ", "), did_you_mean(text, names));
}

}  // namespace sqmap::apps
