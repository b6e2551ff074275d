// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sqmap/asset/asset.hpp"

#include "cuts.hpp"
#include "surface.hpp"

namespace sqmap::bake {

/// A partition of the faces of one component that is refined cut by cut.
struct Segmentation {
  std::vector<std::uint32_t> label;  ///< segment of each face
  std::vector<CutReason> reasons;    ///< one a segment
};

/// All faces in one segment.
Segmentation one_segment(std::size_t face_count);

/// The faces of each segment, ascending; rows are segments.
Rows faces_of_segments(const Segmentation& segmentation);

/// What a cut of one segment must satisfy.
struct CutRules {
  double min_area;         ///< of each piece
  double min_strength;     ///< of the new border, border_strength()
  double proven_strength;  ///< from this strength on, no gain of the hull is asked for
  double min_hull_gain;    ///< share of its hull's volume that the segment must lose
};

/// Splits every segment that the face set `side` crosses, where the pieces and the new border inside the
/// segment satisfy the rules. Returns how many segments were split.
int apply_cut(const Surface& surface, std::span<const double> link_bend, std::span<const std::uint8_t> side,
              const CutRules& rules, CutReason reason, Segmentation& segmentation);

/// Makes segments connected and at least `min_area` large: smaller pieces join the neighbour they share the
/// longest border with. Numbers segments in order of their first face.
void join_small_pieces(const Surface& surface, double min_area, Segmentation& segmentation);

/// Merges neighbours whose common border is less concave than `min_concavity`, the flattest first.
void merge_over_flat_borders(const Surface& surface, std::span<const double> link_bend, double min_concavity,
                             Segmentation& segmentation);

}  // namespace sqmap::bake
