// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "sqmap/asset/vec.hpp"
#include "sqmap/bake/mesh.hpp"

namespace sqmap::bench {

/// Where on a triangle its nearest point lies: 0..2 a vertex, 3..5 the edge that starts there, 6 within.
struct OnTriangle {
  Vec3d point_m;
  int feature;
};
OnTriangle nearest_on_triangle(const Vec3d& p_m, const std::array<Vec3d, 3>& corners_m) noexcept;

/// Outward normals of the faces, edges and vertices of a mesh, weighted by angle, which tell the side of a
/// point from its nearest point (Baerentzen and Aanaes 2005).
class Pseudonormals {
 public:
  explicit Pseudonormals(const bake::Mesh& mesh);
  /// Not normalised.
  Vec3d at(std::uint32_t face, int feature) const noexcept;
  std::size_t bytes() const noexcept;

 private:
  struct Face {
    std::array<std::uint32_t, 3> vertex;
    Vec3f normal;
    std::array<Vec3f, 3> edge;
  };
  std::vector<Face> faces_;
  std::vector<Vec3f> vertices_;
};

/// Closest points by Embree's bounding volume hierarchy; the distance to a triangle is computed in double.
class EmbreeClosest {
 public:
  explicit EmbreeClosest(const bake::Mesh& mesh);
  ~EmbreeClosest();
  struct Answer {
    bool is_found;
    Vec3d nearest_m;
    double distance_m;
    std::uint32_t face;
    int feature;
  };
  /// The nearest point no farther than `radius_m`.
  Answer nearest(const Vec3d& p_m, double radius_m) const;
  std::size_t bytes() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqmap::bench
