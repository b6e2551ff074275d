// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "sqmap/asset/vec.hpp"

namespace sqmap::runtime {

/// A point of body B inside object A. All vectors in the frame of the query, metres.
struct Contact {
  std::uint32_t point{};  ///< index of the point in its batch
  std::uint32_t part{};   ///< part of A that answered
  float depth_m{};        ///< penetration, > 0; 0 where only the side is known (layer 1)
  Vec3f normal;           ///< outward unit normal of A near the point
  Vec3f position_m;       ///< the point
  Vec3f surface_m;        ///< the point of A's surface that depth_m speaks of
};

}  // namespace sqmap::runtime
