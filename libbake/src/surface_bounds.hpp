// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

#include "sqmap/asset/asset.hpp"

#include "map_builder.hpp"

namespace sqmap::bake {

/// Bounds of the whole mesh's surface within the part's superquadric (FORMAT.md 3.1), cells a side of each
/// face of its box. Every triangle is cut along the cells' pyramids, where heights are linear, so that the
/// corners of the pieces tell their extremes: nothing is sampled.
/// @param around  a ball around the object, whose size the rounding of queries depends on
/// Precondition: the mesh is closed, so that one point tells the side of all that no surface separates from
/// it.
SurfaceBounds bound_surface(const Part& part, const BoundingSphere& around, const MeshQueries& queries,
                            std::uint32_t cells);

/// Cells that keep their width at a fixed share of R_max, within what the format has.
std::uint32_t bound_cells(const Part& part, double r_max_m);

}  // namespace sqmap::bake
