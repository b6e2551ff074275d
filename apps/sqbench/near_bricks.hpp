// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "field.hpp"
#include "grid_kernels.hpp"

namespace sqmap::bench {

/// For each brick of a lattice, how far it is at least from those that hold anything: a byte a brick, by
/// which whole blocks of points are left out of a frame.
class NearBricks {
 public:
  NearBricks() = default;
  /// `cells`: of a brick along an axis. `is_near`: of each brick, x fastest, whether a point in it may be
  /// asked for.
  NearBricks(const Field& field, std::uint32_t cells, const std::vector<bool>& is_near);

  NearView view() const noexcept;
  std::size_t bytes() const noexcept { return gap_.capacity(); }

 private:
  std::vector<std::uint8_t> gap_;
  NearView view_{};
};

/// Of bricks of `cells` cells: whether any node is within the band, or the surface runs through.
std::vector<bool> bricks_within(const Field& field, std::uint32_t cells, double band_m);

}  // namespace sqmap::bench
