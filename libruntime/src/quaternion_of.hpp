// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>

#include "sqmap/asset/vec.hpp"

namespace sqmap::runtime {

/// The quaternion of a rotation, not normalised: rotation() does that. Of the four ways to find it from the
/// matrix, the one that divides by its largest component, so that it holds up to half a turn.
inline Quaternion quaternion_of(const Rotation<double>& rotation) noexcept {
  const auto& m = rotation.row;
  const double xx = m[0].x, yy = m[1].y, zz = m[2].z;
  const std::array<double, 4> square{1 + xx + yy + zz, 1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz};
  const double wx = m[2].y - m[1].z, wy = m[0].z - m[2].x, wz = m[1].x - m[0].y;
  const double yz = m[2].y + m[1].z, zx = m[0].z + m[2].x, xy = m[1].x + m[0].y;
  switch (std::max_element(square.begin(), square.end()) - square.begin()) {
    case 0:
      return {square[0], wx, wy, wz};
    case 1:
      return {wx, square[1], xy, zx};
    case 2:
      return {wy, xy, square[2], yz};
    default:
      return {wz, zx, yz, square[3]};
  }
}

}  // namespace sqmap::runtime
