// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <limits>
#include <span>
#include <vector>

#include "sqmap/bake/mesh.hpp"
#include "sqmap/bake/oracle.hpp"

namespace sqmap::bench {

/// Exact distance to several solids: that to the one that is nearest, or in which a point lies deepest.
class UnionOracle {
 public:
  explicit UnionOracle(std::span<const bake::Mesh> solids) {
    solids_.reserve(solids.size());
    for (const bake::Mesh& solid : solids) solids_.emplace_back(solid);
  }
  double signed_distance(const Vec3d& p_m) const {
    double least_m = std::numeric_limits<double>::infinity();
    for (const bake::Oracle& solid : solids_) least_m = std::min(least_m, solid.signed_distance(p_m));
    return least_m;
  }

 private:
  std::vector<bake::Oracle> solids_;
};

}  // namespace sqmap::bench
