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

  /// Lifts a node along a normal and takes away the speed against it, with Coulomb friction on the rest.
  /// @return  change of the node's momentum [N s]
  Vec3d push_out(std::size_t node, double by_m, const Vec3d& normal, double friction);
  /// Puts a node back where it was before the step, at rest. Change of momentum as above.
  Vec3d put_back(std::size_t node);

  TriangleSurface surface() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  std::vector<Vec3f> nodes_m_, before_m_;
};

}  // namespace sqmap::apps
