// SPDX-License-Identifier: Apache-2.0
//
// Assets whose maps come from closed-form ray crossings, without a mesh or a baker.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "sqmap/asset/asset.hpp"
#include "sqmap/asset/map_grid.hpp"

namespace sqmap::test {

struct Ball {
  Vec3d centre_m;
  double radius_m;
};

/// Distances along a ray at which it enters or leaves the union of balls; `inside` tells whether it starts
/// within.
inline std::vector<double> union_crossings_m(const std::vector<Ball>& balls, const Vec3d& origin_m,
                                             const Vec3d& direction, bool& inside) {
  std::vector<std::pair<double, int>> events;
  for (const Ball& b : balls) {
    const Vec3d d = origin_m - b.centre_m;
    const double half = dot(d, direction), c = dot(d, d) - b.radius_m * b.radius_m, root = half * half - c;
    if (root <= 0) continue;
    events.emplace_back(-half - std::sqrt(root), 1);
    events.emplace_back(-half + std::sqrt(root), -1);
  }
  std::sort(events.begin(), events.end());
  std::vector<double> crossings;
  int depth = 0;
  inside = false;
  for (const auto& [t, step] : events) {
    const bool was = depth > 0;
    depth += step;
    if ((depth > 0) == was) continue;
    if (t <= 0) {
      inside = depth > 0;
    } else {
      crossings.push_back(t);
    }
  }
  return crossings;
}

/// Distances along a ray of a bent shape, which is straight in the straight frame, at which it enters or
/// leaves what `holds`, of points of the part frame, tells: by halves of steps.
template <class Holds>
std::vector<double> bent_crossings_m(const Superquadric& shape, const Holds& holds, const Vec3d& origin_m,
                                     const Vec3d& direction, double reach_m, bool& inside) {
  const auto held = [&](double t) { return holds(bent(shape.bend, origin_m + t * direction)); };
  constexpr int kSteps = 400, kHalvings = 40;
  std::vector<double> crossings;
  inside = held(0);
  for (int k = 0; k < kSteps; ++k) {
    double low = reach_m * k / kSteps, high = reach_m * (k + 1) / kSteps;
    const bool before = held(low);
    if (held(high) == before) continue;
    for (int i = 0; i < kHalvings; ++i)
      (held(0.5 * (low + high)) == before ? low : high) = 0.5 * (low + high);
    crossings.push_back(0.5 * (low + high));
  }
  return crossings;
}

/// Crossings of a ray given in the object frame, or of a bent part in its straight frame; sets `inside` for
/// its start.
using Crossings =
    std::function<std::vector<double>(const Vec3d& origin_m, const Vec3d& direction, bool& inside)>;

/// A part whose map is traced with `crossings`. `reach_m` drops what lies deeper.
inline Part traced_part(const Superquadric& shape, const Vec3d& centre_m, std::uint32_t rows,
                        std::uint32_t cols, std::uint32_t levels, double reach_m,
                        const Crossings& crossings) {
  Part part;
  part.shape = shape;
  part.object_from_part.translation_m = centre_m;
  part.sphere = bounding_sphere(shape, part.object_from_part);
  part.vertex_count = 100;
  part.face_count = 200;
  part.volume_m3 = 1;
  DistanceMap& map = part.map;
  map.rows = rows;
  map.cols = cols;
  map.level_count = levels;
  map.bits = 16;
  map.depth_min_m = 0;
  map.depth_step_m = reach_m / 65534;
  map.start_inside.assign((rows * cols + 7) / 8, 0);
  const MapGrid grid(straight(shape), rows, cols);
  for (std::uint32_t row = 0; row < rows; ++row) {
    for (std::uint32_t col = 0; col < cols; ++col) {
      const std::uint32_t texel = row * cols + col;
      bool inside = false;
      auto depths = crossings(grid.point(row, col) + centre_m, -grid.normal(row, col), inside);
      if (inside) map.start_inside[texel / 8] |= static_cast<std::uint8_t>(1U << (texel % 8));
      std::erase_if(depths, [&](double d) { return d > reach_m; });
      map.code.push_back(map.miss_code());
      for (std::size_t k = 0; k < depths.size(); ++k) {
        const auto code = static_cast<std::uint16_t>(std::lround(depths[k] / map.depth_step_m));
        if (k == 0) {
          map.code.back() = code;
        } else {
          map.crossings.push_back({texel, code});
        }
      }
    }
  }
  return part;
}

inline Asset asset_of(std::vector<Part> parts, double r_max_m) {
  Asset asset;
  asset.r_max_m = r_max_m;
  for (const Part& part : parts) {
    asset.sphere.radius_m =
        std::max(asset.sphere.radius_m, 1.0001 * (norm(part.sphere.centre_m) + part.sphere.radius_m));
  }
  asset.parts = std::move(parts);
  asset.provenance.generator = "test";
  asset.provenance.generator_version = "0";
  asset.provenance.source_name = "analytic";
  asset.provenance.source_hash = "00000000000000000000000000000000";
  asset.provenance.options_json = "{}";
  return asset;
}

/// A ball inside an ellipsoid of the same centre.
inline Asset ball_in_ellipsoid(double radius_m, std::uint32_t rows, std::uint32_t cols,
                               std::uint32_t levels = 1) {
  const std::vector<Ball> balls{{{0.1, -0.05, 0.2}, radius_m}};
  return asset_of({traced_part({{1.15, 1.2, 1.4}, 1, 1}, {}, rows, cols, levels, 1,
                               [balls](const Vec3d& o, const Vec3d& d, bool& inside) {
                                 return union_crossings_m(balls, o, d, inside);
                               })},
                  2 * radius_m);
}

/// Two overlapping balls (the paper's Fig. 4), each bounded by a superquadric of its own.
inline Asset two_balls(const std::vector<Ball>& balls, std::uint32_t rows, std::uint32_t cols) {
  std::vector<Part> parts;
  for (const Ball& ball : balls) {
    const double a = 1.02 * ball.radius_m;
    parts.push_back(traced_part({{a, a, a}, 0.9, 0.9}, ball.centre_m, rows, cols, 1, 1.5 * a,
                                [balls](const Vec3d& o, const Vec3d& d, bool& inside) {
                                  return union_crossings_m(balls, o, d, inside);
                                }));
  }
  return asset_of(std::move(parts), 3);
}

}  // namespace sqmap::test
