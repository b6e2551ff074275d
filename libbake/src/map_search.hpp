// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "sqmap/asset/asset.hpp"
#include "sqmap/asset/result.hpp"

#include "map_budget.hpp"
#include "map_builder.hpp"

namespace sqmap::bake {

/// Errors that exceed their aims by less are at them: points at random do not tell better.
inline constexpr double kAtAims = 1.02;

/// Bytes of an object that need not become fewer: it fits in a processor's second cache beside others.
inline constexpr std::size_t kSmallEnough = 65536;

struct Drawn {
  double depth_in_aims;  ///< mean error of distances near the surface, over what it may be
  double sides_in_aims;  ///< share of points on the wrong side, over what it may be
  bool by_budget;        ///< the byte budget decided
  std::size_t bytes;     ///< of the object in memory

  double worst_in_aims() const { return std::max(depth_in_aims, sides_in_aims); }
};

/// Maps that meet the aims and, in an object of more than `small_enough` bytes, no finer ones than that
/// takes, by drawing them for stricter and looser targets than is asked. What they lose beside seams, where
/// one chart ends and the next has not begun, shows only between parts, so each drawing is judged as a whole.
/// Where finer maps do not lower the error enough, the last that did, and single ones of them finer. Gives up
/// once an object of more than target.most_held bytes misses the aims.
/// `most_shapes`: as of MapDrawer::draw. Errors: those of runtime::Object::build.
Result<Drawn> draw_maps(Asset& asset, MapDrawer& drawer, std::size_t most_shapes, const MeshQueries& queries,
                        const MapTarget& target, std::size_t small_enough, std::uint64_t seed);

}  // namespace sqmap::bake
