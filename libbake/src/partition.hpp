// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
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

/// The segments as closed solids, in the decomposition's order.
std::vector<Cell> close_segments(SolidSet& set, const Solid& whole, const Decomposition& segments);

/// The best plane to cut a cell in two: of planes across its principal axes, the one after which the convex
/// hulls of both sides enclose least volume. Whole triangles go to the side of their centroid. Entry k:
/// triangle k goes to the first side. Empty when no plane leaves triangles of the mesh on both sides.
std::optional<std::vector<bool>> best_plane_cut(const SolidSet& set, const Solid& solid);

}  // namespace sqmap::bake
