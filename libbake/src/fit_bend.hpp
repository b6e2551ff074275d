// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sqmap/bake/fit.hpp"

namespace sqmap::bake {

/// No point of the triangles has a larger beta than this; at most 1e-4 of it more than the largest. Infinite
/// where that takes too many pieces, as around the middle of a bend's arc.
///
/// A straight superquadric is convex, so its beta is largest at vertices. The image of a triangle in the
/// straight frame of a bent one is curved: it is cut until the flat triangles between the images of its
/// corners tell as much.
double largest_beta(const Superquadric& shape, const Pose& object_from_part, std::span<const Vec3d> points_m,
                    std::span<const std::array<std::uint32_t, 3>> triangles);

/// A bent superquadric around all of the triangles, from where `start`, a straight one around them, lies:
/// from each of its longer axes, curved as the parabola that fits the surface best. None where no bend makes
/// it smaller by more than 3 %. As fit_superquadric otherwise.
std::optional<Fit> fit_bent(std::span<const Vec3d> points_m,
                            std::span<const std::array<std::uint32_t, 3>> triangles, const Fit& start,
                            const FitOptions& options);

}  // namespace sqmap::bake
