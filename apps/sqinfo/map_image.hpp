// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "sqmap/asset/distance_map.hpp"
#include "sqmap/asset/result.hpp"

namespace sqmap::apps {

using Rgb = std::array<std::uint8_t, 3>;

/// Colours of the nodes that have no depth; neither lies on the colour map.
inline constexpr Rgb kMissColor{255, 255, 255};
inline constexpr Rgb kStartInsideColor{214, 39, 40};

/// The viridis colour map: dark blue at 0 to yellow at 1, evenly spaced to the eye.
Rgb viridis(double fraction);

/// A PNG of the first depths of one level of a map, one pixel a node: eta up, omega to the right. The colours
/// span [least_m, most_m]. Errors: kFileUnwritable when the encoder refuses.
Result<std::vector<std::uint8_t>> map_png(const DistanceMap& map, std::uint32_t level, double least_m,
                                          double most_m);

}  // namespace sqmap::apps
