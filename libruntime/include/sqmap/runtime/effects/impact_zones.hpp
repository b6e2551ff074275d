// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "sqmap/runtime/effects/touches.hpp"

namespace sqmap::runtime {

/// Impact zones (paper 6.1): the forces on the points of one zone of B (a finger, the tip of a stylus) are
/// averaged, so that the total does not depend on how densely B is sampled.
///
///     F_i <- F_i w_i q_i / sum_j w_j q_j      over the contacts j of the zone of i
///
/// w is the surface a point stands for, q = depth. The paper takes q = 1, which makes the force jump: a
/// second point that just touches halves the mean of the first. With q = depth a point joins with weight
/// zero. A single contact, and contacts of one depth, feel the same force with either; a ball pressed into a
/// plane by d feels k d/2 with the paper's mean and k 2d/3 with this one. `by_depth` = 0 gives the paper's.
/// Zones are those of each object by itself. Memory: 4 bytes a point of B and 4 a zone.
class ImpactZones {
 public:
  static constexpr const char* kName = "impact_zones";

  float by_depth = 1;  ///< 1: q = depth, 0: q = 1

  static std::span<const Parameter<ImpactZones>> parameters() noexcept;
  /// One zone for all points, or those of set_zones().
  void prepare(std::size_t point_count);
  /// Zone of each point, numbered from 0 without gaps; before prepare().
  void set_zones(std::span<const std::uint32_t> zone_of_point);
  void touch(Touches& touches) noexcept;
  std::size_t memory_bytes() const noexcept {
    return zone_of_point_.capacity() * sizeof(std::uint32_t) + sum_.capacity() * sizeof(float);
  }

 private:
  std::vector<std::uint32_t> zone_of_point_;  ///< empty: one zone
  std::vector<float> sum_;                    ///< one a zone
};

}  // namespace sqmap::runtime
