// SPDX-License-Identifier: Apache-2.0
//
// What the scalar reference and the engine share of one question.
#pragma once

#include <cmath>

#include "sqmap/runtime/object.hpp"

#include "resident.hpp"

namespace sqmap::runtime {

// How many times as certain as the chart of the nearest surface another chart must be to decide the side.
// Chosen on the sample meshes, where larger values change little.
inline constexpr float kOverrule = 4;

inline Layer layer_for(const PartRecord& part, const QueryOptions& options) noexcept {
  if (options.layer != Layer::kAuto) return options.layer;
  return part.texels_at_level(options.level) < kLayerThreshold * part.vertex_count ? Layer::kThree
                                                                                   : Layer::kTwo;
}

/// The largest delta of QueryOptions::edge_length_m, L/sqrt(3), rounded up [m].
inline float most_offset(float edge_length_m) noexcept {
  return edge_length_m > 0 ? 0.5774F * edge_length_m : 0;
}

inline bool is_finite(const Vec3f& p) noexcept {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

inline bool in_ball(const Vec3f& p, const Vec3f& centre, float radius_square) noexcept {
  const Vec3f d = p - centre;
  return dot(d, d) <= radius_square;
}

}  // namespace sqmap::runtime
