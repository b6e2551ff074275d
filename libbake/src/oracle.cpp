// SPDX-License-Identifier: GPL-3.0-or-later
#include "sqmap/bake/oracle.hpp"

#include <cmath>
#include <limits>

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>

#include "winding_tree.hpp"

namespace sqmap::bake {
namespace {

// Closest points need no exact predicates: they are rounded when they are stored in any case.
using Kernel = CGAL::Simple_cartesian<double>;
using Triangles = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Kernel::Point_3 to_cgal(const Vec3d& p) { return {p.x, p.y, p.z}; }

Triangles triangles_of(const Mesh& mesh) {
  Triangles triangles;
  triangles.reserve(mesh.faces.size());
  for (const auto& [a, b, c] : mesh.faces)
    triangles.emplace_back(to_cgal(mesh.vertices_m[a]), to_cgal(mesh.vertices_m[b]),
                           to_cgal(mesh.vertices_m[c]));
  return triangles;
}

}  // namespace

struct Oracle::Impl {
  explicit Impl(const Mesh& mesh)
      : triangles(triangles_of(mesh)),
        tree(triangles.cbegin(), triangles.cend()),
        winding(mesh.vertices_m, mesh.faces) {
    // Both would otherwise happen within the first query, which const queries from several threads must not
    // share.
    tree.build();
    tree.accelerate_distance_queries();
  }

  Triangles triangles;
  Tree tree;
  WindingTree winding;
};

Oracle::Oracle(const Mesh& mesh) : impl_(std::make_unique<Impl>(mesh)) {}
Oracle::~Oracle() = default;
Oracle::Oracle(Oracle&&) noexcept = default;
Oracle& Oracle::operator=(Oracle&&) noexcept = default;

Oracle::Answer Oracle::nearest(const Vec3d& p_m) const {
  if (impl_->triangles.empty() || !std::isfinite(p_m.x + p_m.y + p_m.z))
    return {kNan, {kNan, kNan, kNan}, kNewFace};
  const auto [point, primitive] = impl_->tree.closest_point_and_primitive(to_cgal(p_m));
  const Vec3d nearest_m{point.x(), point.y(), point.z()};
  const Vec3d d_m = nearest_m - p_m;
  return {std::hypot(d_m.x, d_m.y, d_m.z), nearest_m,
          static_cast<std::uint32_t>(primitive - impl_->triangles.cbegin())};
}

double Oracle::winding_number(const Vec3d& p_m) const { return impl_->winding.at(p_m); }

bool Oracle::inside(const Vec3d& p_m) const { return winding_number(p_m) > 0.5; }  // NaN: outside

double Oracle::signed_distance(const Vec3d& p_m) const {
  const double distance_m = nearest(p_m).distance_m;
  return inside(p_m) ? -distance_m : distance_m;
}

}  // namespace sqmap::bake
