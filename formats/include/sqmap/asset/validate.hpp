// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "sqmap/asset/asset.hpp"
#include "sqmap/asset/result.hpp"

namespace sqmap {

/// How much of an asset to check.
enum class CheckLevel {
  kQuick,  ///< ranges, shapes and counts: everything a reader must trust before it queries
  kFull,   ///< also order and range of every side list, every code, and that spheres enclose superquadrics
};

/// One broken rule of formats/FORMAT.md.
struct Finding {
  int rule;             ///< number of the rule in FORMAT.md, stable
  std::string message;  ///< what was found and what is required, with the part
};

/// Every rule that the asset breaks, in order of rule and part; empty: valid. The reader, sqinfo and the
/// tests share this one validator. Never throws but for memory; total for any Asset value, NaN included.
std::vector<Finding> validate(const Asset& asset, CheckLevel level);

}  // namespace sqmap
