// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sqmap/runtime/effects/touches.hpp"

namespace sqmap::runtime {

/// Keeps force and torque within what a device can give. Both are scaled by one factor, so that the line of
/// action stays:
///
///     s = min(1, most_n / |F|, most_nm / |T|),   F <- s F,   T <- s T
struct ForceLimit {
  static constexpr const char* kName = "force_limit";

  float most_n = 8;
  float most_nm = 1;

  static std::span<const Parameter<ForceLimit>> parameters() noexcept;
  void limit(float step_s, Wrench& wrench) noexcept;
};

}  // namespace sqmap::runtime
