// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <vector>

#include "peer.hpp"

namespace sqmap::bench {
namespace {

struct Boxed {
  std::array<Vec3d, 3> corner_m;
  Vec3d low_m, high_m;
};

Boxed boxed(const std::array<Vec3d, 3>& corner_m) {
  Boxed triangle{corner_m, corner_m[0], corner_m[0]};
  for (const Vec3d& c : corner_m)
    for (int axis = 0; axis < 3; ++axis) {
      triangle.low_m[axis] = std::min(triangle.low_m[axis], c[axis]);
      triangle.high_m[axis] = std::max(triangle.high_m[axis], c[axis]);
    }
  return triangle;
}

bool overlap(const Boxed& a, const Boxed& b) {
  for (int axis = 0; axis < 3; ++axis)
    if (a.low_m[axis] > b.high_m[axis] || b.low_m[axis] > a.high_m[axis]) return false;
  return true;
}

double volume(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d) {
  return dot(b - a, cross(c - a, d - a));
}

/// Whether the segment (a, b) crosses the triangle: its ends on two sides of the plane, its line through the
/// inside.
bool crosses(const Vec3d& a, const Vec3d& b, const std::array<Vec3d, 3>& t) {
  if (volume(a, t[0], t[1], t[2]) * volume(b, t[0], t[1], t[2]) > 0) return false;
  const double u = volume(a, b, t[0], t[1]), v = volume(a, b, t[1], t[2]), w = volume(a, b, t[2], t[0]);
  return (u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0);
}

bool cross_each_other(const Boxed& a, const Boxed& b) {
  for (std::size_t k = 0; k < 3; ++k) {
    if (crosses(a.corner_m[k], a.corner_m[(k + 1) % 3], b.corner_m)) return true;
    if (crosses(b.corner_m[k], b.corner_m[(k + 1) % 3], a.corner_m)) return true;
  }
  return false;
}

}  // namespace

std::size_t count_crossing_pairs(const Model& model, const bake::Mesh& probe, const Placement& placement) {
  const auto place = [&](const Vec3d& p) {
    Vec3d placed;
    for (int axis = 0; axis < 3; ++axis)
      placed[axis] = dot(cast<double>(placement.rotation.row[static_cast<std::size_t>(axis)]), p);
    return placed + cast<double>(placement.translation_m);
  };
  std::vector<Boxed> ours;
  for (const auto& [a, b, c] : probe.faces) {
    const Boxed triangle =
        boxed({place(probe.vertices_m[a]), place(probe.vertices_m[b]), place(probe.vertices_m[c])});
    if (overlap(triangle, {{}, model.low_m, model.high_m})) ours.push_back(triangle);
  }
  std::size_t count = 0;
  for (const auto& [a, b, c] : model.mesh.faces) {
    const Boxed theirs =
        boxed({model.mesh.vertices_m[a], model.mesh.vertices_m[b], model.mesh.vertices_m[c]});
    for (const Boxed& triangle : ours)
      if (overlap(triangle, theirs) && cross_each_other(triangle, theirs)) ++count;
  }
  return count;
}

}  // namespace sqmap::bench
