// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "sqmap/asset/distance_map.hpp"

namespace sqmap {

/// What the ray of a node of a map meets.
enum class RayKind : std::uint8_t {
  kMiss,       ///< nothing; it starts outside the mesh
  kInnerMiss,  ///< nothing; it starts inside the mesh
  kHit,
};

/// A run of nodes in one row of a map, round the turn.
struct MissRun {
  std::uint32_t end{};    ///< column after the last, in [0, cols)
  std::uint32_t count{};  ///< 0: the row has no miss
  RayKind kind{};
};

/// The longest run of misses that start alike, of those the one that ends first. kind_at(col): of the node in
/// column col < cols.
template <class KindAt>
MissRun longest_miss_run(std::uint32_t cols, KindAt kind_at) {
  MissRun longest;
  std::uint32_t run = 0;
  RayKind before = RayKind::kHit;
  const auto take = [&](std::uint32_t col, RayKind kind) {
    run = kind == RayKind::kHit ? 0 : kind == before ? run + 1 : 1;
    before = kind;
    if (run > longest.count && run <= cols) longest = {(col + 1) % cols, run, kind};
  };
  for (std::uint32_t col = 0; col < cols; ++col) take(col, kind_at(col));
  // A run that lies across the seam goes on.
  for (std::uint32_t col = 0; col < cols && run > 0 && kind_at(col) == before; ++col) take(col, before);
  return longest;
}

/// That of a row of a map whose codes are there.
inline MissRun longest_miss_run(const DistanceMap& map, std::uint32_t row) {
  return longest_miss_run(map.cols, [&](std::uint32_t col) {
    const std::uint32_t texel = row * map.cols + col;
    if ((map.code[texel] & map.miss_code()) != map.miss_code()) return RayKind::kHit;
    return map.starts_inside(texel) ? RayKind::kInnerMiss : RayKind::kMiss;
  });
}

}  // namespace sqmap
