// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sqmap/runtime/effects/touches.hpp"

namespace sqmap::runtime {

/// Bounds how fast force and torque change:
///
///     |F_t - F_(t-1)| <= n_per_s * step,   |T_t - T_(t-1)| <= nm_per_s * step
///
/// The force follows along the straight line between the two. It lags behind the surface, so a stiff, lightly
/// damped probe can gain energy from it: set the rate well above stiffness times the probe's usual speed.
class SlewLimit {
 public:
  static constexpr const char* kName = "slew_limit";

  float n_per_s = 2000;
  float nm_per_s = 200;

  static std::span<const Parameter<SlewLimit>> parameters() noexcept;
  void limit(float step_s, Wrench& wrench) noexcept;

 private:
  Vec3f force_n_, torque_nm_;
};

}  // namespace sqmap::runtime
