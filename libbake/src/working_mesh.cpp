// SPDX-License-Identifier: GPL-3.0-or-later
#include "working_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <queue>
#include <tuple>

#include "long_edges.hpp"

namespace sqmap::bake {
namespace {

using Face = std::array<std::uint32_t, 3>;

class Collapser {
 public:
  Collapser(Triangles& mesh, double shortest_edge) : mesh_(mesh), shortest_(shortest_edge) {
    const std::size_t point_count = mesh.points.size();
    into_.resize(point_count);
    for (std::uint32_t v = 0; v < point_count; ++v) into_[v] = v;
    alive_.assign(mesh.faces.size(), 1);
    fan_.resize(point_count);
    for (std::uint32_t f = 0; f < mesh.faces.size(); ++f)
      for (const std::uint32_t v : mesh.faces[f]) fan_[v].push_back(f);
  }

  void run() {
    for (const Face& face : mesh_.faces)
      for (int i = 0; i < 3; ++i) push(face[i], face[(i + 1) % 3]);
    while (!queue_.empty()) {
      const auto [length, low, high] = queue_.top();
      queue_.pop();
      if (into_[low] != low || into_[high] != high) continue;
      if (length != edge_length(low, high)) continue;  // a point has moved: a newer entry exists
      if (may_collapse(low, high)) collapse(low, high);
    }
  }

  std::uint32_t survivor(std::uint32_t v) {
    while (into_[v] != v) v = into_[v] = into_[into_[v]];
    return v;
  }
  bool is_alive(std::uint32_t face) const { return alive_[face] != 0; }

 private:
  using Item = std::tuple<double, std::uint32_t, std::uint32_t>;

  double edge_length(std::uint32_t low, std::uint32_t high) const {
    return norm(mesh_.points[high] - mesh_.points[low]);
  }

  void push(std::uint32_t a, std::uint32_t b) {
    const std::uint32_t low = std::min(a, b), high = std::max(a, b);
    const double length = edge_length(low, high);
    if (length < shortest_) queue_.emplace(length, low, high);
  }

  void neighbours(std::uint32_t v, std::vector<std::uint32_t>& list) const {
    list.clear();
    for (const std::uint32_t f : fan_[v])
      for (const std::uint32_t w : mesh_.faces[f])
        if (w != v) list.push_back(w);
    std::sort(list.begin(), list.end());
  }

  // Link condition: the two vertices share exactly the neighbours that lie opposite in their two common
  // faces, each vertex lies inside one closed fan, and no remaining face turns over.
  bool may_collapse(std::uint32_t a, std::uint32_t b) {
    neighbours(a, ring_a_);
    neighbours(b, ring_b_);
    const auto is_closed_fan = [](const std::vector<std::uint32_t>& ring) {
      for (std::size_t i = 0; i < ring.size(); i += 2)  // sorted: each neighbour twice
        if (i + 1 == ring.size() || ring[i] != ring[i + 1] || (i + 2 < ring.size() && ring[i + 2] == ring[i]))
          return false;
      return true;
    };
    if (!is_closed_fan(ring_a_) || !is_closed_fan(ring_b_)) return false;
    ring_a_.erase(std::unique(ring_a_.begin(), ring_a_.end()), ring_a_.end());
    ring_b_.erase(std::unique(ring_b_.begin(), ring_b_.end()), ring_b_.end());
    common_.clear();
    std::set_intersection(ring_a_.begin(), ring_a_.end(), ring_b_.begin(), ring_b_.end(),
                          std::back_inserter(common_));
    if (common_.size() != 2 || ring_a_.size() + ring_b_.size() < 9) return false;
    const Vec3d middle = 0.5 * (mesh_.points[a] + mesh_.points[b]);
    return !flips(a, b, middle) && !flips(b, a, middle);
  }

  bool flips(std::uint32_t moved, std::uint32_t other, const Vec3d& target) const {
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
      if (!(norm(n1) > 0)) return true;
    }
    return false;
  }

  void collapse(std::uint32_t keep, std::uint32_t gone) {
    mesh_.points[keep] = 0.5 * (mesh_.points[keep] + mesh_.points[gone]);
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
    for (const std::uint32_t f : fan_[keep])
      for (const std::uint32_t v : mesh_.faces[f])
        if (v != keep) push(keep, v);
  }

  Triangles& mesh_;
  double shortest_;
  std::vector<std::uint32_t> into_;
  std::vector<std::uint8_t> alive_;
  std::vector<std::vector<std::uint32_t>> fan_;
  std::priority_queue<Item, std::vector<Item>, std::greater<>> queue_;
  std::vector<std::uint32_t> ring_a_, ring_b_, common_;
};

}  // namespace

WorkingMesh make_working_mesh(const Triangles& input, double shortest_edge, double longest_edge) {
  constexpr std::size_t kMaxNewFaces = 60'000;  // a mesh of long needles would otherwise grow without bound
  FineTriangles split = split_long_edges(input, longest_edge, input.faces.size() + kMaxNewFaces);
  const std::vector<Face> before = split.triangles.faces;
  Collapser collapser(split.triangles, shortest_edge);
  collapser.run();

  // Compact, keeping the order of faces.
  WorkingMesh working;
  std::vector<std::uint32_t> kept;
  for (std::uint32_t f = 0; f < before.size(); ++f)
    if (collapser.is_alive(f)) kept.push_back(f);
  std::vector<std::uint32_t> new_index(before.size(), 0xFFFFFFFF);
  for (std::uint32_t i = 0; i < kept.size(); ++i) new_index[kept[i]] = i;
  working.triangles = extract(split.triangles.points, split.triangles.faces, kept);

  // A face that collapsed is represented by the nearest of the faces around its vertices.
  std::vector<std::array<std::uint32_t, 2>> pairs;
  for (std::uint32_t f = 0; f < before.size(); ++f)
    if (collapser.is_alive(f))
      for (const std::uint32_t v : split.triangles.faces[f]) pairs.push_back({v, f});
  const Rows faces_at = group_rows(split.triangles.points.size(), pairs);
  const std::vector<Vec3d>& points = split.triangles.points;
  const auto centroid = [&](const Face& face) {
    const auto [a, b, c] = face;
    return (1.0 / 3.0) *
           (points[collapser.survivor(a)] + points[collapser.survivor(b)] + points[collapser.survivor(c)]);
  };
  working.faces_of_input.resize(input.faces.size());
  for (std::uint32_t f = 0; f < before.size(); ++f) {
    std::vector<std::uint32_t>& list = working.faces_of_input[split.source_face[f]];
    if (collapser.is_alive(f)) {
      list.push_back(new_index[f]);
      continue;
    }
    const Vec3d centre = centroid(before[f]);
    double nearest = -1;
    std::uint32_t best = 0;
    for (const std::uint32_t v : before[f])
      for (const std::uint32_t g : faces_at[collapser.survivor(v)]) {
        const Vec3d offset = centroid(split.triangles.faces[g]) - centre;
        if (nearest >= 0 && !(dot(offset, offset) < nearest)) continue;
        nearest = dot(offset, offset);
        best = new_index[g];
      }
    list.push_back(best);
  }
  return working;
}

}  // namespace sqmap::bake
