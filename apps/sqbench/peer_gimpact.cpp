// SPDX-License-Identifier: GPL-3.0-or-later
//
// Bullet's triangle meshes that move, GImpact: trees of boxes with quantised bounds.
#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include <BulletCollision/Gimpact/btGImpactCollisionAlgorithm.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>
#include <btBulletCollisionCommon.h>

#include "peer.hpp"

namespace sqmap::bench {
namespace {

struct Body {
  explicit Body(const bake::Mesh& mesh) : vertex_count(mesh.vertices_m.size()) {
    triangles.preallocateVertices(static_cast<int>(mesh.vertices_m.size()));
    for (const Vec3d& v : mesh.vertices_m)
      triangles.findOrAddVertex(
          {static_cast<btScalar>(v.x), static_cast<btScalar>(v.y), static_cast<btScalar>(v.z)}, false);
    for (const auto& [a, b, c] : mesh.faces)
      triangles.addTriangleIndices(static_cast<int>(a), static_cast<int>(b), static_cast<int>(c));
    shape = std::make_unique<btGImpactMeshShape>(&triangles);
    shape->setMargin(0);
    shape->updateBound();
    object.setCollisionShape(shape.get());
  }
  std::size_t vertex_count;
  btTriangleMesh triangles{true, false};  // indices of 32 bits, three coordinates a vertex
  std::unique_ptr<btGImpactMeshShape> shape;
  btCollisionObject object;
};

class Counter : public btManifoldResult {
 public:
  using btManifoldResult::btManifoldResult;
  void addContactPoint(const btVector3& /*normal*/, const btVector3& /*point*/, btScalar /*depth*/) override {
    ++count;
    if (told != nullptr) told->emplace_back(one_, other_);
  }
  void setShapeIdentifiersA(int /*part*/, int triangle) override {
    one_ = static_cast<std::uint32_t>(triangle);
  }
  void setShapeIdentifiersB(int /*part*/, int triangle) override {
    other_ = static_cast<std::uint32_t>(triangle);
  }
  std::size_t count{};
  std::vector<FacePair>* told = nullptr;  ///< where to note them; a mesh has one part

 private:
  std::uint32_t one_{}, other_{};
};

class GImpactPeer : public ContactPeer {
 public:
  GImpactPeer(const Model& model, const bake::Mesh& probe) : object_(model.mesh), probe_(probe) {
    btGImpactCollisionAlgorithm::registerAlgorithm(&dispatcher_);
    const btCollisionObjectWrapper one = wrapped(object_), other = wrapped(probe_);
    algorithm_ = dispatcher_.findAlgorithm(&one, &other, nullptr, BT_CONTACT_POINT_ALGORITHMS);
  }
  ~GImpactPeer() override {
    algorithm_->~btCollisionAlgorithm();
    dispatcher_.freeCollisionAlgorithm(algorithm_);
  }
  GImpactPeer(const GImpactPeer&) = delete;
  GImpactPeer& operator=(const GImpactPeer&) = delete;

  std::size_t contacts(const Placement& placement) const override { return collide(placement, nullptr); }
  bool pairs(const Placement& placement, std::vector<FacePair>& told) const override {
    told.clear();
    collide(placement, &told);
    std::sort(told.begin(), told.end());
    told.erase(std::unique(told.begin(), told.end()), told.end());
    return true;
  }
  std::size_t bytes() const override {
    std::size_t sum = sizeof(Body);
    for (int part = 0; part < object_.shape->getMeshPartCount(); ++part)
      sum += sizeof(btGImpactMeshShapePart) +
             static_cast<std::size_t>(object_.shape->getMeshPart(part)->getBoxSet()->getNodeCount()) *
                 sizeof(BT_QUANTIZED_BVH_NODE);
    return sum + object_.vertex_count * 3 * sizeof(btScalar) +
           static_cast<std::size_t>(object_.triangles.getNumTriangles()) * 3 * sizeof(int);
  }

 private:
  std::size_t collide(const Placement& placement, std::vector<FacePair>* told) const {
    btTransform pose;
    const auto& row = placement.rotation.row;
    pose.getBasis().setValue(row[0].x, row[0].y, row[0].z, row[1].x, row[1].y, row[1].z, row[2].x, row[2].y,
                             row[2].z);
    pose.setOrigin({placement.translation_m.x, placement.translation_m.y, placement.translation_m.z});
    probe_.object.setWorldTransform(pose);
    // btCollisionWorld::contactPairTest would ask for an algorithm of closest points, which GImpact has not.
    const btCollisionObjectWrapper one = wrapped(object_), other = wrapped(probe_);
    Counter counter(&one, &other);
    counter.told = told;
    algorithm_->processCollision(&one, &other, dispatch_, &counter);
    return counter.count;
  }
  static btCollisionObjectWrapper wrapped(const Body& body) {
    return {nullptr, body.shape.get(), &body.object, body.object.getWorldTransform(), -1, -1};
  }

  Body object_;
  mutable Body probe_;  // moves from frame to frame
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDispatcherInfo dispatch_;
  btCollisionAlgorithm* algorithm_;
};

}  // namespace

std::unique_ptr<ContactPeer> make_gimpact(const Model& model, const bake::Mesh& probe) {
  return std::make_unique<GImpactPeer>(model, probe);
}

}  // namespace sqmap::bench
