// SPDX-License-Identifier: Apache-2.0
//
// Exact distances to unions of balls and to boxes: no map, no superquadric.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "support/analytic_asset.hpp"

namespace sqmap::test {

/// What is nearest to a point on a surface that is known.
struct Nearest {
  Vec3d point_m;
  double signed_distance_m;  ///< negative inside
  bool is_crease;            ///< the point lies on an edge or a seam
};

/// The surface of a union of balls of which no three meet: spheres where no other ball covers them, and the
/// circles where two of them cross.
inline Nearest nearest_of_union(const std::vector<Ball>& balls, const Vec3d& p_m) {
  Nearest nearest{{}, std::numeric_limits<double>::infinity(), false};
  bool is_inside = false;
  const auto consider = [&](const Vec3d& q_m, bool is_crease) {
    for (const Ball& ball : balls)
      if (norm(q_m - ball.centre_m) < ball.radius_m * (1 - 1e-9)) return;
    const double distance_m = norm(p_m - q_m);
    if (distance_m < nearest.signed_distance_m) nearest = {q_m, distance_m, is_crease};
  };
  for (const Ball& a : balls) {
    is_inside = is_inside || norm(p_m - a.centre_m) < a.radius_m;
    consider(a.centre_m + a.radius_m * normalized(p_m - a.centre_m), false);
    for (const Ball& b : balls) {
      const Vec3d between = b.centre_m - a.centre_m;
      const double apart_m = norm(between);
      if (!(apart_m > 0) || apart_m > a.radius_m + b.radius_m) continue;
      // The plane of the circle: both spheres' powers are equal there.
      const double along_m =
          (apart_m * apart_m + a.radius_m * a.radius_m - b.radius_m * b.radius_m) / (2 * apart_m);
      const Vec3d axis = (1 / apart_m) * between, middle_m = a.centre_m + along_m * axis;
      const Vec3d across = (p_m - middle_m) - dot(p_m - middle_m, axis) * axis;
      consider(middle_m + std::sqrt(a.radius_m * a.radius_m - along_m * along_m) * normalized(across), true);
    }
  }
  if (is_inside) nearest.signed_distance_m = -nearest.signed_distance_m;
  return nearest;
}

/// The surface of the box |x|, |y|, |z| <= half.
inline Nearest nearest_of_box(const Vec3d& half_m, const Vec3d& p_m) {
  Vec3d q = p_m;
  bool is_inside = true;
  int beyond = 0, nearest_axis = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (std::abs(p_m[axis]) > half_m[axis]) {
      is_inside = false;
      ++beyond;
    }
    q[axis] = std::clamp(p_m[axis], -half_m[axis], half_m[axis]);
    if (half_m[axis] - std::abs(p_m[axis]) < half_m[nearest_axis] - std::abs(p_m[nearest_axis]))
      nearest_axis = axis;
  }
  if (is_inside) q[nearest_axis] = std::copysign(half_m[nearest_axis], p_m[nearest_axis]);
  return {q, (is_inside ? -1 : 1) * norm(p_m - q), beyond > 1};
}

}  // namespace sqmap::test
