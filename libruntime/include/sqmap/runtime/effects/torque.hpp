// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sqmap/runtime/effects/touches.hpp"

namespace sqmap::runtime {

/// Torque for devices with six degrees of freedom (paper section 7.2 leaves it out):
///
///     T = sum (p_i - c) x F_i          c: BodyState::about_m
///
/// p_i is the point of B, not of A's surface: that is where B is pushed.
struct Torque {
  static constexpr const char* kName = "torque";

  void sum(const Touches& touches, Wrench& wrench) noexcept;
};

}  // namespace sqmap::runtime
