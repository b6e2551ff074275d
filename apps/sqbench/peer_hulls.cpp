// SPDX-License-Identifier: GPL-3.0-or-later
//
// What games link today: Bullet's hierarchical approximate convex decomposition (HACD), one hull a cluster. A
// point is asked of the hulls whose boxes, grown by the band, hold it; the deepest answer counts. Inside a
// hull that is its most outward plane; outside, Bullet's GJK.
#include "peer_hulls.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btConvexPolyhedron.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpa2.h>
#include <HACD/hacdHACD.h>

#include "exact_answer.hpp"
#include "timing.hpp"
#include "union_oracle.hpp"
#include "work.hpp"

namespace sqmap::bench {
namespace {

struct Hull {
  std::unique_ptr<btConvexHullShape> shape;
  Vec3f low_m, high_m;  // box, grown by the band
  bool may_hold(const Vec3f& p) const noexcept {
    return p.x >= low_m.x && p.x <= high_m.x && p.y >= low_m.y && p.y <= high_m.y && p.z >= low_m.z &&
           p.z <= high_m.z;
  }
};

/// Of a point above the face's plane [m].
float height_m(const btFace& face, const btVector3& p_m) {
  return p_m.x() * face.m_plane[0] + p_m.y() * face.m_plane[1] + p_m.z() * face.m_plane[2] + face.m_plane[3];
}

btVector3 bullet(const Vec3f& p) { return {p.x, p.y, p.z}; }

std::vector<bake::Mesh> decomposed(const bake::Mesh& mesh, std::size_t least_hulls) {
  std::vector<HACD::Vec3<HACD::Real>> points;
  std::vector<HACD::Vec3<long>> faces;
  for (const Vec3d& v : mesh.vertices_m) points.emplace_back(v.x, v.y, v.z);
  for (const auto& [a, b, c] : mesh.faces) faces.emplace_back(long{a}, long{b}, long{c});
  HACD::HACD hacd;
  hacd.SetPoints(points.data());
  hacd.SetNPoints(points.size());
  hacd.SetTriangles(faces.data());
  hacd.SetNTriangles(faces.size());
  hacd.SetCompacityWeight(0.1);
  hacd.SetVolumeWeight(0);
  hacd.SetNClusters(least_hulls);
  hacd.SetNVerticesPerCH(100);
  hacd.SetConcavity(100);  // of a mesh 1,000 long: the number of clusters decides
  hacd.SetAddExtraDistPoints(false);
  hacd.SetAddNeighboursDistPoints(false);
  hacd.SetAddFacesPoints(false);
  hacd.NormalizeData();  // shifts and scales the points; the hulls stay so
  hacd.Compute();
  std::size_t one = 0, other = 0;  // the ends of the longest stretch of x
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (mesh.vertices_m[k].x < mesh.vertices_m[one].x) one = k;
    if (mesh.vertices_m[k].x > mesh.vertices_m[other].x) other = k;
  }
  const auto placed = [&](std::size_t k) { return Vec3d{points[k].X(), points[k].Y(), points[k].Z()}; };
  const double unit_m =
      (mesh.vertices_m[other].x - mesh.vertices_m[one].x) / (placed(other).x - placed(one).x);
  std::vector<bake::Mesh> hulls;
  for (std::size_t k = 0; k < hacd.GetNClusters(); ++k) {
    std::vector<HACD::Vec3<HACD::Real>> corners(hacd.GetNPointsCH(k));
    std::vector<HACD::Vec3<long>> triangles(hacd.GetNTrianglesCH(k));
    hacd.GetCH(k, corners.data(), triangles.data());
    hulls.emplace_back();
    for (const auto& p : corners)
      hulls.back().vertices_m.push_back(mesh.vertices_m[one] +
                                        unit_m * (Vec3d{p.X(), p.Y(), p.Z()} - placed(one)));
    bake::Mesh& hull = hulls.back();
    Vec3d middle_m;
    for (const Vec3d& v : hull.vertices_m)
      middle_m = middle_m + (1.0 / static_cast<double>(corners.size())) * v;
    for (const auto& triangle : triangles) {
      std::array<std::uint32_t, 3> face{static_cast<std::uint32_t>(triangle.X()),
                                        static_cast<std::uint32_t>(triangle.Y()),
                                        static_cast<std::uint32_t>(triangle.Z())};
      const Vec3d &a = hull.vertices_m[face[0]], &b = hull.vertices_m[face[1]], &c = hull.vertices_m[face[2]];
      if (dot(cross(b - a, c - a), a - middle_m) < 0) std::swap(face[1], face[2]);  // outwards
      hull.faces.push_back(face);
    }
    hull.source_face.assign(hull.faces.size(), bake::kNewFace);
  }
  return hulls;
}

class HullsPeer : public Peer {
 public:
  HullsPeer(const Model& model, std::size_t least_hulls)
      : least_hulls_(least_hulls), near_(model), band_m_(static_cast<float>(kBand * model.r_max_m())) {
    Hulls& hulls = model.hulls[least_hulls];
    if (hulls.meshes.empty())
      hulls.meshes = make_timed([&] { return decomposed(model.mesh, least_hulls); }, hulls.seconds);
    for (const bake::Mesh& mesh : hulls.meshes) {
      Hull hull{std::make_unique<btConvexHullShape>(), cast<float>(mesh.vertices_m.front()),
                cast<float>(mesh.vertices_m.front())};
      for (const Vec3d& corner : mesh.vertices_m) {
        const Vec3f p = cast<float>(corner);
        hull.shape->addPoint(bullet(p), false);
        for (int axis = 0; axis < 3; ++axis) {
          hull.low_m[axis] = std::min(hull.low_m[axis], p[axis] - band_m_);
          hull.high_m[axis] = std::max(hull.high_m[axis], p[axis] + band_m_);
        }
      }
      hull.shape->setMargin(0);
      hull.shape->recalcLocalAabb();
      if (!hull.shape->initializePolyhedralFeatures()) continue;  // flat: nothing can be inside
      hulls_.push_back(std::move(hull));
      meshes_.push_back(mesh);
    }
    stated_percent_ = kSampleMargin * own_error_percent(model) + 1e-3;
  }

  void answer(const Cloud& cloud, const Placement& placement, Hits& hits) const override {
    hits.count = 0;
    near_.for_each(cloud, placement, [&](std::size_t i, const Vec3f& p_m) {
      float deepest_m = band_m_;
      btVector3 normal(0, 0, 0);
      for (const Hull& hull : hulls_)
        if (hull.may_hold(p_m)) ask(*hull.shape, bullet(p_m), deepest_m, normal);
      if (deepest_m < band_m_) hits.add(i, deepest_m, {normal.x(), normal.y(), normal.z()});
    });
  }
  std::size_t bytes() const override {
    std::size_t sum = sizeof(*this);
    for (const Hull& hull : hulls_) {
      const btConvexPolyhedron& solid = *hull.shape->getConvexPolyhedron();
      sum += sizeof(Hull) + sizeof(btConvexHullShape) + sizeof(btConvexPolyhedron);
      sum += static_cast<std::size_t>(hull.shape->getNumPoints() + solid.m_vertices.size() +
                                      solid.m_uniqueEdges.size()) *
             sizeof(btVector3);
      for (int k = 0; k < solid.m_faces.size(); ++k)
        sum += sizeof(btFace) + static_cast<std::size_t>(solid.m_faces[k].m_indices.size()) * sizeof(int);
    }
    return sum;
  }
  StatedError stated_error() const override { return {stated_percent_, true}; }
  std::span<const bake::Mesh> stands_for() const override { return meshes_; }
  std::vector<double> shared_seconds(const Model& model) const override {
    return model.hulls[least_hulls_].seconds;
  }

 private:
  /// What the hulls themselves are off, by exact distances to their meshes: no line of this is Bullet's.
  double own_error_percent(const Model& model) const {
    const Shell shell = make_shell(model, kOwnShell, 1000);
    const UnionOracle exact(meshes_);
    double sum_m = 0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < shell.points_m.size(); ++i) {
      const double told_m = exact.signed_distance(shell.points_m[i]);
      if (told_m > kBand * model.r_max_m()) continue;
      sum_m += std::abs(told_m - shell.distance_m[i]);
      ++count;
    }
    return 100 * sum_m / (static_cast<double>(std::max<std::size_t>(count, 1)) * model.r_max_m());
  }

  /// Lowers `deepest_m` to the signed distance to the hull if that is less.
  static void ask(const btConvexHullShape& hull, const btVector3& p_m, float& deepest_m, btVector3& normal) {
    const btConvexPolyhedron& solid = *hull.getConvexPolyhedron();
    float most_m = -std::numeric_limits<float>::infinity();
    int outward = 0;
    for (int k = 0; k < solid.m_faces.size(); ++k) {
      const float here_m = height_m(solid.m_faces[k], p_m);
      if (here_m <= most_m) continue;
      most_m = here_m;
      outward = k;
      if (most_m >= deepest_m) return;  // the distance is no less
    }
    if (most_m <= 0) {
      deepest_m = most_m;
      const btScalar* plane = solid.m_faces[outward].m_plane;
      normal.setValue(plane[0], plane[1], plane[2]);
      return;
    }
    btGjkEpaSolver2::sResults results;
    const float distance_m =
        btGjkEpaSolver2::SignedDistance(p_m, 0, &hull, btTransform::getIdentity(), results);
    if (distance_m >= deepest_m) return;
    deepest_m = distance_m;
    normal = results.normal;
  }

  std::size_t least_hulls_;
  std::vector<Hull> hulls_;
  NearBox near_;
  float band_m_;
  double stated_percent_{};
  std::vector<bake::Mesh> meshes_;  // for the checks; no query reads them
};

}  // namespace

std::unique_ptr<Peer> make_hulls(const Model& model, std::size_t least_hulls) {
  return std::make_unique<HullsPeer>(model, least_hulls);
}

}  // namespace sqmap::bench
