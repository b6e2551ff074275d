// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sqmap/runtime/object.hpp"

namespace sqmap::runtime {

/// Penetration depth [m]: max(0, -signed distance); 0 where the answer has no distance.
float penetration_m(const Answer& answer) noexcept;

/// Reaction force on the point [N], paper eq. (32) with the one-sided spring max(0, S - D) in place of its
/// absolute value, which would also push points that do not touch:
///
///     F = k * penetration * n,   n the outward unit normal
///
/// Zero without contact and for answers without a distance.
Vec3f reaction_force(const Answer& answer, float stiffness_n_per_m) noexcept;

}  // namespace sqmap::runtime
