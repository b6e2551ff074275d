// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "sqmap/asset/asset.hpp"
#include "sqmap/bake/fit.hpp"

#include "map_builder.hpp"
#include "partition.hpp"

namespace sqmap::bake {

/// The bounding superquadric of a cell, as a part without a map.
Result<Part> fit_part(const SolidSet& set, const Cell& cell, const FitOptions& options);

/// What the map of a part should reach and may cost.
struct MapTarget {
  double error_m;                    ///< mean error of the interpolated and quantised depth
  std::uint32_t max_quadrant_cells;  ///< finest grid tried: this many cells a quadrant in both directions
};

/// The map of a part at the fewest texels and bits that meet the target, or at the finest grid when none
/// does. Traces the finest grid once; coarser ones are subsets of its nodes.
void map_part(Part& part, const MeshQueries& queries, const MapTarget& target);

/// A map of fixed resolution with 16-bit codes, for judging a partition before the final maps are planned.
void draft_map(Part& part, const MeshQueries& queries, std::uint32_t quadrant_cells);

}  // namespace sqmap::bake
