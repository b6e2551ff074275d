// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "sqmap/asset/asset.hpp"

namespace sqmap::apps {

struct DiffOptions {
  /// Largest difference that counts as none: lengths in units of the larger R_max, volumes of its cube,
  /// shares and percentages as they are, everything else absolute. 0: bit for bit.
  double tolerance = 0;
  bool with_provenance = true;  ///< compare also program, version, options, file name and hash of the source
};

/// One difference.
struct Difference {
  std::string where;  ///< e.g. "part 3 shape e1"
  std::string first, second;
  double size;  ///< in the unit of the tolerance; infinite where no number can say it
};

/// Every difference of two assets, in their order. Parts are compared by number. Maps of equal size are
/// compared by the depths they stand for, so that another choice of code step is no difference by itself
/// under a tolerance.
std::vector<Difference> differences(const Asset& first, const Asset& second, const DiffOptions& options);

}  // namespace sqmap::apps
