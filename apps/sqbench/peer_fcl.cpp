// SPDX-License-Identifier: GPL-3.0-or-later
#include <limits>
#include <memory>
#include <type_traits>
#include <vector>

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/math/bv/OBB.h>
#include <fcl/math/bv/kDOP.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/detail/traversal/collision/mesh_collision_traversal_node.h>
#include <fcl/narrowphase/detail/traversal/collision_node.h>

#include "peer.hpp"
#include "peer_fcl_sheet.hpp"

namespace sqmap::bench {
namespace {

fcl::Transform3d pose_of(const Placement& placement) {
  fcl::Transform3d pose = fcl::Transform3d::Identity();
  for (int row = 0; row < 3; ++row) {
    for (int col = 0; col < 3; ++col)
      pose.linear()(row, col) = placement.rotation.row[static_cast<std::size_t>(row)][col];
    pose.translation()(row) = placement.translation_m[row];
  }
  return pose;
}

std::vector<fcl::Vector3d> vertices_of(const bake::Mesh& mesh) {
  std::vector<fcl::Vector3d> vertices;
  vertices.reserve(mesh.vertices_m.size());
  for (const Vec3d& v : mesh.vertices_m) vertices.emplace_back(v.x, v.y, v.z);
  return vertices;
}

template <class Volume>
std::shared_ptr<fcl::BVHModel<Volume>> tree_of(const bake::Mesh& mesh) {
  std::vector<fcl::Triangle> triangles;
  triangles.reserve(mesh.faces.size());
  for (const auto& [a, b, c] : mesh.faces) triangles.emplace_back(a, b, c);
  auto tree = std::make_shared<fcl::BVHModel<Volume>>();
  tree->beginModel(static_cast<int>(triangles.size()), static_cast<int>(mesh.vertices_m.size()));
  tree->addSubModel(vertices_of(mesh), triangles);
  tree->endModel();
  return tree;
}

template <class Volume>
class FclPeer : public ContactPeer {
 public:
  FclPeer(const Model& model, const bake::Mesh& probe, bool first_contact_only)
      : object_(tree_of<Volume>(model.mesh)), probe_(tree_of<Volume>(probe)) {
    moves_object_ = model.mesh.vertices_m.size() < probe.vertices_m.size();
    if constexpr (!kTurns) moved_m_ = resting_m_ = vertices_of(moves_object_ ? model.mesh : probe);
    request_.num_max_contacts =
        first_contact_only ? 1 : static_cast<std::size_t>(std::numeric_limits<int>::max());
  }

  std::size_t contacts(const Placement& placement) const override {
    result_.clear();
    const fcl::Transform3d pose = pose_of(placement);
    if constexpr (kTurns) {
      return fcl::collide(object_.get(), fcl::Transform3d::Identity(), probe_.get(), pose, request_, result_);
    } else {
      // Volumes with fixed directions do not turn with their body. collide() would copy both trees in each
      // frame; here the smaller mesh is moved into the frame of the other and its tree is fitted again.
      const fcl::Transform3d move = moves_object_ ? pose.inverse() : pose;
      for (std::size_t i = 0; i < moved_m_.size(); ++i) moved_m_[i] = move * resting_m_[i];
      auto& mover = moves_object_ ? *object_ : *probe_;
      mover.beginReplaceModel();
      mover.replaceSubModel(moved_m_);
      mover.endReplaceModel(true, true);
      fcl::detail::MeshCollisionTraversalNode<Volume> node;
      fcl::Transform3d here = fcl::Transform3d::Identity(), there = here;
      fcl::detail::initialize(node, *object_, here, *probe_, there, request_, result_);
      fcl::detail::collide(&node);
      return result_.numContacts();
    }
  }
  std::size_t bytes() const override {  // memUsage() of FCL returns no number
    return sizeof(fcl::BVHModel<Volume>) +
           static_cast<std::size_t>(object_->getNumBVs()) * sizeof(fcl::BVNode<Volume>) +
           static_cast<std::size_t>(object_->num_tris) * (sizeof(fcl::Triangle) + sizeof(unsigned)) +
           static_cast<std::size_t>(object_->num_vertices) * sizeof(fcl::Vector3d);
  }

 private:
  static constexpr bool kTurns = std::is_same_v<Volume, fcl::OBB<double>>;
  std::shared_ptr<fcl::BVHModel<Volume>> object_, probe_;
  bool moves_object_;
  std::vector<fcl::Vector3d> resting_m_;
  mutable std::vector<fcl::Vector3d> moved_m_;
  fcl::CollisionRequestd request_;
  mutable fcl::CollisionResultd result_;  // keeps its memory from frame to frame
};

class FclSheet : public SheetTree {
 public:
  FclSheet(const Model& model, const bake::Mesh& sheet, TreeUpdate update)
      : object_(tree_of<Volume>(model.mesh)),
        sheet_(tree_of<Volume>(sheet)),
        refits_(update == TreeUpdate::kRefit),
        moved_m_(sheet.vertices_m.size()) {
    request_.num_max_contacts = static_cast<std::size_t>(std::numeric_limits<int>::max());
  }
  std::size_t contacts(std::span<const Vec3d> places_m) const override {
    for (std::size_t i = 0; i < moved_m_.size(); ++i)
      moved_m_[i] = {places_m[i].x, places_m[i].y, places_m[i].z};
    sheet_->beginReplaceModel();
    sheet_->replaceSubModel(moved_m_);
    sheet_->endReplaceModel(refits_, true);
    result_.clear();
    const fcl::Transform3d here = fcl::Transform3d::Identity();
    return fcl::collide(object_.get(), here, sheet_.get(), here, request_, result_);
  }

 private:
  using Volume = fcl::OBB<double>;
  std::shared_ptr<fcl::BVHModel<Volume>> object_, sheet_;
  bool refits_;
  mutable std::vector<fcl::Vector3d> moved_m_;
  fcl::CollisionRequestd request_;
  mutable fcl::CollisionResultd result_;
};

}  // namespace

std::unique_ptr<SheetTree> make_fcl_sheet(const Model& model, const bake::Mesh& sheet, TreeUpdate update) {
  return std::make_unique<FclSheet>(model, sheet, update);
}

std::unique_ptr<ContactPeer> make_fcl(const Model& model, const bake::Mesh& probe, FclTree tree,
                                      bool first_contact_only) {
  if (tree == FclTree::kObb)
    return std::make_unique<FclPeer<fcl::OBB<double>>>(model, probe, first_contact_only);
  return std::make_unique<FclPeer<fcl::KDOP<double, 18>>>(model, probe, first_contact_only);
}

}  // namespace sqmap::bench
