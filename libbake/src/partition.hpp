// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "sqmap/asset/asset.hpp"
#include "sqmap/bake/decompose.hpp"

#include "solid.hpp"

namespace sqmap::bake {

/// One cell of the partition of the mesh.
struct Cell {
  Solid solid;
  std::uint32_t segment{};
  CutReason reason{CutReason::kWhole};
};

/// Area of a face [m^2].
double area_m2(const Mesh& mesh, std::uint32_t face);

/// The segments as closed solids, in the decomposition's order.
std::vector<Cell> close_segments(SolidSet& set, const Solid& whole, const Decomposition& segments);

/// The planes to cut a cell in two by, best first: of planes across each of its principal axes, the one after
/// which the convex hulls enclose least volume. Empty when no plane leaves triangles of the mesh on both
/// sides.
std::vector<HalfSpace> plane_cuts_by_merit(const SolidSet& set, const Solid& solid);

}  // namespace sqmap::bake
