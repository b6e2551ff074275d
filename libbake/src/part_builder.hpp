// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include "sqmap/asset/asset.hpp"
#include "sqmap/bake/bake.hpp"

#include "map_builder.hpp"
#include "solid.hpp"

namespace sqmap::bake {

/// A part without a map, and how its superquadric was found.
struct FittedPart {
  Part part;
  PartFit fit;
};

/// The ball around a superquadric, object frame.
BoundingSphere sphere_of(const Superquadric& shape, const Pose& object_from_part);

/// The bounding superquadric of a solid. The part's segment and reason are the caller's to set.
Result<FittedPart> fit_part(const SolidSet& set, const Solid& solid, const FitOptions& options);

/// A bent superquadric around the solid that `straight`, fitted to it, bounds: fit_bent().
std::optional<FittedPart> bend_part(const SolidSet& set, const Solid& solid, const FittedPart& straight,
                                    const FitOptions& options);

/// A map of fixed resolution with 16-bit codes, for judging a partition before the final maps are planned.
/// Returns what one of half the resolution would lose [m], which tells how many texels the part will need.
double draft_map(Part& part, const MeshQueries& queries, std::uint32_t quadrant_cells);

}  // namespace sqmap::bake
