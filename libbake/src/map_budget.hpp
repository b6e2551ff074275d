// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "sqmap/asset/asset.hpp"

#include "map_builder.hpp"

namespace sqmap::bake {

/// A superquadric that a part may have.
struct PlacedShape {
  Superquadric shape;
  Pose object_from_part;
  bool operator==(const PlacedShape&) const = default;
};

/// For MapDrawer::draw.
inline constexpr auto kAllShapes = std::numeric_limits<std::size_t>::max();

/// What the maps of an asset should reach and may cost.
struct MapTarget {
  double error_m;           ///< mean error over the object's surface
  std::uint64_t max_bytes;  ///< of all maps in the file, about
  /// Of the object in memory: of no use if it takes more.
  std::size_t most_held = std::numeric_limits<std::size_t>::max();
};

/// Which texels of a map count: all, or those that a loaded object holds (libruntime/src/resident.hpp), with
/// its rows. By the former, maps that miss much are coarser.
enum class TexelCost { kAll, kHeld };

/// Of the maps in a file, about.
double stored_bytes(const std::vector<Part>& parts);

/// What rays met of a shape.
struct TracedShape;
using TracedShapes = std::vector<std::shared_ptr<const TracedShape>>;

/// Draws the maps of all parts of an asset, for one target after the other: what rays met is kept.
class MapDrawer {
 public:
  /// shapes[k]: the superquadrics, each with its pose, that part k may have, at least one. It counts by its
  /// `area_m2` of the mesh. `known`: what is traced already, of the same mesh.
  MapDrawer(const std::vector<std::vector<PlacedShape>>& shapes, const std::vector<double>& area_m2,
            const MeshQueries& queries, TracedShapes known = {});
  ~MapDrawer();
  MapDrawer(MapDrawer&&) = delete;

  /// Gives each part one of its first `most_shapes` shapes, and the parts the maps with the fewest bytes in
  /// memory that meet the target together. What a byte is worth is the same everywhere (one Lagrange
  /// multiplier for all parts): a large smooth part may err more than the target so that a small rough one
  /// need not cost much, or the other way round. True: the byte budget, not the target, decided.
  bool draw(std::vector<Part>& parts, const MapTarget& target, std::size_t most_shapes, TexelCost cost);

  /// The next finer maps that rays are at hand for, of a part with a map that draw() gave part k: in rows, in
  /// columns, in bits.
  std::vector<DistanceMap> finer(std::size_t k, const Part& part) const;

  /// All that was traced or, being known, used.
  const TracedShapes& traced() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqmap::bake
