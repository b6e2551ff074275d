// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon_mesh.hpp"

#include <cmath>
#include <utility>

namespace sqmap::bake {
namespace {

struct Point2 {
  double x, y;
};

/// Twice the signed area of a, b, c; positive counter-clockwise.
double orient(const Point2& a, const Point2& b, const Point2& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

bool same(const Point2& a, const Point2& b) { return a.x == b.x && a.y == b.y; }

/// The corners seen along the polygon's mean normal (Newell), counter-clockwise; empty when it spans no area.
std::vector<Point2> project(const std::vector<Vec3d>& vertices, std::span<const std::uint32_t> polygon) {
  const Vec3d& origin = vertices[polygon[0]];  // keeps the digits of polygons far from zero
  Vec3d normal;
  for (std::size_t i = 0; i < polygon.size(); ++i)
    normal =
        normal + cross(vertices[polygon[i]] - origin, vertices[polygon[(i + 1) % polygon.size()]] - origin);
  int axis = 0;
  if (std::abs(normal.y) > std::abs(normal[axis])) axis = 1;
  if (std::abs(normal.z) > std::abs(normal[axis])) axis = 2;
  if (!(std::abs(normal[axis]) > 0)) return {};  // NaN: no projection

  int u = (axis + 1) % 3, v = (axis + 2) % 3;
  if (normal[axis] < 0) std::swap(u, v);
  std::vector<Point2> points;
  points.reserve(polygon.size());
  for (const std::uint32_t vertex : polygon) {
    const Vec3d p = vertices[vertex] - origin;
    points.push_back({p[u], p[v]});
  }
  return points;
}

/// Ears are searched with at most this many point-in-triangle tests a corner; what is left is cut as a fan.
/// Bounds the time for a hostile polygon; figures of the alphabet and machine parts stay far below it.
constexpr std::size_t kTestsPerCorner = 2000;

}  // namespace

void triangulate_polygon(const std::vector<Vec3d>& vertices, std::span<const std::uint32_t> polygon,
                         std::vector<std::array<std::uint32_t, 3>>& triangles) {
  const std::size_t count = polygon.size();
  if (count < 3) return;
  if (count == 3) {
    triangles.push_back({polygon[0], polygon[1], polygon[2]});
    return;
  }
  const std::vector<Point2> points = project(vertices, polygon);
  std::vector<std::size_t> next(count), previous(count), reflex;
  for (std::size_t i = 0; i < count; ++i) {
    next[i] = (i + 1) % count;
    previous[i] = (i + count - 1) % count;
  }
  for (std::size_t i = 0; i < points.size(); ++i)
    if (orient(points[previous[i]], points[i], points[next[i]]) <= 0) reflex.push_back(i);

  std::size_t tests_left = points.empty() ? 0 : kTestsPerCorner * count;
  std::vector<bool> clipped(count);
  const auto is_ear = [&](std::size_t i) {
    const Point2 &a = points[previous[i]], &b = points[i], &c = points[next[i]];
    if (orient(a, b, c) <= 0) return false;
    for (const std::size_t r : reflex) {
      if (clipped[r]) continue;
      if (tests_left > 0) --tests_left;
      const Point2& p = points[r];
      // A corner at the same place as one of the ear's (a slit, a bridge to an inner loop) does not block it.
      if (same(p, a) || same(p, b) || same(p, c)) continue;
      if (orient(a, b, p) >= 0 && orient(b, c, p) >= 0 && orient(c, a, p) >= 0) return false;
    }
    return true;
  };

  std::size_t corner = 1, misses = 0;
  for (std::size_t left = count; left > 2;) {
    if (left > 3 && tests_left > 0 && misses < left && !is_ear(corner)) {
      corner = next[corner];
      ++misses;
      continue;
    }
    triangles.push_back({polygon[previous[corner]], polygon[corner], polygon[next[corner]]});
    clipped[corner] = true;
    next[previous[corner]] = next[corner];
    previous[next[corner]] = previous[corner];
    corner = next[corner];
    misses = 0;
    --left;
  }
}

}  // namespace sqmap::bake
