// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "results.hpp"

namespace sqmap::bench {

/// Ends the names of those that slide in steps of about 0.005 % of R_max.
inline constexpr const char* kSmallStepsName = ", small steps";

/// The grid whose forces stand beside ours; how fast it answers plays no part there.
inline constexpr const char* kGridOfSlides = "grid-int16-128-simd";

/// What stands beside the paper's Table 1 and Fig. 11, and how its query as printed fares; sentences, those
/// that the suites run have numbers for.
std::vector<std::string> paper_words(const Results& results);

/// A row of Table 1, printed or measured [MB]; NaN: not measured.
struct MemoryComparison {
  std::string model;
  double grid_mb{}, octree_mb{}, paper_map_mb{}, ours_mb{};
  unsigned grid_density{};  ///< nodes along the longest axis; 0: not printed
  bool is_paper{};
};
/// The paper's rows, then ours: grid and octree at the greatest density measured, the
/// octree within 0.4 %.
std::vector<MemoryComparison> table_1(const Results& results);

}  // namespace sqmap::bench
