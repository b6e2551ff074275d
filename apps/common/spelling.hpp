// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace sqmap::apps {

/// The name that `text` was probably meant to be: the one that takes the fewest insertions, deletions,
/// replacements and swaps of neighbours, at most one for each three letters; capitals are no mistake. Empty
/// when nothing is near.
std::string nearest_name(std::string_view text, std::span<const std::string> names);

/// "; did you mean `NAME`?", or nothing.
std::string did_you_mean(std::string_view text, std::span<const std::string> names);

/// "`TEXT`, must be one of NAME, NAME", with the suggestion where one is near.
std::string none_of(std::string_view text, std::span<const std::string> names);

}  // namespace sqmap::apps
