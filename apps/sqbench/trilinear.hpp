// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "sqmap/asset/vec.hpp"

namespace sqmap::bench {

/// Value and gradient of the trilinear function of eight corners; the gradient in values a cell.
struct Trilinear {
  float value;
  Vec3f gradient;
};

/// `corner`: those of the face at z = 0, then of that at z = 1, x fastest. `at`: place in the unit cell.
inline Trilinear trilinear(const float (&corner)[8], const Vec3f& at) noexcept {
  const float x00 = corner[1] - corner[0], x10 = corner[3] - corner[2], x01 = corner[5] - corner[4],
              x11 = corner[7] - corner[6];
  const float c00 = corner[0] + at.x * x00, c10 = corner[2] + at.x * x10, c01 = corner[4] + at.x * x01,
              c11 = corner[6] + at.x * x11;
  const float y0 = c10 - c00, y1 = c11 - c01;
  const float low = c00 + at.y * y0, high = c01 + at.y * y1;
  const float x0 = x00 + at.y * (x10 - x00), x1 = x01 + at.y * (x11 - x01);
  return {low + at.z * (high - low), {x0 + at.z * (x1 - x0), y0 + at.z * (y1 - y0), high - low}};
}

}  // namespace sqmap::bench
