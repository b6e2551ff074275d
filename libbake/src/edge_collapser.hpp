// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "surface.hpp"

namespace sqmap::bake {

/// Triangles whose edges are contracted one by one; callers ask first where that keeps the topology and turns
/// no face over. Vertices and faces keep their numbers. Works on any triangles; non-manifold edges are left
/// alone.
class EdgeCollapser {
 public:
  explicit EdgeCollapser(Triangles& mesh);

  /// Whether two vertices off the rim of the surface may become one at `target`, and have `least_edges` >= 3
  /// then.
  bool may_collapse(std::uint32_t keep, std::uint32_t gone, const Vec3d& target, std::size_t least_edges);
  /// Whether `gone` may be moved into `keep`, which stays where it is. On the rim only along the rim.
  bool may_move(std::uint32_t keep, std::uint32_t gone);
  void collapse(std::uint32_t keep, std::uint32_t gone, const Vec3d& target);

  /// The vertex that v has become part of.
  std::uint32_t survivor(std::uint32_t v);
  bool is_vertex(std::uint32_t v) const { return into_[v] == v; }
  bool is_alive(std::uint32_t face) const { return alive_[face] != 0; }
  const std::vector<std::uint32_t>& faces_around(std::uint32_t v) const { return fan_[v]; }

 private:
  enum class Fan { kClosed, kOnRim, kNone };
  /// By how many faces a vertex shares with each neighbour: two with all, or one with two of them. Sorted
  /// neighbours, one entry a face; one entry each then.
  static Fan unite(std::vector<std::uint32_t>& neighbours);
  void neighbours(std::uint32_t v, std::vector<std::uint32_t>& list) const;
  /// Of ring_a_ and ring_b_.
  std::size_t common() const;
  bool flips(std::uint32_t moved, std::uint32_t other, const Vec3d& target) const;

  Triangles& mesh_;
  std::vector<std::uint32_t> into_;
  std::vector<std::uint8_t> alive_;
  std::vector<std::vector<std::uint32_t>> fan_;
  std::vector<std::uint32_t> ring_a_, ring_b_;
};

}  // namespace sqmap::bake
