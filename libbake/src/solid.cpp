// SPDX-License-Identifier: GPL-3.0-or-later
#include "solid.hpp"

#include <algorithm>
#include <numeric>

namespace sqmap::bake {

namespace {

using Edge = std::pair<std::uint32_t, std::uint32_t>;

/// Directed edges that the triangles leave unbalanced, ascending; an edge that is unbalanced k times stands k
/// times.
std::vector<Edge> boundary(const Solid& solid) {
  struct Side {
    std::uint32_t low, high;
    int sign;
  };
  std::vector<Side> sides;
  sides.reserve(3 * solid.triangles.size());
  for (const auto& t : solid.triangles) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      sides.push_back(a < b ? Side{a, b, 1} : Side{b, a, -1});
    }
  }
  std::sort(sides.begin(), sides.end(),
            [](const Side& a, const Side& b) { return a.low != b.low ? a.low < b.low : a.high < b.high; });
  std::vector<Edge> edges;
  for (std::size_t i = 0; i < sides.size();) {
    int sum = 0;
    std::size_t k = i;
    for (; k < sides.size() && sides[k].low == sides[i].low && sides[k].high == sides[i].high; ++k)
      sum += sides[k].sign;
    for (; sum > 0; --sum) edges.emplace_back(sides[i].low, sides[i].high);
    for (; sum < 0; ++sum) edges.emplace_back(sides[i].high, sides[i].low);
    i = k;
  }
  return edges;
}

/// Disjoint sets over a sorted list of vertex ids.
class Pieces {
 public:
  explicit Pieces(const std::vector<Edge>& edges) {
    for (const auto& [a, b] : edges) {
      ids_.push_back(a);
      ids_.push_back(b);
    }
    std::sort(ids_.begin(), ids_.end());
    ids_.erase(std::unique(ids_.begin(), ids_.end()), ids_.end());
    parent_.resize(ids_.size());
    std::iota(parent_.begin(), parent_.end(), 0U);
    for (const auto& [a, b] : edges) parent_[std::max(root(a), root(b))] = std::min(root(a), root(b));
  }
  const std::vector<std::uint32_t>& ids() const { return ids_; }
  std::uint32_t root(std::uint32_t id) {
    auto k = static_cast<std::uint32_t>(std::lower_bound(ids_.begin(), ids_.end(), id) - ids_.begin());
    while (parent_[k] != k) k = parent_[k] = parent_[parent_[k]];
    return k;
  }

 private:
  std::vector<std::uint32_t> ids_, parent_;
};

}  // namespace

void SolidSet::close(Solid& solid, Solid* other) {
  const std::vector<Edge> edges = boundary(solid);
  if (edges.empty()) return;
  Pieces pieces(edges);
  // One tip a connected piece: the mean of its vertices, which lies in the hull of either side.
  std::vector<Vec3d> sum(pieces.ids().size());
  std::vector<std::uint32_t> count(pieces.ids().size()), tip(pieces.ids().size(), kNewFace);
  for (const std::uint32_t id : pieces.ids()) {
    const std::uint32_t root = pieces.root(id);
    sum[root] = sum[root] + vertices_m[id];
    ++count[root];
  }
  for (std::size_t k = 0; k < count.size(); ++k) {
    if (count[k] == 0) continue;
    tip[k] = static_cast<std::uint32_t>(vertices_m.size());
    vertices_m.push_back((1.0 / count[k]) * sum[k]);
  }
  for (const auto& [a, b] : edges) {
    const std::uint32_t apex = tip[pieces.root(a)];
    solid.triangles.push_back({b, a, apex});
    solid.face.push_back(kNewFace);
    if (other != nullptr) {
      other->triangles.push_back({a, b, apex});
      other->face.push_back(kNewFace);
    }
  }
}

std::pair<SolidSet, Solid> SolidSet::whole(const Mesh& mesh) {
  SolidSet set{mesh.vertices_m};
  Solid solid{mesh.faces, {}};
  solid.face.resize(mesh.faces.size());
  std::iota(solid.face.begin(), solid.face.end(), 0U);
  set.close(solid, nullptr);
  return {std::move(set), std::move(solid)};
}

std::pair<Solid, Solid> SolidSet::split(const Solid& solid,
                                        const std::function<bool(std::size_t triangle)>& first_side) {
  Solid first, second;
  for (std::size_t k = 0; k < solid.triangles.size(); ++k) {
    Solid& side = first_side(k) ? first : second;
    side.triangles.push_back(solid.triangles[k]);
    side.face.push_back(solid.face[k]);
  }
  close(first, &second);
  return {std::move(first), std::move(second)};
}

double SolidSet::volume_m3(const Solid& solid) const {
  if (solid.triangles.empty()) return 0;
  const Vec3d origin =
      vertices_m[solid.triangles[0][0]];  // near the solid: no cancellation far from the frame's origin
  double six_volumes = 0;
  for (const auto& t : solid.triangles) {
    six_volumes +=
        dot(vertices_m[t[0]] - origin, cross(vertices_m[t[1]] - origin, vertices_m[t[2]] - origin));
  }
  return six_volumes / 6;
}

std::vector<Vec3d> SolidSet::points(const Solid& solid) const {
  std::vector<std::uint32_t> ids;
  ids.reserve(3 * solid.triangles.size());
  for (const auto& t : solid.triangles) ids.insert(ids.end(), t.begin(), t.end());
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  std::vector<Vec3d> points;
  points.reserve(ids.size());
  for (const std::uint32_t id : ids) points.push_back(vertices_m[id]);
  return points;
}

}  // namespace sqmap::bake
