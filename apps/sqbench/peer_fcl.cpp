// SPDX-License-Identifier: GPL-3.0-or-later
#include <limits>
#include <memory>
#include <vector>

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/math/bv/OBB.h>
#include <fcl/narrowphase/collision.h>

#include "peer.hpp"

namespace sqmap::bench {
namespace {

using Tree = fcl::BVHModel<fcl::OBB<double>>;

std::shared_ptr<Tree> tree_of(const bake::Mesh& mesh) {
  std::vector<fcl::Vector3d> vertices;
  vertices.reserve(mesh.vertices_m.size());
  for (const Vec3d& v : mesh.vertices_m) vertices.emplace_back(v.x, v.y, v.z);
  std::vector<fcl::Triangle> triangles;
  triangles.reserve(mesh.faces.size());
  for (const auto& [a, b, c] : mesh.faces) triangles.emplace_back(a, b, c);
  auto tree = std::make_shared<Tree>();
  tree->beginModel(static_cast<int>(triangles.size()), static_cast<int>(vertices.size()));
  tree->addSubModel(vertices, triangles);
  tree->endModel();
  return tree;
}

class FclPeer : public ContactPeer {
 public:
  FclPeer(const Model& model, const bake::Mesh& probe, bool first_contact_only)
      : object_(tree_of(model.mesh)), probe_(tree_of(probe)) {
    request_.num_max_contacts =
        first_contact_only ? 1 : static_cast<std::size_t>(std::numeric_limits<int>::max());
  }

  std::size_t contacts(const Placement& placement) const override {
    fcl::Transform3d pose = fcl::Transform3d::Identity();
    for (int row = 0; row < 3; ++row) {
      for (int col = 0; col < 3; ++col)
        pose.linear()(row, col) = placement.rotation.row[static_cast<std::size_t>(row)][col];
      pose.translation()(row) = placement.translation_m[row];
    }
    result_.clear();
    return fcl::collide(object_.get(), fcl::Transform3d::Identity(), probe_.get(), pose, request_, result_);
  }
  std::size_t bytes() const override {  // memUsage() of FCL returns no number
    return sizeof(Tree) +
           static_cast<std::size_t>(object_->getNumBVs()) * sizeof(fcl::BVNode<fcl::OBB<double>>) +
           static_cast<std::size_t>(object_->num_tris) * (sizeof(fcl::Triangle) + sizeof(unsigned)) +
           static_cast<std::size_t>(object_->num_vertices) * sizeof(fcl::Vector3d);
  }

 private:
  std::shared_ptr<Tree> object_, probe_;
  fcl::CollisionRequestd request_;
  mutable fcl::CollisionResultd result_;  // keeps its memory from frame to frame
};

}  // namespace

std::unique_ptr<ContactPeer> make_fcl(const Model& model, const bake::Mesh& probe, bool first_contact_only) {
  return std::make_unique<FclPeer>(model, probe, first_contact_only);
}

}  // namespace sqmap::bench
