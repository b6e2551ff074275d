// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "sqmap/asset/asset.hpp"

namespace sqmap::test {

inline constexpr double kBoundRadius_m = 0.5;    ///< the superquadric, a sphere
inline constexpr double kSurfaceRadius_m = 0.4;  ///< the surface that its map represents, a sphere too

/// An asset whose every answer is known by hand: a ball of radius 0.4 m about the origin, stored as a sphere
/// of radius 0.5 m with a distance of 0.1 m at each texel.
inline Asset sphere_asset() {
  const BoundingSphere sphere{{}, kBoundRadius_m};
  Part part;
  part.shape = {{kBoundRadius_m, kBoundRadius_m, kBoundRadius_m}, 1, 1};
  part.sphere = sphere;
  part.vertex_count = 10'000;  // more than texels: the layer rule asks for layer 3
  part.volume_m3 = 4.0 / 3.0 * 3.14159265358979 * kSurfaceRadius_m * kSurfaceRadius_m * kSurfaceRadius_m;
  part.map.rows = 17;
  part.map.cols = 32;
  part.map.level_count = 1;
  part.map.bits = 8;
  part.map.depth_min_m = kBoundRadius_m - kSurfaceRadius_m;
  part.map.depth_step_m = 1e-4;
  part.map.code.assign(std::size_t{17} * 32, 0);

  Asset asset;
  asset.r_max_m = 2 * kSurfaceRadius_m;
  asset.sphere = sphere;
  asset.parts = {part};
  asset.mesh.is_closed = true;
  asset.mesh.components = 1;
  asset.mesh.volume_m3 = part.volume_m3;
  asset.provenance.generator = "sphere_asset";
  asset.provenance.generator_version = "1";
  asset.provenance.source_name = "sphere";
  asset.provenance.source_hash = "00000000000000000000000000000000";
  asset.provenance.options_json = "{}";
  return asset;
}

}  // namespace sqmap::test
