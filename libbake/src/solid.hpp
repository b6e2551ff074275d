// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "sqmap/bake/mesh.hpp"

namespace sqmap::bake {

/// The points p with normal . p < height.
struct HalfSpace {
  Vec3d normal;
  double height_m{};
  double above_m(const Vec3d& p_m) const { return dot(normal, p_m) - height_m; }
};

/// A part of the mesh with its cuts closed: a 2-chain without boundary.
///
/// Every cut is closed by cones over the connected pieces of its boundary, and the two sides get the same
/// cones with opposite orientation. So the winding numbers of the parts add up to that of the mesh: a point
/// inside the mesh is inside at least one part's solid, hence inside that part's convex hull, hence inside
/// its superquadric; a bent one holds the solid's triangles, and around a ball that holds a closed chain all
/// winding numbers are 0. No embedding of the caps is needed for this, and none is checked.
struct Solid {
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices into SolidSet::vertices_m
  std::vector<std::uint32_t> face;                      ///< mesh face of each triangle; kNewFace: a cap
};

/// The vertices that a family of solids shares: the mesh's, then the tips of the caps.
struct SolidSet {
  std::vector<Vec3d> vertices_m;

  /// The whole mesh as one solid; boundary loops that repair left open are closed by cones.
  static std::pair<SolidSet, Solid> whole(const Mesh& mesh);

  /// Both sides of a cut. `first_side` says for each triangle of `solid` whether it goes to the first.
  std::pair<Solid, Solid> split(const Solid& solid,
                                const std::function<bool(std::size_t triangle)>& first_side);

  /// Both sides of a plane, first the half-space. Triangles of the mesh go whole to the side of their
  /// centroid; caps are cut where the plane meets them, so that neither side holds what lies far beyond it.
  std::pair<Solid, Solid> split(const Solid& solid, const HalfSpace& first_side);

  Vec3d centroid(const std::array<std::uint32_t, 3>& triangle) const {
    return (1.0 / 3) * (vertices_m[triangle[0]] + vertices_m[triangle[1]] + vertices_m[triangle[2]]);
  }
  double volume_m3(const Solid& solid) const;
  /// Distinct vertices of the solid's triangles, ascending by index.
  std::vector<Vec3d> points(const Solid& solid) const;

 private:
  void close(Solid& solid, Solid* other);
  Solid with_caps_cut(const Solid& solid, const HalfSpace& plane);
};

}  // namespace sqmap::bake
