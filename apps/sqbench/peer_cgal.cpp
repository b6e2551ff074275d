// SPDX-License-Identifier: GPL-3.0-or-later
#include <vector>

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>

#include "closest.hpp"
#include "exact_answer.hpp"
#include "peer.hpp"

namespace sqmap::bench {
namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Triangles = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

Kernel::Point_3 to_cgal(const Vec3d& p) { return {p.x, p.y, p.z}; }

/// Closest point of every point in the object's box: the tree takes no bound on the distance.
class CgalPeer : public Peer {
 public:
  explicit CgalPeer(const Model& model)
      : mesh_(model.mesh), normals_(model.mesh), near_(model), band_m_(kBand * model.r_max_m()) {
    triangles_.reserve(mesh_.faces.size());
    for (const auto& [a, b, c] : mesh_.faces)
      triangles_.emplace_back(to_cgal(mesh_.vertices_m[a]), to_cgal(mesh_.vertices_m[b]),
                              to_cgal(mesh_.vertices_m[c]));
    tree_.rebuild(triangles_.cbegin(), triangles_.cend());
    tree_.accelerate_distance_queries();
  }

  void answer(const Cloud& cloud, const Placement& placement, Hits& hits) const override {
    hits.count = 0;
    typename Tree::Point_and_primitive_id nearest;  // of the block's centre, then of the last point
    near_.for_each(
        cloud, placement,
        [&](const Vec3f& centre_m, float radius_m) {
          const Kernel::Point_3 centre = to_cgal(cast<double>(centre_m));
          nearest = tree_.closest_point_and_primitive(centre);
          const double within_m = band_m_ + double{radius_m};
          return CGAL::squared_distance(centre, nearest.first) <= within_m * within_m;
        },
        [&](std::size_t i, const Vec3f& p_m) {
          const Vec3d p = cast<double>(p_m);
          nearest = tree_.closest_point_and_primitive(to_cgal(p), nearest);
          const auto face = static_cast<std::uint32_t>(nearest.second - triangles_.cbegin());
          const auto& [a, b, c] = mesh_.faces[face];
          const OnTriangle there =
              nearest_on_triangle(p, {mesh_.vertices_m[a], mesh_.vertices_m[b], mesh_.vertices_m[c]});
          const Vec3d away = p - there.point_m;
          const Vec3d normal = normals_.at(face, there.feature);
          if (dot(away, normal) >= 0 && dot(away, away) > band_m_ * band_m_) return;
          add_exact(i, p, there.point_m, normal, hits);
        });
  }
  /// The triangles, the nodes (two boxes' worth a triangle) and the points of the search for a first guess.
  std::size_t bytes() const override {
    return sizeof(*this) + normals_.bytes() + triangles_.capacity() * sizeof(triangles_[0]) +
           triangles_.size() * (sizeof(Primitive) + sizeof(CGAL::Bbox_3) + 2 * sizeof(void*)) +
           triangles_.size() * (sizeof(Kernel::Point_3) + sizeof(Primitive));
  }
  StatedError stated_error() const override { return kExactError; }

 private:
  const bake::Mesh& mesh_;
  Triangles triangles_;
  Tree tree_;
  Pseudonormals normals_;
  NearBox near_;
  double band_m_;
};

}  // namespace

std::unique_ptr<Peer> make_cgal(const Model& model) { return std::make_unique<CgalPeer>(model); }

}  // namespace sqmap::bench
