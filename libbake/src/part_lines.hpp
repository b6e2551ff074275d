// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "sqmap/asset/superquadric.hpp"
#include "sqmap/bake/oracle.hpp"

#include "map_builder.hpp"

namespace sqmap::bake {

/// The lines along which a part measures, with the mesh that they cross. They are straight in the part's
/// straight frame; of a bent part curved in the object, so the mesh around it is straightened instead, its
/// edges halved until they are hardly curved.
class PartLines {
 public:
  PartLines(const Superquadric& shape, const Pose& object_from_part, const MeshQueries& queries);

  /// What lines cross, and the mesh's winding number at their origins.
  struct Traced {
    std::vector<std::vector<RayTracer::Hit>> hits;  ///< as of RayTracer::trace_line
    std::vector<int> winding;
    std::vector<RayTracer::Ray> in_object;  ///< the lines where they begin
  };
  /// Of lines in the straight frame; neighbours among them are traced together.
  void trace(std::span<const RayTracer::Ray> lines, Traced& traced) const;
  /// The crossings ahead of one place in a direction, straight frame: as of RayTracer::trace.
  void trace(const Vec3d& from_m, const Vec3d& direction, std::vector<RayTracer::Hit>& hits) const;

 private:
  RayTracer::Ray in_object(const RayTracer::Ray& ray) const;

  Superquadric shape_;
  Vec3d translation_m_;
  Rotation<double> turn_;
  const MeshQueries& queries_;
  std::optional<RayTracer> straightened_;  ///< of a bent part
};

}  // namespace sqmap::bake
