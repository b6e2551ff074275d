// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "cuts.hpp"
#include "sqmap/asset/asset.hpp"
#include "surface.hpp"

namespace sqmap::bake {

/// What a cut must satisfy. Areas are shares of the component's area.
struct CutRules {
  double min_area;        ///< of each side
  double min_concavity;   ///< of the border
  double min_protrusion;  ///< of the smaller side, protrusion_ratio()
};

/// A partition of the faces of one component that is refined cut by cut.
struct Segmentation {
  std::vector<std::uint32_t> label;  ///< segment of each face
  std::vector<CutReason> reasons;    ///< one a segment
};

/// Splits every segment that the cut crosses, where the pieces and the new border inside the segment satisfy the rules.
/// Returns how many segments were split.
int apply_cut(const Surface& surface, std::span<const double> link_bend, std::span<const std::uint8_t> side,
              const CutRules& rules, CutReason reason, Segmentation& segmentation);

/// Makes segments connected and at least `min_area` large (smaller pieces join the neighbour with the longest common
/// border), then merges neighbours whose border is less concave than `min_concavity`, flattest first.
void tidy(const Surface& surface, std::span<const double> link_bend, const CutRules& rules,
          Segmentation& segmentation);

}  // namespace sqmap::bake
