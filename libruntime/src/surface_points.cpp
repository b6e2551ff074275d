// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/surface_points.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>

#include "sqmap/asset/map_grid.hpp"
#include "sqmap/asset/validate.hpp"

namespace sqmap::runtime {
namespace {

/// A crossing, and the cube it lies in.
struct Crossing {
  std::array<std::int64_t, 3> cube{};
  double from_centre_m{};  ///< of the cube
  Vec3d point_m;
};

Crossing crossing_at(const Vec3d& p_m, double spacing_m) {
  Crossing crossing{{}, 0, p_m};
  Vec3d offset_m;
  for (int axis = 0; axis < 3; ++axis) {
    const double cell = std::floor(p_m[axis] / spacing_m);
    crossing.cube[static_cast<std::size_t>(axis)] = static_cast<std::int64_t>(cell);
    offset_m[axis] = p_m[axis] - (cell + 0.5) * spacing_m;
  }
  crossing.from_centre_m = norm(offset_m);
  return crossing;
}

void add_part(const Part& part, double spacing_m, std::vector<Crossing>& crossings) {
  const DistanceMap& map = part.map;
  const MapGrid grid(straight(part.shape), map.rows, map.cols);
  const Rotation<double> turn = rotation(part.object_from_part.orientation);
  const auto add = [&](std::uint32_t texel, std::uint16_t code) {
    const std::uint32_t row = texel / map.cols, col = texel % map.cols;
    const Vec3d p = bent(part.shape.bend, grid.point(row, col) - map.depth_m(code) * grid.normal(row, col));
    crossings.push_back(crossing_at(turn.apply(p) + part.object_from_part.translation_m, spacing_m));
  };
  for (std::uint32_t texel = 0; texel < map.code.size(); ++texel)
    if (map.code[texel] != map.miss_code()) add(texel, map.code[texel]);
  for (const DistanceMap::Crossing& crossing : map.crossings) add(crossing.texel, crossing.code);
}

}  // namespace

Result<std::vector<Vec3f>> surface_points_m(const Asset& asset, double spacing_m) {
  constexpr double kLeastShare = 1e-6;
  const auto findings = validate(asset, CheckLevel::kQuick);
  if (!findings.empty()) return Error{Status::kInvalidAsset, findings.front().message, "bake the mesh again"};
  if (!(spacing_m >= kLeastShare * asset.r_max_m && spacing_m <= asset.r_max_m)) {  // NaN: refused
    return Error{Status::kBadOption,
                 "spacing is " + std::to_string(spacing_m) + " m, must be in [1e-6, 1] of R_max, " +
                     std::to_string(asset.r_max_m) + " m",
                 "a hundredth of R_max suits most bodies"};
  }
  std::vector<Crossing> crossings;
  for (const Part& part : asset.parts) add_part(part, spacing_m, crossings);
  // Of a cube the first is the one to keep; stable, so that ties go by part and texel.
  std::ranges::stable_sort(crossings, [](const Crossing& a, const Crossing& b) {
    return a.cube != b.cube ? a.cube < b.cube : a.from_centre_m < b.from_centre_m;
  });
  std::vector<Vec3f> points_m;
  for (std::size_t i = 0; i < crossings.size(); ++i)
    if (i == 0 || crossings[i].cube != crossings[i - 1].cube)
      points_m.push_back(cast<float>(crossings[i].point_m));
  return points_m;
}

}  // namespace sqmap::runtime
