// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sqmap/asset/vec.hpp"

namespace sqmap::bake {

/// Convex hull of a set of points, in their unit and frame.
struct Hull {
  std::vector<Vec3d>
      vertices;        ///< extreme points, lexicographically ascending; a subset of the input, bit for bit
  double volume_m3{};  ///< 0 when the points span no volume
  double area{};       ///< of the surface [m^2]; of a flat set, both sides of its polygon
  std::vector<std::array<std::uint32_t, 3>> faces;  ///< outward; empty when the points span no volume
};

/// The hull of any finite points. Every decision is exact, so no tolerance is involved: equal points give one
/// vertex, collinear points their two ends, coplanar points the corners of their polygon, points inside a
/// face or an edge of the hull are dropped. The result is a function of the set alone, not of the order of
/// its points.
Hull convex_hull(std::span<const Vec3d> points);

}  // namespace sqmap::bake
