// SPDX-License-Identifier: GPL-3.0-or-later
#include "edge_collapser.hpp"

#include <algorithm>

namespace sqmap::bake {

namespace {
using Face = std::array<std::uint32_t, 3>;
// Of a triangle above its longest side, in lengths of that side.
constexpr double kLeastHeight = 1e-6;
}  // namespace

EdgeCollapser::EdgeCollapser(Triangles& mesh) : mesh_(mesh) {
  const std::size_t point_count = mesh.points.size();
  into_.resize(point_count);
  for (std::uint32_t v = 0; v < point_count; ++v) into_[v] = v;
  alive_.assign(mesh.faces.size(), 1);
  fan_.resize(point_count);
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f)
    for (const std::uint32_t v : mesh.faces[f]) fan_[v].push_back(f);
}

std::uint32_t EdgeCollapser::survivor(std::uint32_t v) {
  while (into_[v] != v) v = into_[v] = into_[into_[v]];
  return v;
}

void EdgeCollapser::neighbours(std::uint32_t v, std::vector<std::uint32_t>& list) const {
  list.clear();
  for (const std::uint32_t f : fan_[v])
    for (const std::uint32_t w : mesh_.faces[f])
      if (w != v) list.push_back(w);
  std::sort(list.begin(), list.end());
}

EdgeCollapser::Fan EdgeCollapser::unite(std::vector<std::uint32_t>& neighbours) {
  std::size_t kept = 0, on_rim = 0;
  for (std::size_t begin = 0, end = 0; begin < neighbours.size(); begin = end) {  // sorted
    while (end < neighbours.size() && neighbours[end] == neighbours[begin]) ++end;
    if (end - begin > 2) return Fan::kNone;
    on_rim += end - begin == 1;
    neighbours[kept++] = neighbours[begin];
  }
  neighbours.resize(kept);
  return on_rim == 0 ? Fan::kClosed : on_rim == 2 ? Fan::kOnRim : Fan::kNone;
}

// Link condition: the two vertices share exactly the neighbours that lie opposite in their common faces, all
// their edges have two faces, or one on a rim, and no remaining face turns over.
bool EdgeCollapser::may_collapse(std::uint32_t a, std::uint32_t b, const Vec3d& target,
                                 std::size_t least_edges) {
  neighbours(a, ring_a_);
  neighbours(b, ring_b_);
  if (unite(ring_a_) != Fan::kClosed || unite(ring_b_) != Fan::kClosed) return false;
  if (common() != 2 || ring_a_.size() + ring_b_.size() < 4 + least_edges) return false;
  return !flips(a, b, target) && !flips(b, a, target);
}

bool EdgeCollapser::may_move(std::uint32_t keep, std::uint32_t gone) {
  neighbours(gone, ring_a_);
  neighbours(keep, ring_b_);
  const auto common_faces = static_cast<std::size_t>(std::count(ring_a_.begin(), ring_a_.end(), keep));
  const Fan fan = unite(ring_a_), other = unite(ring_b_);
  if (fan == Fan::kNone || other == Fan::kNone) return false;
  if (common_faces != (fan == Fan::kClosed ? 2 : 1) || common() != common_faces) return false;
  const std::size_t edges = ring_a_.size() + ring_b_.size();
  const bool is_tetrahedron = other == Fan::kClosed && edges < 7;
  const bool is_triangle = fan == Fan::kOnRim && edges < 5;
  return !is_tetrahedron && !is_triangle && !flips(gone, keep, mesh_.points[keep]);
}

std::size_t EdgeCollapser::common() const {
  std::size_t count = 0;
  for (const std::uint32_t v : ring_a_) count += std::binary_search(ring_b_.begin(), ring_b_.end(), v);
  return count;
}

bool EdgeCollapser::flips(std::uint32_t moved, std::uint32_t other, const Vec3d& target) const {
  for (const std::uint32_t f : fan_[moved]) {
    const Face& face = mesh_.faces[f];
    if (face[0] == other || face[1] == other || face[2] == other) continue;
    std::array<Vec3d, 3> before{}, after{};
    for (int i = 0; i < 3; ++i) {
      before[i] = mesh_.points[face[i]];
      after[i] = face[i] == moved ? target : before[i];
    }
    const Vec3d n0 = cross(before[1] - before[0], before[2] - before[0]);
    const Vec3d n1 = cross(after[1] - after[0], after[2] - after[0]);
    if (!(dot(n0, n1) > 0.3 * norm(n0) * norm(n1)) && norm(n0) > 0) return true;
    // Nor may it lose its area but for rounding.
    double side2 = 0;
    for (int i = 0; i < 3; ++i) {
      const Vec3d side = after[(i + 1) % 3] - after[i];
      side2 = std::max(side2, dot(side, side));
    }
    if (!(norm(n1) > kLeastHeight * side2)) return true;
  }
  return false;
}

void EdgeCollapser::collapse(std::uint32_t keep, std::uint32_t gone, const Vec3d& target) {
  mesh_.points[keep] = target;
  into_[gone] = keep;
  for (const std::uint32_t f : fan_[gone]) {
    Face& face = mesh_.faces[f];
    if (face[0] == keep || face[1] == keep || face[2] == keep) {
      alive_[f] = 0;
      for (const std::uint32_t v : face)
        if (v != gone) std::erase(fan_[v], f);
    } else {
      std::replace(face.begin(), face.end(), gone, keep);
      fan_[keep].push_back(f);
    }
  }
  fan_[gone] = {};
}

}  // namespace sqmap::bake
