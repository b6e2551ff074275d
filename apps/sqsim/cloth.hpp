// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "../common/part_surface.hpp"
#include "scene_file.hpp"

namespace sqmap::apps {

/// A square cloth of Bullet's soft body under gravity. Bullet knows of no object: what the cloth meets is
/// told node by node.
class Cloth {
 public:
  explicit Cloth(const ClothEntry& entry);
  ~Cloth();
  Cloth(Cloth&&) = delete;

  /// Lets the cloth fall for a step.
  void step(double step_s);
  /// World frame, of the last step and its corrections.
  std::span<const Vec3f> nodes_m() const noexcept { return nodes_m_; }

  /// Lifts a node along a normal and takes away the speed against it. Friction holds the node where it last
  /// touched while that takes no more than `friction` times the lift, and lets it slide by the rest beyond
  /// (the cone of Coulomb in steps of position, after Mueller et al. 2007). Friction on the velocity alone
  /// would let it creep by what each step moves it before it is stopped.
  /// @return  change of the node's momentum [N s]
  Vec3d push_out(std::size_t node, double by_m, const Vec3d& normal, double friction);
  /// Puts a node back where it was before the step, at rest. Change of momentum as above.
  Vec3d put_back(std::size_t node);

  TriangleSurface surface() const;

 private:
  struct Impl;
  void hold(std::size_t node, const Vec3d& at_m);
  std::unique_ptr<Impl> impl_;
  std::vector<Vec3f> nodes_m_, before_m_;
  std::vector<Vec3d> anchor_m_;           ///< where a node last touched
  std::vector<char> was_held_, is_held_;  ///< it touched in the step before, in this one
  double step_s_{};
};

}  // namespace sqmap::apps
