// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "sqmap/asset/asset.hpp"

namespace sqmap::apps {

/// What the codes of one distance map add up to. Depths over the nodes that hit and do not start inside.
struct MapStatistics {
  std::size_t hits{}, misses{}, start_inside{};
  double depth_least_m{}, depth_mean_m{}, depth_most_m{};  ///< 0 without such a node; the mean is over nodes
  std::size_t
      packed_bytes{};  ///< codes at their significant bits, flags, crossings and samples at 6 and 8 bytes
};
MapStatistics statistics(const DistanceMap& map);

}  // namespace sqmap::apps
