// SPDX-License-Identifier: GPL-3.0-or-later
//
// What Embree is used for: it finds the triangles whose boxes a ray or a sphere meets.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "sqmap/bake/mesh.hpp"
#include "sqmap/bake/oracle.hpp"

namespace sqmap::bake {

class MeshBoxes {
 public:
  /// `widest`: as Embree names instruction sets ("sse4.2", "avx2"), none beyond which it may use; empty: all
  /// that the processor has. The answers are the same.
  explicit MeshBoxes(const Mesh& mesh, const std::string& widest = {});
  ~MeshBoxes();
  MeshBoxes(const MeshBoxes&) = delete;
  MeshBoxes& operator=(const MeshBoxes&) = delete;

  using Ray = RayTracer::Ray;
  /// As RayTracer::trace and trace_lines say. Neighbours along `rays` should be neighbours in space.
  void trace(std::span<const Ray> rays, bool whole_lines, std::span<std::vector<RayTracer::Hit>> hits) const;
  /// The nearest point, computed in double, of a mesh with at least one face. p is finite, and the mesh no
  /// farther from it than at_most_m.
  Oracle::Answer nearest(const Vec3d& p_m, double at_most_m) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqmap::bake
