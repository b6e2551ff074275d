// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "sqmap/asset/vec.hpp"

namespace sqmap::runtime {

/// Point of the segment a b nearest to p; a where the segment has no length.
template <class T>
Vec3<T> nearest_on_segment(const Vec3<T>& p, const Vec3<T>& a, const Vec3<T>& b) noexcept {
  const Vec3<T> d = b - a;
  const T square = dot(d, d);
  if (!(square > T(0))) return a;
  return a + std::clamp(dot(p - a, d) / square, T(0), T(1)) * d;
}

/// Point of the triangle a b c nearest to p, also for triangles without area.
template <class T>
Vec3<T> nearest_on_triangle(const Vec3<T>& p, const Vec3<T>& a, const Vec3<T>& b, const Vec3<T>& c) noexcept {
  const Vec3<T> normal = cross(b - a, c - a);
  const bool inside = dot(cross(b - a, p - a), normal) >= T(0) && dot(cross(c - b, p - b), normal) >= T(0) &&
                      dot(cross(a - c, p - c), normal) >= T(0);
  const T square = dot(normal, normal);
  if (inside && square > T(0)) return p - (dot(p - a, normal) / square) * normal;
  const Vec3<T> candidates[3] = {nearest_on_segment(p, a, b), nearest_on_segment(p, b, c),
                                 nearest_on_segment(p, c, a)};
  return *std::min_element(candidates, candidates + 3, [&](const Vec3<T>& u, const Vec3<T>& v) {
    return dot(p - u, p - u) < dot(p - v, p - v);
  });
}

}  // namespace sqmap::runtime
