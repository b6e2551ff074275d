// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "surface.hpp"

namespace sqmap::bake {

/// The same surface in smaller triangles.
struct FineTriangles {
  Triangles triangles;                     ///< the input's points come first
  std::vector<std::uint32_t> source_face;  ///< input face that each triangle lies in
};

/// Halves the longest edge of each triangle that has an edge which is long, until none has, or there are
/// `max_faces` triangles. is_long(a, b) says so of an edge with these ends, whichever comes first; it may not
/// of any that is short enough. Both faces of an edge see the same midpoint, so no crack opens.
FineTriangles split_edges(const Triangles& input,
                          const std::function<bool(const Vec3d& a, const Vec3d& b)>& is_long,
                          std::size_t max_faces);

/// Halves long edges until none is longer than `longest_edge` or there are `max_faces` triangles.
FineTriangles split_long_edges(const Triangles& input, double longest_edge, std::size_t max_faces);

}  // namespace sqmap::bake
