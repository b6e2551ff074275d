// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "engine.hpp"

namespace sqmap::runtime {

/// Pairs of a point and a part whose superquadric holds it, part by part, each part padded to whole vectors.
/// Beyond kMostEntries there is room for what vectors write too much.
inline constexpr std::uint32_t kMostEntries = 2 * kChunkPoints;
inline constexpr std::uint32_t kMostRanges = 64;  ///< parts with entries at a time

enum EntryFlag : std::int32_t {
  kInside = 1,
  kPoint = 2,     ///< layer 2: the distance is to a crossing that is on no patch
  kLeaving = 4,   ///< layer 2: the ray leaves the material there
  kPatch = 8,     ///< the cell at (row, col) bounds a surface patch
  kFaces = 16,    ///< layer 3: the nearest point is within the patch
  kRefined = 32,  ///< surface and normal are layer 3's
  kWithin = 64,   ///< layer 2 cannot rule out that the surface is as near as Wants::reach
  kWanted = 128,  ///< its surface and normal will be asked for
  kAgain = 256,   ///< the search of layer 3 may begin again where StartTable says; in layer 2, must begin
  kAnswer = 512,  ///< the nearest of its point: its distance is the answer
};

struct EntryRange {
  std::uint32_t part, begin, end;
};

struct alignas(64) Entries {
  static constexpr std::uint32_t kLength = kMostEntries + kMostLanes;

  float x[kLength], y[kLength], z[kLength];  ///< part frame
  std::int32_t point[kLength];               ///< place in the chunk
  std::int32_t flags[kLength];
  float row[kLength], col[kLength], crossing[kLength], distance[kLength];
  float certainty[kLength];  ///< of those with kAnswer, once they are combined: ChartAnswer::offset
  float foot_row[kLength], foot_col[kLength];
  float surface[3][kLength], normal[3][kLength];  ///< part frame; in the end those wanted, in the object's
  EntryRange ranges[kMostRanges];
  std::uint32_t count, range_count;

  void clear() noexcept { count = range_count = 0; }
  bool has_room_for(std::uint32_t points) const noexcept {
    return count + points + kMostLanes <= kMostEntries && range_count < kMostRanges;
  }
};

}  // namespace sqmap::runtime
