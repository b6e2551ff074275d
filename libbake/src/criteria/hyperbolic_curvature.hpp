// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>

#include "sqmap/bake/decompose.hpp"

#include "segmentation.hpp"

namespace sqmap::bake {

/// Cuts bent tubes (paper 3.2), which no concave loop separates: a torus, a knot, a trunk. Along each
/// segment, from one end, a locale is cut off where it is hyperbolic enough (k_h, t_h) and the part before it
/// has bent far enough.
///
/// @param face_gaussian  Gaussian curvature of each face, on the unit-area surface
void cut_by_hyperbolic_curvature(const Surface& surface, std::span<const double> face_gaussian,
                                 const DecomposeOptions& options, Segmentation& segmentation);

}  // namespace sqmap::bake
