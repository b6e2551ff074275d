// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <vector>

#include "fit_model.hpp"
#include "hull.hpp"

namespace sqmap::bake::fit {

/// Where the optimisation starts: frames of the hull's second moments and of its flattest direction, each
/// axis in turn as z, turned about it by 0 and 45 degrees, with the exponents of the smallest inflated volume
/// of a grid. Ascending by that volume. The choice of z is what fails most: its basin is never left once
/// entered.
std::vector<Placed> starts(const Hull& hull, std::span<const Vec3d> points, const Bounds& bounds, int grid);

/// The square seen as a diamond: the shape turned by 45 degrees about z, with the axes and the exponent that
/// keep it nearly where it was if a1 = a2. Each is a local minimum of the other, so where one fits the other
/// deserves a try.
Placed twin(const Placed& at, const Bounds& bounds);

/// At most `count` hull vertices that span it: the farthest ones along `count` directions, spread evenly
/// where the hull is stretched to a ball.
std::vector<Vec3d> spread_subset(const Hull& hull, std::size_t count);

}  // namespace sqmap::bake::fit
