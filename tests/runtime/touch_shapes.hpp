// SPDX-License-Identifier: Apache-2.0
//
// Analytic objects that effects are tried on, and contacts with a plane that need no object.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "sqmap/runtime/effects/touches.hpp"

#include "support/analytic_asset.hpp"

namespace sqmap::test {

inline constexpr double kBallRadius_m = 0.8;
inline const Vec3d kBallCentre_m{0.1, -0.05, 0.2};  // of ball_in_ellipsoid

/// The box |x|, |y|, |z| <= half inside a rounded superquadric.
inline Asset box_asset(const Vec3d& half_m) {
  const auto crossings = [half_m](const Vec3d& origin_m, const Vec3d& direction, bool& inside) {
    double enter = -1e30, leave = 1e30;
    for (int axis = 0; axis < 3; ++axis) {
      const double o = origin_m[axis], d = direction[axis];
      if (std::abs(d) < 1e-12) {
        if (std::abs(o) > half_m[axis]) leave = -1e30;
        continue;
      }
      const double a = (-half_m[axis] - o) / d, b = (half_m[axis] - o) / d;
      enter = std::max(enter, std::min(a, b));
      leave = std::min(leave, std::max(a, b));
    }
    std::vector<double> found;
    inside = enter < 0 && leave > 0;
    if (enter < leave && enter > 0) found.push_back(enter);
    if (enter < leave && leave > 0) found.push_back(leave);
    return found;
  };
  // |x/a|^(2/e) summed over three axes stays below 1 at the box's corner: a^(2/e) > 3 half^(2/e).
  const double e = 0.3, widen = 1.01 * std::pow(3.0, e / 2);
  return asset_of({traced_part({widen * half_m, e, e}, {}, 129, 256, 1, 2 * norm(half_m), crossings)},
                  2 * norm(half_m));
}

/// Evenly spread points on a sphere, by the golden angle.
inline std::vector<Vec3f> sphere_points(std::size_t count, double radius_m, const Vec3d& centre_m) {
  std::vector<Vec3f> points;
  for (std::size_t i = 0; i < count; ++i) {
    const double z = 1 - (2 * static_cast<double>(i) + 1) / static_cast<double>(count);
    const double turn = 2.399963229728653 * static_cast<double>(i), r = std::sqrt(1 - z * z);
    points.push_back(cast<float>(centre_m + radius_m * Vec3d{r * std::cos(turn), r * std::sin(turn), z}));
  }
  return points;
}

/// One contact with the half space z < 0 at a place below the plane.
inline runtime::Contact plane_contact(const Vec3f& p_m, std::uint32_t point = 0) {
  return {point, 0, -p_m.z, {0, 0, 1}, p_m, {p_m.x, p_m.y, 0}};
}

/// Runs a model on one contact.
template <class Model>
runtime::Wrench apply_one(Model& model, runtime::Contact contact, float step_s = 1e-3F) {
  std::array<runtime::Contact, 1> contacts{contact};
  std::array<Vec3f, 1> force_n{};
  std::array<Vec3f, 1> points_m{contact.position_m};
  runtime::Touches touches{{}, {points_m, {}, {}, step_s}, contacts, force_n};
  return model.apply(touches);
}

}  // namespace sqmap::test
