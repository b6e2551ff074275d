// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sqmap/bake/bake.hpp"

#include "part_builder.hpp"
#include "partition.hpp"

namespace sqmap::bake {

/// A cut that did not pay.
struct Spare {
  std::size_t cut;
  double loss_m;  ///< by which the error of all parts together rose; negative: fell
};

/// A cell and the superquadric around it, with a draft map while the partition is refined.
struct Piece {
  Cell cell;
  Solid held;  ///< what the superquadric bounds at the end: the cell, or less where others hold it
  Part part;
  PartFit fit;
  double loss_m{};                             ///< draft_map()
  double held_share{};                         ///< of that map's texels, those that a loaded object holds
  double area_m2{};                            ///< surface of the mesh in the cell
  std::optional<FittedPart> quick;             ///< a quick fit, once `part` is the full one
  std::vector<FittedPart> others;              ///< the full fits of FitOptions::taper and bend
  std::optional<std::vector<HalfSpace>> cuts;  ///< planes to split it by, best first
  std::size_t cuts_tried{};                    ///< of them, those that did not pay
  std::optional<Spare> spare;                  ///< of those, the one that cost least

  /// Says on the part what its cell says.
  void label() {
    part.segment = cell.segment;
    part.reason = cell.reason;
  }
};

struct Refinement {
  std::vector<Piece> pieces;
  std::string stopped_by;  ///< "target", "parts" or "gain": no split lowers the error further
};

/// The partitions that a mesh may be baked with.
class PartitionSearch {
 public:
  PartitionSearch(SolidSet& set, const MeshQueries& queries, double r_max_m, const BakeOptions& options);
  ~PartitionSearch();
  PartitionSearch(PartitionSearch&&) = delete;

  /// Splits the parts that add most to the signed-distance error near the surface, and that enclose most
  /// beside the mesh, again and again, until the mean error is within the target, the parts are spent, or no
  /// split pays. A split that does not lower the error is undone: it would cost bytes, and its seam is one
  /// more place where rays see little. Where nothing else is left, splits that do not pay are kept on trial,
  /// for what their halves may gain. The result is the partition on the way whose maps are foretold to need
  /// fewest bytes, where it errs beyond the target the more; its parts are rid of what others hold
  /// (shed.hpp) and have their full fits. Errors: kCancelled, kBakeFailed.
  Result<Refinement> best(std::vector<Cell> cells, const Progress& progress);

  /// After best(): another partition whose maps may turn out to need fewer bytes, each time a different one:
  /// that of fewest bytes foretold, whatever its error; then one of the best's parts, split on as long as
  /// that is foretold to save; then some of those on the way, of most parts first: what is foretold of bytes
  /// and errors is often wrong by half. Empty: there is none left. Errors: as of best().
  Result<std::optional<Refinement>> other(const Progress& progress);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The smallest sphere found around the parts' spheres, object frame.
BoundingSphere enclosing_sphere(const std::vector<Part>& parts);

}  // namespace sqmap::bake
