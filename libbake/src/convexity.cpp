// SPDX-License-Identifier: GPL-3.0-or-later
#include "convexity.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "hull.hpp"

namespace sqmap::bake {
namespace {

// Fibonacci lattice on the sphere.
std::vector<Vec3d> directions() {
  std::vector<Vec3d> list;
  for (int i = 0; i < kHullDirections; ++i) {
    const double z = 1 - (2.0 * i + 1) / kHullDirections, r = std::sqrt(1 - z * z);
    const double turn = 2 * std::numbers::pi * i / std::numbers::phi;
    list.push_back({r * std::cos(turn), r * std::sin(turn), z});
  }
  return list;
}

}  // namespace

double hull_volume(const Surface& surface, std::span<const std::uint32_t> faces) {
  static const std::vector<Vec3d> kDirections = directions();
  std::vector<std::uint32_t> vertices;
  for (const std::uint32_t f : faces)
    vertices.insert(vertices.end(), surface.faces[f].begin(), surface.faces[f].end());
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  std::vector<double> farthest(kDirections.size(), -std::numeric_limits<double>::infinity());
  std::vector<std::uint32_t> support(kDirections.size(), 0);
  for (const std::uint32_t v : vertices)
    for (std::size_t i = 0; i < kDirections.size(); ++i) {
      const double reach = dot(kDirections[i], surface.points[v]);
      if (!(reach > farthest[i])) continue;
      farthest[i] = reach;
      support[i] = v;
    }
  std::sort(support.begin(), support.end());
  support.erase(std::unique(support.begin(), support.end()), support.end());
  std::vector<Vec3d> points;
  for (const std::uint32_t v : support) points.push_back(surface.points[v]);
  return faces.empty() ? 0 : convex_hull(points).volume_m3;
}

}  // namespace sqmap::bake
