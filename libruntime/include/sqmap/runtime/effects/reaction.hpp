// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sqmap/runtime/effects/touches.hpp"

namespace sqmap::runtime {

/// Reaction force, paper eq. (32), one-sided:
///
///     F += k max(0, S - D) n          S - D: depth of the contact, n: outward unit normal
///
/// The paper's |S - D| would also push points that do not touch. Conservative where n is the gradient of the
/// depth.
struct Reaction {
  static constexpr const char* kName = "reaction";

  float stiffness_n_per_m = 500;

  static std::span<const Parameter<Reaction>> parameters() noexcept;
  void touch(Touches& touches) noexcept;
};

}  // namespace sqmap::runtime
