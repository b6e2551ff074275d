// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "sqmap/asset/vec.hpp"

namespace sqmap::bench {

struct Model;

/// Signed distances at the nodes of a cubic lattice around an object; x runs fastest.
struct Field {
  Vec3d origin_m;                        ///< of node (0, 0, 0)
  double spacing_m{};                    ///< between neighbours
  std::array<std::uint32_t, 3> nodes{};  ///< along x, y, z
  std::vector<float> distance_m;         ///< shape [z, y, x]
  std::vector<double> seconds;           ///< it took to compute, each time on the wall clock

  std::size_t index(std::uint32_t x, std::uint32_t y, std::uint32_t z) const noexcept {
    return (std::size_t{z} * nodes[1] + y) * nodes[0] + x;
  }
  Vec3d node_m(std::uint32_t x, std::uint32_t y, std::uint32_t z) const noexcept {
    return origin_m +
           spacing_m * Vec3d{static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)};
  }
  /// Trilinear, at a point within the lattice.
  double sample(const Vec3d& p_m) const noexcept;
};

/// The field on `resolution` nodes along the longest axis of the object's box, which it exceeds by the band
/// of the queries. Exact (to the float it is stored in) where |distance| <= 1.1 bands + 2 spacings; farther
/// away interpolated from a field of half the resolution, made in the same way.
Field exact_field(const Model& model, unsigned resolution);

}  // namespace sqmap::bench
