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
/// In layer 3 n is the direction to Answer::surface_m, but at depths of less than about a tenth of a cell of
/// the map and where the search ends on the rim of a chart. So along a path the force mostly changes by no
/// more than the stiffness times what the point and surface_m moved, and a jump stands in the answers:
/// another `part` (charts differ where parts meet), another `inside`, or a surface_m elsewhere, at ridges of
/// the distance itself (the medial axis) and where the search ends on another hillside. Tracking
/// (effects/tracking.hpp) keeps the force from following any of them. In layer 2 n is the normal of the map,
/// which turns from facet to facet.
Vec3f reaction_force(const Answer& answer, float stiffness_n_per_m) noexcept;

}  // namespace sqmap::runtime
