// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "sqmap/asset/asset.hpp"

namespace sqmap::apps {

/// Triangles to look at. Counter-clockwise seen from outside; normals of unit length, one a vertex.
struct TriangleSurface {
  std::vector<Vec3f> points_m;
  std::vector<Vec3f> normals;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// The superquadric, part frame.
TriangleSurface superquadric_surface(const Superquadric& shape);

/// The surface r - D n (paper eq. 22) that a part's map represents at one level, part frame: the cells whose
/// four corners hit the mesh from outside it. Cells that span a jump of the depth are left out: they would be
/// walls that the mesh does not have. Side lists are not drawn.
TriangleSurface mapped_surface(const Part& part, std::uint32_t level);

}  // namespace sqmap::apps
