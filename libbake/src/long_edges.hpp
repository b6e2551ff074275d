// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "surface.hpp"

namespace sqmap::bake {

/// The same surface in smaller triangles.
struct FineTriangles {
  Triangles triangles;                     ///< the input's points come first
  std::vector<std::uint32_t> source_face;  ///< input face that each triangle lies in
};

/// Halves long edges until none is longer than `longest_edge` or there are `max_faces` triangles. Both faces
/// of an edge see the same midpoint, so no crack opens.
FineTriangles split_long_edges(const Triangles& input, double longest_edge, std::size_t max_faces);

}  // namespace sqmap::bake
