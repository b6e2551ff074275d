// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <limits>

#include "sqmap/asset/vec.hpp"

namespace sqmap::bake {

/// Point of the segment a b nearest to p; a where its length is 0.
inline Vec3d nearest_of_segment(const Vec3d& p, const Vec3d& a, const Vec3d& b) {
  const Vec3d along = b - a;
  const double length2 = dot(along, along);
  const double t = length2 > 0 ? std::clamp(dot(p - a, along) / length2, 0.0, 1.0) : 0;
  return t == 1 ? b : a + t * along;
}

/// Point of the triangle nearest to p: below p where the prism of the triangle holds p, else on an edge.
inline Vec3d nearest_of_triangle(const Vec3d& p, const std::array<Vec3d, 3>& corner) {
  const Vec3d n = cross(corner[1] - corner[0], corner[2] - corner[0]);
  const double n2 = dot(n, n);
  bool in_prism = n2 > 0;
  for (std::size_t k = 0; k < 3 && in_prism; ++k)
    in_prism = dot(cross(n, corner[(k + 1) % 3] - corner[k]), p - corner[k]) >= 0;
  if (in_prism) return p - dot(n, p - corner[0]) / n2 * n;
  Vec3d nearest;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3d q = nearest_of_segment(p, corner[k], corner[(k + 1) % 3]);
    const double square = dot(q - p, q - p);
    if (!(square < least)) continue;
    least = square;
    nearest = q;
  }
  return nearest;
}

}  // namespace sqmap::bake
