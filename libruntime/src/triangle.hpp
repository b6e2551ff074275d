// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sqmap/asset/shape_table.hpp"
#include "sqmap/asset/vec.hpp"

namespace sqmap::runtime {

/// Point of the segment a b nearest to p; a where the segment has no length.
inline Vec3f nearest_on_segment(const Vec3f& p, const Vec3f& a, const Vec3f& b) noexcept {
  const Vec3f d = b - a;
  const float square = dot(d, d);
  const float along = square > 0.0F ? dot(p - a, d) / square : 0.0F;
  return a + lesser(greater(along, 0.0F), 1.0F) * d;
}

/// Point of the triangle a b c nearest to p, also for triangles without area.
inline Vec3f nearest_on_triangle(const Vec3f& p, const Vec3f& a, const Vec3f& b, const Vec3f& c) noexcept {
  const Vec3f normal = cross(b - a, c - a);
  const float square = dot(normal, normal);
  const bool faces = dot(cross(b - a, p - a), normal) >= 0.0F && dot(cross(c - b, p - b), normal) >= 0.0F &&
                     dot(cross(a - c, p - c), normal) >= 0.0F && square > 0.0F;
  if (faces) return p - (dot(p - a, normal) / square) * normal;
  Vec3f nearest = nearest_on_segment(p, a, b);
  float least = dot(p - nearest, p - nearest);
  for (const Vec3f& other : {nearest_on_segment(p, b, c), nearest_on_segment(p, c, a)}) {
    const float here = dot(p - other, p - other);
    if (here < least) {
      least = here;
      nearest = other;
    }
  }
  return nearest;
}

}  // namespace sqmap::runtime
