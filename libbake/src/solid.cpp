// SPDX-License-Identifier: GPL-3.0-or-later
#include "solid.hpp"

#include <algorithm>
#include <map>
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

/// Caps with the edges between two of them cut where they cross the plane. Edges that a cap shares with the
/// mesh stay whole: the triangle behind them does.
Solid SolidSet::with_caps_cut(const Solid& solid, const HalfSpace& plane) {
  std::map<Edge, std::uint32_t> middle;  // of edges from the lower to the higher vertex; kNewFace: none yet
  const auto edge_of = [](std::uint32_t a, std::uint32_t b) { return Edge{std::min(a, b), std::max(a, b)}; };
  for (std::size_t k = 0; k < solid.triangles.size(); ++k) {
    if (solid.face[k] != kNewFace) continue;
    const auto& t = solid.triangles[k];
    for (std::size_t side = 0; side < 3; ++side) {
      const auto [a, b] = edge_of(t[side], t[(side + 1) % 3]);
      if ((plane.above_m(vertices_m[a]) < 0) != (plane.above_m(vertices_m[b]) < 0)) middle[{a, b}] = kNewFace;
    }
  }
  for (std::size_t k = 0; k < solid.triangles.size() && !middle.empty(); ++k) {
    if (solid.face[k] == kNewFace) continue;
    const auto& t = solid.triangles[k];
    for (std::size_t side = 0; side < 3; ++side) middle.erase(edge_of(t[side], t[(side + 1) % 3]));
  }
  if (middle.empty()) return solid;
  for (auto& [edge, vertex] : middle) {
    const Vec3d &a = vertices_m[edge.first], &b = vertices_m[edge.second];
    const double from_m = plane.above_m(a), to_m = plane.above_m(b);
    vertex = static_cast<std::uint32_t>(vertices_m.size());
    vertices_m.push_back(a + from_m / (from_m - to_m) * (b - a));
  }
  Solid result;
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t face) {
    result.triangles.push_back({a, b, c});
    result.face.push_back(face);
  };
  for (std::size_t k = 0; k < solid.triangles.size(); ++k) {
    const auto& t = solid.triangles[k];
    std::array<std::uint32_t, 3> cut{kNewFace, kNewFace, kNewFace};
    std::size_t cuts = 0, whole = 0;  // edges cut; the last edge that is not
    for (std::size_t side = 0; side < 3 && solid.face[k] == kNewFace; ++side) {
      const auto found = middle.find(edge_of(t[side], t[(side + 1) % 3]));
      if (found == middle.end()) {
        whole = side;
        continue;
      }
      cut[side] = found->second;
      ++cuts;
    }
    if (cuts == 0) {
      add(t[0], t[1], t[2], solid.face[k]);
      continue;
    }
    if (cuts == 1)
      whole = cut[0] != kNewFace ? 2 : cut[1] != kNewFace ? 0 : 1;  // the edge before the cut one
    const std::uint32_t a = t[whole], b = t[(whole + 1) % 3], c = t[(whole + 2) % 3];
    const std::uint32_t bc = cut[(whole + 1) % 3], ca = cut[(whole + 2) % 3];
    add(a, b, bc, kNewFace);
    if (cuts == 2) add(a, bc, ca, kNewFace);
    add(cuts == 2 ? ca : a, bc, c, kNewFace);
  }
  return result;
}

std::pair<Solid, Solid> SolidSet::split(const Solid& solid, const HalfSpace& first_side) {
  const Solid cut = with_caps_cut(solid, first_side);
  return split(cut, [&](std::size_t k) { return first_side.above_m(centroid(cut.triangles[k])) < 0; });
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
