// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "sqmap/bake/mesh.hpp"

namespace sqmap::bake {

/// Where a mesh is not closed: a ball round each connected set of edges whose faces do not cancel.
class OpenPlaces {
 public:
  explicit OpenPlaces(const Mesh& mesh);

  /// The mesh is closed everywhere.
  bool none() const { return balls_.empty() && !everywhere_; }

  /// False: the crossings of the line through p tell its winding number, as those of a closed mesh would. A
  /// surface across a hole can lie in the hole's ball, so a line that misses the balls misses such surfaces;
  /// and far enough from the balls all of them together would not change the rounded winding number.
  bool can_mislead(const Vec3d& p_m, const Vec3d& direction) const;

 private:
  struct Ball {
    Vec3d centre_m;
    double radius_m;
    double sheets;  ///< that may be missing in it, one over the other
  };
  std::vector<Ball> balls_;
  bool everywhere_ = false;  ///< more balls than it pays to look at
};

}  // namespace sqmap::bake
