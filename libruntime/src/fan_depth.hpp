// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sqmap/asset/shape_table.hpp"

namespace sqmap::runtime {

/// Depth at (s, t) of a cell, both in [0, 1], whose vertex sample is at (at_s, at_t), below 1, with the depth
/// `apex`: linear on each of the triangles that join the sample to a side of the cell. `corner`: row-major.
/// Scalar code for single lanes, too.
inline float fan_depth(const float (&corner)[4], float s, float t, float at_s, float at_t,
                       float apex) noexcept {
  // How far (s, t) is on the way from the sample to the rim, where both triangles of a side are linear.
  const auto share = [](float way, float at) {
    return way > 0 ? way / (1.0F - at) : way < 0 ? -way / at : 0.0F;
  };
  const float d_s = s - at_s, d_t = t - at_t;
  const float on_way = lesser(greater(share(d_s, at_s), share(d_t, at_t)), 1.0F);
  if (!(on_way > 0)) return apex;
  const float rim_s = lesser(greater(at_s + d_s / on_way, 0.0F), 1.0F);
  const float rim_t = lesser(greater(at_t + d_t / on_way, 0.0F), 1.0F);
  const float low = corner[0] + rim_t * (corner[1] - corner[0]);
  const float high = corner[2] + rim_t * (corner[3] - corner[2]);
  return apex + on_way * ((low + rim_s * (high - low)) - apex);
}

}  // namespace sqmap::runtime
