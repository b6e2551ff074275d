// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sqmap/asset/vec.hpp"

namespace sqmap::bake {

/// Generalised winding number of triangles (Jacobson et al. 2013), by a tree whose far nodes are expanded to
/// second order (Barill et al. 2018). Const calls are thread-safe.
class WindingTree {
 public:
  /// Of all faces, or of those in `subset`.
  WindingTree(const std::vector<Vec3d>& vertices_m, const std::vector<std::array<std::uint32_t, 3>>& faces);
  WindingTree(const std::vector<Vec3d>& vertices_m, const std::vector<std::array<std::uint32_t, 3>>& faces,
              std::span<const std::uint32_t> subset);

  /// Error below 0.01 off the surface. NaN where p is not finite.
  double at(const Vec3d& p_m) const;
  /// at(), rounded; less than half of its work where the nearest integer is plain to see. 0 where p is not
  /// finite.
  int rounded_at(const Vec3d& p_m) const;

 private:
  using Triangle = std::array<Vec3d, 3>;
  struct Node {
    Vec3d centre;             ///< of area
    double radius_squared{};  ///< of the sphere round it that holds the triangles
    /// Integrals of the normal n times powers of d = x - centre over the triangles. The derivatives of 1/r
    /// they are multiplied with are symmetric, so only the symmetric sums are kept.
    Vec3d zeroth;                     ///< of n
    std::array<double, 6> first{};    ///< of n d:   xx yy zz xy yz zx, coefficients of these monomials
    std::array<double, 10> second{};  ///< of n d d: xxx yyy zzz xxy xxz yyx yyz zzx zzy xyz, likewise
    std::uint32_t begin{}, end{};     ///< of its triangles
    std::uint32_t right{};            ///< second child; the first follows the node. 0: a leaf
  };

  std::uint32_t build(std::uint32_t begin, std::uint32_t end);
  void expand(Node& node) const;
  /// With nodes expanded beyond so many of their radii.
  double at(const Vec3d& p_m, double far_radii) const;

  Vec3d origin_m_;
  double per_m_ = 1;  ///< the tree works in a unit box, so that no power of a length over- or underflows
  std::vector<Triangle> triangles_;
  std::vector<Node> nodes_;
};

}  // namespace sqmap::bake
