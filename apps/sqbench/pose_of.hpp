// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>

#include "cloud.hpp"

namespace sqmap::bench {

/// A placement for the runtime. The quaternion of a rotation, by its largest component.
inline Pose pose_of(const Placement& placement) {
  const auto& m = placement.rotation.row;
  const double d[4] = {1.0 + m[0].x + m[1].y + m[2].z, 1.0 + m[0].x - m[1].y - m[2].z,
                       1.0 - m[0].x + m[1].y - m[2].z, 1.0 - m[0].x - m[1].y + m[2].z};
  const double a = m[2].y - m[1].z, b = m[0].z - m[2].x, c = m[1].x - m[0].y;
  const double xy = m[0].y + m[1].x, yz = m[1].z + m[2].y, zx = m[2].x + m[0].z;
  const auto largest = std::max_element(d, d + 4) - d;
  const Quaternion q = largest == 0   ? Quaternion{d[0], a, b, c}
                       : largest == 1 ? Quaternion{a, d[1], xy, zx}
                       : largest == 2 ? Quaternion{b, xy, d[2], yz}
                                      : Quaternion{c, zx, yz, d[3]};  // rotation() normalises
  return {q, cast<double>(placement.translation_m)};
}

}  // namespace sqmap::bench
