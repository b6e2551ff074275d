// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "sqmap/runtime/body.hpp"

#include "engine.hpp"

namespace sqmap::runtime {

/// One allocation, arrays of floats: x, y, z of the points in the order of their blocks, then the balls of
/// the blocks; then the caller's index of each point. The last block is filled up with copies of its last
/// point.
struct PointBody::Data {
  std::unique_ptr<float[]> values;
  std::unique_ptr<std::uint32_t[]> index;
  std::uint32_t point_count{}, padded_points{}, padded_blocks{};
  Vec3f centre_m;
  float radius_m{};

  std::uint32_t block_count() const noexcept { return padded_points / kBlockPoints; }
  float* axis(int k) noexcept { return values.get() + std::size_t{padded_points} * static_cast<unsigned>(k); }
  const float* axis(int k) const noexcept {
    return values.get() + std::size_t{padded_points} * static_cast<unsigned>(k);
  }
  /// k = 0, 1, 2: centres; 3: radii; [padded_blocks].
  float* ball(int k) noexcept { return axis(3) + std::size_t{padded_blocks} * static_cast<unsigned>(k); }
  const float* ball(int k) const noexcept {
    return axis(3) + std::size_t{padded_blocks} * static_cast<unsigned>(k);
  }
};

}  // namespace sqmap::runtime
