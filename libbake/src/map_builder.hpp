// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "sqmap/asset/asset.hpp"
#include "sqmap/asset/map_grid.hpp"
#include "sqmap/bake/mesh.hpp"
#include "sqmap/bake/oracle.hpp"

#include "open_places.hpp"

namespace sqmap::bake {

/// What the inward rays of one part meet, in double, before resolution and bits are chosen.
struct RayField {
  std::uint32_t rows{}, cols{};
  std::vector<std::uint8_t> start_inside;  ///< shape [rows * cols]
  std::vector<std::uint32_t> first;        ///< crossings of texel k: depth_m[first[k] .. first[k + 1])
  std::vector<double> depth_m;             ///< ascending within a texel
  std::vector<double> reach_m;  ///< distance to the medial axis: no query looks deeper; [rows * cols]

  bool has_hit(std::uint32_t texel) const noexcept { return first[texel] != first[texel + 1]; }
  /// The texel bounds a patch of the represented surface.
  bool is_eligible(std::uint32_t texel) const noexcept { return has_hit(texel) && start_inside[texel] == 0; }
  double first_depth_m(std::uint32_t texel) const noexcept { return depth_m[first[texel]]; }
};

/// The mesh with what is asked of it.
struct MeshQueries {
  const Mesh& mesh;
  const RayTracer& rays;
  const Oracle& oracle;
  const OpenPlaces& open;

  /// Winding number of the mesh at p, rounded. `line_hits`: the crossings of the line through p along the
  /// unit vector `direction`, t_m = 0 at p; where the mesh is closed they tell it at once.
  int winding(const Vec3d& p_m, const Vec3d& direction, const std::vector<RayTracer::Hit>& line_hits) const;
  /// Negative inside [m]. `at_most_m`: as of Oracle::nearest.
  double signed_distance(const Vec3d& p_m, double at_most_m = std::numeric_limits<double>::infinity()) const;
};

/// Traces the inward ray of every node of a rows x cols map through the whole mesh (paper 4.1.2 with the
/// crossings of FORMAT.md section 3). Parallel over rows; the result does not depend on the number of
/// threads.
RayField trace_map(const Superquadric& shape, const Pose& object_from_part, std::uint32_t rows,
                   std::uint32_t cols, const MeshQueries& queries);

/// What a map loses when only every row_stride-th row and col_stride-th column of a traced field is kept, as
/// means over the field's nodes weighted by surface area.
struct CoarseningError {
  double depth_m;  ///< |bilinear - traced| first depth, over the nodes of cells that bound a surface patch
  double
      occupancy_m;  ///< length of each ray, down to its reach, on which the coarse map takes the wrong side
};
CoarseningError coarsening_error(const RayField& field, const MapGrid& grid, std::uint32_t row_stride,
                                 std::uint32_t col_stride);

/// Resolution and bits of one part.
struct MapPlan {
  std::uint32_t row_stride{1}, col_stride{1};  ///< of the traced field
  std::uint32_t bits{8};
};

/// The stored map: every row_stride-th row and col_stride-th column of the field, quantised.
DistanceMap quantise(const RayField& field, const MapPlan& plan);

/// Projects the mesh vertices that the part's superquadric holds onto its map (paper 4.1.3, Step 3) and
/// keeps, for each cell, the visible vertex that the bilinear surface misses by most, if by more than
/// tolerance_m.
void add_vertex_samples(Part& part, const MeshQueries& queries, double tolerance_m);

}  // namespace sqmap::bake
