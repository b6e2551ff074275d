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
///
/// Along a path the force changes by no more than the stiffness times what the point moved, what the map errs
/// and what the normal turns from facet to facet times the depth, but
///  - where Answer::part changes: the one flag that an answer carries; charts differ where parts meet;
///  - at ridges of the distance itself, the medial axis and creases, where another surface is the nearest;
///  - where the search of layer 3 ends on another hillside or enters a cell with a vertex sample.
/// The latter two carry no flag. Tracking (effects/tracking.hpp) keeps the force from following any of them.
Vec3f reaction_force(const Answer& answer, float stiffness_n_per_m) noexcept;

}  // namespace sqmap::runtime
