// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "sqmap/asset/asset.hpp"

#include "map_builder.hpp"

namespace sqmap::bake {

/// What the maps of an asset should reach and may cost.
struct MapTarget {
  double error_m;           ///< mean error over the object's surface
  std::uint64_t max_bytes;  ///< of all maps in the file, about
};

/// Draws the maps of all parts of an asset, for one target after the other: what rays met is kept.
class MapDrawer {
 public:
  /// Each part counts by its `area_m2` of the mesh.
  MapDrawer(const std::vector<Part>& parts, const std::vector<double>& area_m2, const MeshQueries& queries);
  ~MapDrawer();
  MapDrawer(MapDrawer&&) = delete;

  /// Gives the parts, the same as before but for their maps, the maps with the fewest bytes in memory that
  /// meet the target together. What a byte is worth is the same everywhere (one Lagrange multiplier for all
  /// parts): a large smooth part may err more than the target so that a small rough one need not cost much,
  /// or the other way round. True: the byte budget, not the target, decided.
  bool draw(std::vector<Part>& parts, const MapTarget& target);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqmap::bake
