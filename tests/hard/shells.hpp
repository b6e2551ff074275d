// SPDX-License-Identifier: Apache-2.0
//
// Hard shapes: superquadrics of extreme exponents and axis ratios, each with a surface at one constant depth
// below it, so that the signed distance of layer 2 is that depth less the distance to the superquadric.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "support/analytic_asset.hpp"
#include "support/targets.hpp"

namespace sqmap::test {

inline constexpr std::array<double, 5> kExponents{0.1, 0.3, 1.0, 1.9, 2.0};
inline constexpr std::array<Vec3d, 7> kHardAxes{Vec3d{1, 1, 1},   {0.1, 1, 1},     {1, 0.1, 0.1},
                                                {0.5, 1, 0.01},   {0.01, 0.01, 1}, {1, 0.001, 1},
                                                {1, 0.001, 0.001}};

/// One part; every ray enters the material at depth_m.
inline Asset shell_asset(const Superquadric& shape, double depth_m, std::uint32_t rows = 17,
                         std::uint32_t cols = 32, const Vec3d& centre_m = {}) {
  const double reach_m = 4 * depth_m;
  Part part = traced_part(shape, centre_m, rows, cols, 1, reach_m,
                          [depth_m](const Vec3d&, const Vec3d&, bool& inside) {
                            inside = false;
                            return std::vector<double>{depth_m};
                          });
  // The code nearest to depth_m stands for it exactly.
  part.map.depth_step_m = depth_m / part.map.code.front();
  return asset_of({part}, 2 * part.sphere.radius_m);
}

inline std::string name_of(const Superquadric& s) {
  return "axes " + std::to_string(s.semi_axes_m.x) + " " + std::to_string(s.semi_axes_m.y) + " " +
         std::to_string(s.semi_axes_m.z) + ", e " + std::to_string(s.e1) + " " + std::to_string(s.e2);
}

}  // namespace sqmap::test
