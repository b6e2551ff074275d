// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "sqmap/bake/bake.hpp"

#include "map_builder.hpp"
#include "partition.hpp"

namespace sqmap::bake {

/// A cell and the superquadric around it, with a draft map.
struct Piece {
  Cell cell;
  Part part;
};

struct Refinement {
  std::vector<Piece> pieces;
  std::string stopped_by;  ///< "target" or "parts"
};

/// Splits the part that adds most to the signed-distance error near the surface, again and again, until the
/// mean error is within the target or the parts are spent. Errors: kCancelled, kBakeFailed.
Result<Refinement> refine(SolidSet& set, std::vector<Cell> cells, const MeshQueries& queries, double r_max_m,
                          const BakeOptions& options, const Progress& progress);

/// The smallest sphere found around the parts' spheres, object frame.
BoundingSphere enclosing_sphere(const std::vector<Part>& parts);

}  // namespace sqmap::bake
