// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include "sqmap/asset/result.hpp"
#include "sqmap/asset/vec.hpp"

namespace sqmap::apps {

/// Points of a CSV text: three finite numbers a line, separated by commas (blanks around them are ignored). A
/// first line that starts with no number is a header; empty lines are skipped; lines may end in CR LF.
/// Errors: kInvalidAsset naming the line, counted from 1.
Result<std::vector<Vec3f>> parse_points(std::string_view text);

}  // namespace sqmap::apps
