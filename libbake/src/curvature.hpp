// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "surface.hpp"

namespace sqmap::bake {

/// Edge-based curvature tensor of Cohen-Steiner and Morvan 2003: over all edges of a window, the sum of
/// length times bend times the projector on the edge, over the window's area. Symmetric.
struct BendTensor {
  double xx{}, yy{}, zz{}, xy{}, xz{}, yz{};

  void add(double weight, const Vec3d& u) noexcept {
    xx += weight * u.x * u.x;
    yy += weight * u.y * u.y;
    zz += weight * u.z * u.z;
    xy += weight * u.x * u.y;
    xz += weight * u.x * u.z;
    yz += weight * u.y * u.z;
  }
  void add(double weight, const BendTensor& other) noexcept {
    xx += weight * other.xx;
    yy += weight * other.yy;
    zz += weight * other.zz;
    xy += weight * other.xy;
    xz += weight * other.xz;
    yz += weight * other.yz;
  }
  /// Curvature of the surface across a curve that runs along the unit vector t, > 0 convex.
  double across(const Vec3d& t) const noexcept {
    return xx * t.x * t.x + yy * t.y * t.y + zz * t.z * t.z +
           2 * (xy * t.x * t.y + xz * t.x * t.z + yz * t.y * t.z);
  }
};

/// Curvatures at the vertices of a unit-area surface, averaged over windows of one radius.
struct Curvature {
  std::vector<double> gaussian;  ///< angle deficits over area (Peng et al. 2003); shape [points]
  std::vector<BendTensor> bend;  ///< shape [points]
};

/// Both curvatures over connected windows of the given radius. Boundary vertices have no deficit, no bend and
/// count no area. On a surface without concave edges nothing bends negatively, whatever its triangles.
Curvature curvature(const Surface& surface, double radius);

}  // namespace sqmap::bake
