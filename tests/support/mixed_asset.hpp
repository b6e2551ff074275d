// SPDX-License-Identifier: Apache-2.0
//
// An asset with everything a bundle can hold: turned parts of all exponents, seams, further sheets, misses,
// vertex samples, pyramids, codes of few bits.
#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "support/analytic_asset.hpp"

namespace sqmap::test {

/// The surface in the maps of mixed_asset(). Two balls with a gap to one behind them: rays cross up to four
/// times.
inline const std::vector<Ball>& mixed_balls() {
  static const std::vector<Ball> kBalls{{{-0.4, 0, 0}, 0.5}, {{0.4, 0.1, 0}, 0.45}, {{0.0, 0.1, 1.1}, 0.35}};
  return kBalls;
}

/// `taper_share` of max_taper, or its negative, for every other part. Bent ones turn by `turn_rad` to either
/// side, as far as they are thin enough; their maps are of another surface than that of mixed_balls().
inline Asset mixed_asset(std::uint32_t bits = 9, double taper_share = 0, double turn_rad = 0) {
  const std::vector<Ball>& balls = mixed_balls();
  struct Shape {
    Superquadric shape;
    Pose pose;
    std::uint32_t rows, cols, levels;
  };
  Shape shapes[] = {
      {{{0.7, 0.6, 0.65}, 0.4, 0.7}, {{0.9, 0.1, 0.3, -0.2}, {-0.4, 0, 0}}, 33, 64, 3},
      {{{0.6, 0.5, 0.6}, 1.0, 1.0}, {{1, 0, 0, 0}, {0.42, 0.1, 0}}, 17, 48, 2},
      {{{0.4, 0.5, 0.45}, 1.4, 0.3}, {{0.5, 0.5, -0.5, 0.5}, {0, 0.1, 1.1}}, 65, 32, 3},
      {{{0.3, 0.45, 1.2}, 0.8, 1.5}, {{0.7, 0.0, 0.7, 0.1}, {0.0, 0.05, 0.1}}, 25, 64, 1},
  };
  std::mt19937_64 rng(4);
  std::vector<Part> parts;
  for (Shape& s : shapes) {
    s.shape.taper = (parts.size() % 2 == 0 ? taper_share : -taper_share) * max_taper(s.shape.e1);
    if (turn_rad != 0) {
      const double k = turn_rad / s.shape.semi_axes_m.z, direction = 0.9 * static_cast<double>(parts.size());
      s.shape.bend = {k * std::cos(direction), k * std::sin(direction)};
      const double most = std::min(1.0, kMostBendReach / bend_reach(s.shape));
      s.shape.bend = {most * s.shape.bend.x, most * s.shape.bend.y};
    }
    const Rotation<double> turn = rotation<double>(s.pose.orientation);
    Part part = traced_part(s.shape, {}, s.rows, s.cols, s.levels, 1.3,
                            [&](const Vec3d& origin_m, const Vec3d& direction, bool& inside) {
                              return union_crossings_m(balls, turn.apply(origin_m) + s.pose.translation_m,
                                                       turn.apply(direction), inside);
                            });
    const Quaternion& q = s.pose.orientation;
    const double length = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
    part.object_from_part = {{q.w / length, q.x / length, q.y / length, q.z / length}, s.pose.translation_m};
    part.sphere = bounding_sphere(s.shape, part.object_from_part);
    part.vertex_count = parts.size() % 2 == 0 ? 1000 : 20;  // the automatic layer is 3 for some, 2 for others
    DistanceMap& map = part.map;
    const auto coarser = [&](std::uint16_t code) {
      return code == map.miss_code() ? (1U << bits) - 1U
                                     : static_cast<std::uint32_t>(code) * ((1U << bits) - 2U) / 65534;
    };
    std::vector<DistanceMap::Crossing> crossings;
    for (const auto& crossing : map.crossings) {
      const auto code = static_cast<std::uint16_t>(coarser(crossing.code));
      const std::uint32_t first = coarser(map.code[crossing.texel]);
      const bool repeats =
          !crossings.empty() && crossings.back().texel == crossing.texel && crossings.back().code >= code;
      if (code > first && !repeats) crossings.push_back({crossing.texel, code});
    }
    for (std::uint16_t& code : map.code) code = static_cast<std::uint16_t>(coarser(code));
    map.crossings = crossings;
    map.bits = bits;
    map.depth_step_m = 1.3 / ((1U << bits) - 2U);
    for (std::uint32_t cell = 0; cell < (map.rows - 1) * map.cols; ++cell) {
      if (rng() % 6 != 0 || map.code[cell] == map.miss_code()) continue;
      const auto place = [&] { return static_cast<std::uint8_t>(rng() % 256); };
      const auto raised = static_cast<std::uint16_t>(map.code[cell] - (map.code[cell] > 0 ? 1 : 0));
      map.vertex_samples.push_back({cell, place(), place(), raised});
    }
    parts.push_back(std::move(part));
  }
  return asset_of(std::move(parts), 2.2);
}

/// The same asset, `factor` times as large.
inline Asset scaled(Asset asset, double factor) {
  asset.r_max_m *= factor;
  const auto scale_ball = [&](BoundingSphere& ball) {
    ball.centre_m = factor * ball.centre_m;
    ball.radius_m *= factor;
  };
  scale_ball(asset.sphere);
  for (Part& part : asset.parts) {
    part.shape.semi_axes_m = factor * part.shape.semi_axes_m;
    part.shape.bend = {part.shape.bend.x / factor, part.shape.bend.y / factor};
    part.object_from_part.translation_m = factor * part.object_from_part.translation_m;
    scale_ball(part.sphere);
    part.map.depth_min_m *= factor;
    part.map.depth_step_m *= factor;
  }
  return asset;
}

/// Points in and around the asset's parts, most of them inside a superquadric, a few far away.
inline std::vector<Vec3f> points_around(const Asset& asset, std::size_t count, std::uint64_t seed) {
  std::mt19937_64 rng(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<Vec3f> points;
  while (points.size() < count) {
    const Part& part = asset.parts[rng() % asset.parts.size()];
    const Vec3d d{unit(rng), unit(rng), unit(rng)};
    const double reach = points.size() % 10 == 0 ? 5 : 1.05;
    points.push_back(
        cast<float>(part.sphere.centre_m + (reach * part.sphere.radius_m * std::abs(unit(rng))) * d));
  }
  return points;
}

}  // namespace sqmap::test
