// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "sqmap/bake/decompose.hpp"

#include "segmentation.hpp"

namespace sqmap::bake {

/// Cuts where limbs meet the rest (paper 3.1): loops of the locales of every salient feature and every
/// source, moved to the creases nearby, the strongest borders first.
void cut_by_boundary_strength(const Surface& surface, const DecomposeOptions& options,
                              Segmentation& segmentation);

/// Vertices whose protrusion is the largest within their geodesic window (paper eq. 5).
std::vector<std::uint32_t> salient_features(const Surface& surface, std::span<const double> protrusion,
                                            double window);

}  // namespace sqmap::bake
