// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>

#include "surface.hpp"

namespace sqmap::bake {

/// Volume of the convex hull of some faces of a unit-area surface, from below: the hull of the farthest
/// vertices in kHullDirections evenly spread directions, 97 % of a ball and all of a box. Enough to compare a
/// set with its halves, at a cost linear in the faces.
double hull_volume(const Surface& surface, std::span<const std::uint32_t> faces);

inline constexpr int kHullDirections = 200;

}  // namespace sqmap::bake
