// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
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

Boxed face_of(const bake::Mesh& mesh, std::uint32_t face) {
  const auto& [a, b, c] = mesh.faces[face];
  return boxed({mesh.vertices_m[a], mesh.vertices_m[b], mesh.vertices_m[c]});
}

std::array<Vec3d, 3> placed(const std::array<Vec3d, 3>& corner_m, const Placement& placement) {
  std::array<Vec3d, 3> result;
  for (std::size_t k = 0; k < 3; ++k) {
    for (int axis = 0; axis < 3; ++axis)
      result[k][axis] =
          dot(cast<double>(placement.rotation.row[static_cast<std::size_t>(axis)]), corner_m[k]);
    result[k] = result[k] + cast<double>(placement.translation_m);
  }
  return result;
}

bool has_corner_behind(const std::array<Vec3d, 3>& t, const std::array<Vec3d, 3>& of, double slack_m) {
  const Vec3d normal = normalized(cross(of[1] - of[0], of[2] - of[0]));
  return std::any_of(t.begin(), t.end(),
                     [&](const Vec3d& corner) { return !(dot(corner - of[0], normal) > slack_m); });
}

}  // namespace

std::size_t count_strays(const std::vector<FacePair>& pairs, const Model& model, const bake::Mesh& probe,
                         const Placement& placement) {
  const double slack_m = 1e-4 * model.r_max_m();  // boxes in 16 bits, corners in single precision
  return static_cast<std::size_t>(std::count_if(pairs.begin(), pairs.end(), [&](const FacePair& pair) {
    // Each mesh's boxes lie along its own axes: those that overlap lie in balls that do.
    const Boxed theirs = face_of(model.mesh, pair.first), own = face_of(probe, pair.second);
    const Vec3d middle_m = placed({0.5 * (own.low_m + own.high_m), {}, {}}, placement)[0];
    const double apart_m = norm(middle_m - 0.5 * (theirs.low_m + theirs.high_m));
    const double reach_m = 0.5 * (norm(own.high_m - own.low_m) + norm(theirs.high_m - theirs.low_m));
    const auto corners_m = placed(own.corner_m, placement);
    return !(apart_m <= reach_m + slack_m && has_corner_behind(corners_m, theirs.corner_m, slack_m) &&
             has_corner_behind(theirs.corner_m, corners_m, slack_m));
  }));
}

std::vector<FacePair> crossing_pairs(const Model& model, const bake::Mesh& probe,
                                     const Placement& placement) {
  std::vector<std::pair<std::uint32_t, Boxed>> ours;
  for (std::uint32_t face = 0; face < probe.faces.size(); ++face) {
    const Boxed triangle = boxed(placed(face_of(probe, face).corner_m, placement));
    if (overlap(triangle, {{}, model.low_m, model.high_m})) ours.emplace_back(face, triangle);
  }
  std::vector<FacePair> pairs;
  for (std::uint32_t face = 0; face < model.mesh.faces.size(); ++face) {
    const Boxed theirs = face_of(model.mesh, face);
    for (const auto& [own, triangle] : ours)
      if (overlap(triangle, theirs) && cross_each_other(triangle, theirs)) pairs.emplace_back(face, own);
  }
  return pairs;
}

}  // namespace sqmap::bench
