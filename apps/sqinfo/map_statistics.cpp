// SPDX-License-Identifier: Apache-2.0
#include "map_statistics.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace sqmap::apps {

MapStatistics statistics(const DistanceMap& map) {
  MapStatistics result;
  double sum_m = 0;
  for (std::uint32_t texel = 0; texel < map.code.size(); ++texel) {
    if (map.starts_inside(texel)) {
      ++result.start_inside;
    } else if (map.code[texel] == map.miss_code()) {
      ++result.misses;
    } else {
      const double depth_m = map.depth_m(map.code[texel]);
      result.depth_least_m = result.hits == 0 ? depth_m : std::min(result.depth_least_m, depth_m);
      result.depth_most_m = std::max(result.depth_most_m, depth_m);
      sum_m += depth_m;
      ++result.hits;
    }
  }
  if (result.hits > 0) result.depth_mean_m = sum_m / static_cast<double>(result.hits);
  result.packed_bytes = (map.code.size() * map.bits + 7) / 8 + map.start_inside.size() +
                        6 * map.crossings.size() + 8 * map.vertex_samples.size();
  return result;
}

}  // namespace sqmap::apps
