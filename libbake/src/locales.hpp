// SPDX-License-Identifier: GPL-3.0-or-later
//
// Level sets of one geodesic distance field d, and the tree of what lies beyond them:
//
//        feature  o)  )  )  )  )      locale k: the band (k - 1) h <= d < k h of the side beyond loop k
//                  d = h 2h 3h ...    loop k:   one connected component of d > k h, and its border
//
// Seen from a feature, a limb elsewhere is a component that is born at the limb's tip and merges at its root.
// So one field offers loops around every limb, not only around its own feature.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "curvature.hpp"
#include "surface.hpp"

namespace sqmap::bake {

/// One closed border (of one or several curves) between a component of d > level and the rest.
struct Loop {
  static constexpr std::uint32_t kNone = 0xFFFFFFFF;

  std::uint32_t field{};        ///< index of the distance field
  double level{};               ///< distance at the border
  std::uint32_t seed{};         ///< the vertex beyond the border that is farthest from the feature
  std::uint32_t parent{kNone};  ///< loop one level nearer to the feature whose side beyond holds this one's
  double area{};                ///< of the side beyond
  double length{};              ///< of all curves of the border
  double length2{};             ///< sum of the squared lengths of its curves
  double concavity{};  ///< how concave the border is, in [-1, 1]: mean of minus the curvature across it times
                       ///< the radius of its curve
};

/// Every loop of one field at the levels h, 2 h, ... with at least `min_area` on the side beyond; parents
/// come later in the list than their children.
std::vector<Loop> find_loops(const Surface& surface, const Curvature& curvature,
                             std::span<const float> distance, double spacing, double min_area);

/// Faces of the side beyond a loop: connected, and never empty for a loop of find_loops unless the triangles
/// are far larger than the side. Shape [faces], 1 beyond.
std::vector<std::uint8_t> faces_beyond(const Surface& surface, std::span<const float> distance,
                                       const Loop& loop);

}  // namespace sqmap::bake
