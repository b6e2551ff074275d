// SPDX-License-Identifier: Apache-2.0
// The one place where Bullet appears.
#include "cloth.hpp"

#include <algorithm>

#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>

namespace sqmap::apps {
namespace {

constexpr double kGravity_m_per_s2 = 9.81;

btVector3 to_bullet(const Vec3d& v) {
  return {static_cast<btScalar>(v.x), static_cast<btScalar>(v.y), static_cast<btScalar>(v.z)};
}
Vec3d from_bullet(const btVector3& v) {
  return {static_cast<double>(v.x()), static_cast<double>(v.y()), static_cast<double>(v.z())};
}

}  // namespace

struct Cloth::Impl {
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btSoftRigidDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration};
  std::unique_ptr<btSoftBody> body;

  ~Impl() { world.removeSoftBody(body.get()); }
};

Cloth::Cloth(const ClothEntry& entry) : impl_(std::make_unique<Impl>()) {
  Impl& impl = *impl_;
  const btVector3 gravity(0, 0, -static_cast<btScalar>(kGravity_m_per_s2));
  impl.world.setGravity(gravity);
  impl.world.getWorldInfo().m_gravity = gravity;
  const double half_m = entry.edge_m / 2;
  const auto corner = [&](double x, double y) { return to_bullet(entry.centre_m + half_m * Vec3d{x, y, 0}); };
  constexpr int kNoFixedCorner = 0;
  constexpr bool kDiagonals = true;
  impl.body.reset(btSoftBodyHelpers::CreatePatch(impl.world.getWorldInfo(), corner(-1, -1), corner(1, -1),
                                                 corner(-1, 1), corner(1, 1), entry.nodes_along_edge,
                                                 entry.nodes_along_edge, kNoFixedCorner, kDiagonals));
  btSoftBody& body = *impl.body;
  body.m_cfg.collisions = 0;  // neither with itself nor with rigid bodies
  body.m_cfg.piterations = 12;
  body.m_cfg.kDP = static_cast<btScalar>(0.01);
  body.setTotalMass(static_cast<btScalar>(entry.mass_kg));
  impl.world.addSoftBody(&body);
  for (int i = 0; i < body.m_nodes.size(); ++i)
    nodes_m_.push_back(cast<float>(from_bullet(body.m_nodes[i].m_x)));
  before_m_ = nodes_m_;
  anchor_m_.resize(nodes_m_.size());
  was_held_.resize(nodes_m_.size());
  is_held_.resize(nodes_m_.size());
}

Cloth::~Cloth() = default;

void Cloth::step(double step_s) {
  before_m_ = nodes_m_;
  was_held_.swap(is_held_);
  std::ranges::fill(is_held_, char{0});
  step_s_ = step_s;
  impl_->world.stepSimulation(static_cast<btScalar>(step_s), 0);
  const auto& nodes = impl_->body->m_nodes;
  for (int i = 0; i < nodes.size(); ++i)
    nodes_m_[static_cast<std::size_t>(i)] = cast<float>(from_bullet(nodes[i].m_x));
}

Vec3d Cloth::push_out(std::size_t node, double by_m, const Vec3d& normal, double friction) {
  btSoftBody::Node& n = impl_->body->m_nodes[static_cast<int>(node)];
  const Vec3d v = from_bullet(n.m_v);
  const double outward = std::max(dot(v, normal), 0.0);
  Vec3d x = from_bullet(n.m_x) + by_m * normal;
  Vec3d along;
  if (was_held_[node] != 0) {
    const Vec3d moved = x - anchor_m_[node];
    const Vec3d slid = moved - dot(moved, normal) * normal;
    const double way_m = norm(slid), most_m = friction * by_m;
    const double left = way_m > most_m ? 1 - most_m / way_m : 0;
    x = x - (1 - left) * slid;
    along = (left / step_s_) * slid;
  } else {  // it arrives: what it loses is a share of the momentum it brought
    const Vec3d brought = v - dot(v, normal) * normal;
    const double speed = norm(brought), inward = std::max(-dot(v, normal), 0.0);
    along = speed > 0 ? std::max(0.0, 1 - friction * inward / speed) * brought : Vec3d{};
  }
  hold(node, x);
  n.m_x = to_bullet(x);
  const Vec3d after = outward * normal + along;
  n.m_v = to_bullet(after);
  return n.m_im > 0 ? (1 / static_cast<double>(n.m_im)) * (after - v) : Vec3d{};
}

Vec3d Cloth::put_back(std::size_t node) {
  btSoftBody::Node& n = impl_->body->m_nodes[static_cast<int>(node)];
  const Vec3d v = from_bullet(n.m_v);
  n.m_x = to_bullet(cast<double>(before_m_[node]));
  n.m_v = {0, 0, 0};
  hold(node, cast<double>(before_m_[node]));
  return n.m_im > 0 ? (-1 / static_cast<double>(n.m_im)) * v : Vec3d{};
}

void Cloth::hold(std::size_t node, const Vec3d& at_m) {
  anchor_m_[node] = at_m;
  is_held_[node] = 1;
  nodes_m_[node] = cast<float>(at_m);
}

TriangleSurface Cloth::surface() const {
  TriangleSurface surface{nodes_m_, {}, {}};
  const btSoftBody& body = *impl_->body;
  for (int f = 0; f < body.m_faces.size(); ++f) {
    std::array<std::uint32_t, 3> triangle{};
    for (std::size_t k = 0; k < 3; ++k)
      triangle[k] = static_cast<std::uint32_t>(body.m_faces[f].m_n[k] - &body.m_nodes[0]);
    surface.triangles.push_back(triangle);
  }
  return surface;
}

}  // namespace sqmap::apps
