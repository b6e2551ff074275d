// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "sqmap/bake/mesh.hpp"

namespace sqmap::bake {

class MeshBoxes;

/// Exact closest-point queries against a mesh (Embree finds the triangles), with the sign from the
/// generalised winding number (Jacobson et al. 2013; Barill et al. 2018), so that open meshes have an inside
/// too. Thread-safe once built.
class Oracle {
 public:
  explicit Oracle(const Mesh& mesh);
  ~Oracle();
  Oracle(Oracle&&) noexcept;
  Oracle& operator=(Oracle&&) noexcept;

  struct Answer {
    double distance_m;   ///< unsigned distance to the nearest point of the mesh
    Vec3d nearest_m;     ///< that point
    std::uint32_t face;  ///< a face that holds it
  };
  /// Of equally near faces the lowest. NaN and kNewFace where p is not finite or the mesh has no faces.
  /// `at_most_m`: the distance is known not to exceed it, which makes the search shorter.
  Answer nearest(const Vec3d& p_m, double at_most_m = std::numeric_limits<double>::infinity()) const;
  /// Generalised winding number at p: about 1 inside a closed outward mesh, 0 outside, fractions near holes.
  /// Evaluated hierarchically (second-order expansion per tree node) with error below 0.01 away from the
  /// surface.
  double winding_number(const Vec3d& p_m) const;
  /// The nearest integer. 0 where p is not finite.
  int rounded_winding_number(const Vec3d& p_m) const;
  /// True where the winding number exceeds 1/2.
  bool inside(const Vec3d& p_m) const;
  /// Negative inside [m].
  double signed_distance(const Vec3d& p_m) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Every crossing of rays with a mesh. Embree finds the boxes of triangles along a ray; whether and where it
/// crosses them is computed in double, by a test that no shared edge or vertex can confuse. Thread-safe once
/// built.
class RayTracer {
 public:
  explicit RayTracer(const Mesh& mesh);
  ~RayTracer();
  RayTracer(RayTracer&&) noexcept;
  RayTracer& operator=(RayTracer&&) noexcept;

  struct Ray {
    Vec3d origin_m, direction;
  };
  struct Hit {
    double t_m;  ///< distance along the ray
    std::uint32_t face;
    bool entering;  ///< the ray goes against the face's outward normal
  };
  /// All hits of the ray origin + t direction, t >= 0, ascending in t, |direction| = 1. A ray through an edge
  /// or a vertex reports one hit for each crossing of the surface, not one a face, and none where it only
  /// grazes. `hits` is cleared first and stays empty for rays that are not finite or not of unit length
  /// within 1e-3.
  void trace(const Vec3d& origin_m, const Vec3d& direction, std::vector<Hit>& hits) const;
  /// As trace, of the whole line: t_m < 0 behind the origin.
  void trace_line(const Vec3d& origin_m, const Vec3d& direction, std::vector<Hit>& hits) const;
  /// As trace_line, of many lines; neighbours in `lines` that are neighbours in space are traced together.
  /// hits: [lines.size()].
  void trace_lines(std::span<const Ray> lines, std::span<std::vector<Hit>> hits) const;

 private:
  std::unique_ptr<MeshBoxes> boxes_;
};

}  // namespace sqmap::bake
