// SPDX-License-Identifier: Apache-2.0
#include "probe_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>

namespace sqmap::apps {

TriangleSurface subdivided(const TriangleSurface& surface) {
  TriangleSurface finer{surface.points_m, {}, {}};
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    const auto [at, is_new] =
        middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(finer.points_m.size()));
    if (is_new) finer.points_m.push_back(0.5F * (surface.points_m[a] + surface.points_m[b]));
    return at->second;
  };
  for (const auto& [a, b, c] : surface.triangles) {
    const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    finer.triangles.push_back({a, ab, ca});
    finer.triangles.push_back({ab, b, bc});
    finer.triangles.push_back({ca, bc, c});
    finer.triangles.push_back({ab, bc, ca});
  }
  return finer;
}

runtime::Probe probe_of(const TriangleSurface& surface, double zone_m) {
  runtime::Probe probe{surface.points_m, std::vector<float>(surface.points_m.size(), 0.0F), {}};
  for (const auto& [a, b, c] : surface.triangles) {
    const Vec3f& p = surface.points_m[a];
    const float third_m2 = norm(cross(surface.points_m[b] - p, surface.points_m[c] - p)) / 6;
    for (const std::uint32_t corner : {a, b, c}) probe.weight_m2[corner] += third_m2;
  }
  if (zone_m > 0) {
    std::map<std::tuple<double, double, double>, std::uint32_t> zones;
    for (const Vec3f& p : surface.points_m) {
      const auto cell =
          std::tuple(std::floor(p.x / zone_m), std::floor(p.y / zone_m), std::floor(p.z / zone_m));
      probe.zone.push_back(zones.try_emplace(cell, static_cast<std::uint32_t>(zones.size())).first->second);
    }
  }
  return probe;
}

}  // namespace sqmap::apps
