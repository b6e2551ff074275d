// SPDX-License-Identifier: GPL-3.0-or-later
#include "working_mesh.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <optional>
#include <queue>
#include <span>
#include <tuple>
#include <utility>

#include <tbb/parallel_for.h>

#include "edge_collapser.hpp"
#include "long_edges.hpp"
#include "mesh_order.hpp"
#include "nearest_of_triangle.hpp"

namespace sqmap::bake {
namespace {

using Face = std::array<std::uint32_t, 3>;

/// Sines of slopes at which a vertex may lie off the planes around it and still carry no shape: what the
/// rounding of coordinates to float, or to six digits, tilts short edges by. The exact ones go first: others
/// tilt the planes in which those lie.
constexpr std::array kPlainSlopes{1e-5, 3e-4};
/// No vertex has more neighbours after others have moved into it.
constexpr std::size_t kMostNeighbours = 64;

/// Contracts edges shorter than a length to their midpoints, the shortest first.
class ShortEdges {
 public:
  ShortEdges(Triangles& mesh, EdgeCollapser& collapser, double shortest_edge)
      : mesh_(mesh), collapser_(collapser), shortest_(shortest_edge) {}

  void collapse_all() {
    for (const Face& face : mesh_.faces)
      for (int i = 0; i < 3; ++i) push(face[i], face[(i + 1) % 3]);
    while (!queue_.empty()) {
      const auto [length, low, high] = queue_.top();
      queue_.pop();
      if (!collapser_.is_vertex(low) || !collapser_.is_vertex(high)) continue;
      if (length != edge_length(low, high)) continue;  // a point has moved: a newer entry exists
      const Vec3d middle = 0.5 * (mesh_.points[low] + mesh_.points[high]);
      if (!collapser_.may_collapse(low, high, middle, 5)) continue;
      collapser_.collapse(low, high, middle);
      for (const std::uint32_t f : collapser_.faces_around(low))
        for (const std::uint32_t v : mesh_.faces[f])
          if (v != low) push(low, v);
    }
  }

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

  Triangles& mesh_;
  EdgeCollapser& collapser_;
  double shortest_;
  std::priority_queue<Item, std::vector<Item>, std::greater<>> queue_;
};

/// Moves vertices that carry no shape into a neighbour.
class PlainVertices {
 public:
  PlainVertices(Triangles& mesh, EdgeCollapser& collapser, double slope)
      : mesh_(mesh), collapser_(collapser), slope_(slope) {}

  void collapse_all() {
    std::vector<std::uint8_t> may_be_plain(mesh_.points.size(), 1);
    for (bool changed = true; changed;) {
      changed = false;
      for (std::uint32_t v = 0; v < may_be_plain.size(); ++v) {
        if (may_be_plain[v] == 0) continue;
        may_be_plain[v] = 0;
        const std::optional<std::uint32_t> into = neighbour_for(v);
        if (!into) continue;
        collapser_.collapse(*into, v, mesh_.points[*into]);
        for (const std::uint32_t f : collapser_.faces_around(*into))
          for (const std::uint32_t w : mesh_.faces[f]) may_be_plain[w] = 1;
        changed = true;
      }
    }
  }

 private:
  /// The nearest neighbour that v can be moved into without a change of the surface; nothing where v carries
  /// shape, or that would have too many neighbours.
  std::optional<std::uint32_t> neighbour_for(std::uint32_t v) {
    normals_.clear();
    ring_.clear();
    if (collapser_.faces_around(v).size() > kMostNeighbours) return std::nullopt;
    for (const std::uint32_t f : collapser_.faces_around(v)) {
      const auto& [a, b, c] = mesh_.faces[f];
      normals_.push_back(
          normalized(cross(mesh_.points[b] - mesh_.points[a], mesh_.points[c] - mesh_.points[a])));
      for (const std::uint32_t w : mesh_.faces[f])
        if (w != v) ring_.push_back(w);
    }
    std::sort(ring_.begin(), ring_.end());
    keep_ends_of_straight_rim(v);
    ring_.erase(std::unique(ring_.begin(), ring_.end()), ring_.end());
    const auto lies_in_all_planes = [&](std::uint32_t u) {
      const Vec3d way = mesh_.points[u] - mesh_.points[v];
      const double most = slope_ * norm(way);
      return std::all_of(normals_.begin(), normals_.end(),
                         [&](const Vec3d& n) { return std::abs(dot(n, way)) <= most; });
    };
    std::erase_if(ring_, [&](std::uint32_t u) { return !lies_in_all_planes(u); });
    const auto distance = [&](std::uint32_t u) { return norm(mesh_.points[u] - mesh_.points[v]); };
    std::sort(ring_.begin(), ring_.end(), [&](std::uint32_t a, std::uint32_t b) {
      return std::pair(distance(a), a) < std::pair(distance(b), b);
    });
    for (const std::uint32_t u : ring_)
      if (has_room(v, u) && collapser_.may_move(v, u)) return u;
    return std::nullopt;
  }
  /// Of ring_, if v lies on a rim: those who do, one face each, where the rim is straight; else none.
  void keep_ends_of_straight_rim(std::uint32_t v) {
    std::vector<std::uint32_t> ends;
    for (const std::uint32_t w : ring_)
      if (std::count(ring_.begin(), ring_.end(), w) == 1) ends.push_back(w);
    if (ends.empty()) return;
    ring_.clear();
    if (ends.size() != 2) return;
    const Vec3d a = mesh_.points[ends[0]] - mesh_.points[v], b = mesh_.points[ends[1]] - mesh_.points[v];
    if (dot(a, b) < 0 && norm(cross(a, b)) <= slope_ * norm(a) * norm(b)) ring_ = ends;
  }
  bool has_room(std::uint32_t v, std::uint32_t into) const {
    return collapser_.faces_around(v).size() + collapser_.faces_around(into).size() <= kMostNeighbours + 4;
  }

  Triangles& mesh_;
  EdgeCollapser& collapser_;
  double slope_;
  std::vector<Vec3d> normals_;
  std::vector<std::uint32_t> ring_;
};

/// What is left of a mesh after collapses, and where each of its faces went.
struct Collapsed {
  Triangles triangles;                      ///< faces in their old order
  std::vector<std::uint32_t> face_of_face;  ///< that each face was or became part of
};

Vec3d centroid(const Triangles& triangles, std::uint32_t face) {
  const auto& [a, b, c] = triangles.faces[face];
  return (1.0 / 3.0) * (triangles.points[a] + triangles.points[b] + triangles.points[c]);
}

/// The one of `candidates`, faces of `triangles`, that is nearest to p. Where p is nearest to an edge they
/// share, to both alike, their centroids decide.
std::uint32_t nearest_face(const Vec3d& p, const Triangles& triangles,
                           std::span<const std::uint32_t> candidates) {
  constexpr double kCentroidShare = 0.01;
  std::uint32_t best = candidates.front();
  double least = std::numeric_limits<double>::infinity();
  for (const std::uint32_t f : candidates) {
    const auto& [a, b, c] = triangles.faces[f];
    const Vec3d q = nearest_of_triangle(p, {triangles.points[a], triangles.points[b], triangles.points[c]});
    const double distance = norm(q - p) + kCentroidShare * norm(centroid(triangles, f) - p);
    if (!(distance < least)) continue;
    least = distance;
    best = f;
  }
  return best;
}

Collapsed compacted(const Triangles& before, const Triangles& after, EdgeCollapser& collapser) {
  std::vector<std::uint32_t> kept, place(after.faces.size());
  std::vector<std::array<std::uint32_t, 2>> pairs;
  for (std::uint32_t f = 0; f < after.faces.size(); ++f) {
    if (!collapser.is_alive(f)) continue;
    for (const std::uint32_t v : after.faces[f]) pairs.push_back({v, f});
    place[f] = static_cast<std::uint32_t>(kept.size());
    kept.push_back(f);
  }
  Collapsed result{extract(after.points, after.faces, kept), std::vector<std::uint32_t>(before.faces.size())};
  // A face that collapsed is represented by the nearest of the faces around its vertices.
  const Rows faces_at = group_rows(after.points.size(), pairs);
  std::vector<std::uint32_t> around;
  for (std::uint32_t f = 0; f < before.faces.size(); ++f) {
    std::uint32_t stands_for = f;
    if (!collapser.is_alive(f)) {
      around.clear();
      for (const std::uint32_t v : before.faces[f]) {
        const auto faces = faces_at[collapser.survivor(v)];
        around.insert(around.end(), faces.begin(), faces.end());
      }
      stands_for = around.empty() ? kept.front() : nearest_face(centroid(before, f), after, around);
    }
    result.face_of_face[f] = place[stands_for];
  }
  return result;
}

/// `Edges`: what decides on collapses.
template <class Edges, class... Limits>
Collapsed collapsed(const Triangles& input, Limits... limits) {
  Triangles mesh = input;
  EdgeCollapser collapser(mesh);
  Edges(mesh, collapser, limits...).collapse_all();
  return compacted(input, mesh, collapser);
}

/// The input without vertices that carry no shape, in an order that forgets that they were there.
Collapsed without_plain_vertices(const Triangles& input) {
  Collapsed result{input, std::vector<std::uint32_t>(input.faces.size())};
  std::iota(result.face_of_face.begin(), result.face_of_face.end(), 0U);
  for (const double slope : kPlainSlopes) {
    Collapsed next = collapsed<PlainVertices>(result.triangles, slope);
    Mesh mesh{std::move(next.triangles.points), std::move(next.triangles.faces), {}};
    mesh.source_face.resize(mesh.faces.size());
    std::iota(mesh.source_face.begin(), mesh.source_face.end(), 0U);
    const std::vector<std::uint32_t> all = mesh.source_face;
    mesh = in_own_order(mesh);
    result.triangles = extract(mesh.vertices_m, mesh.faces, all);
    std::vector<std::uint32_t> place(all.size());
    for (const std::uint32_t f : all) place[mesh.source_face[f]] = f;
    for (std::uint32_t& face : result.face_of_face) face = place[next.face_of_face[face]];
  }
  return result;
}

}  // namespace

WorkingMesh make_working_mesh(const Triangles& input, double shortest_edge, double longest_edge) {
  constexpr std::size_t kMaxNewFaces = 60'000;  // a mesh of long needles would otherwise grow without bound
  const Collapsed plain = without_plain_vertices(input);
  const FineTriangles split =
      split_long_edges(plain.triangles, longest_edge, input.faces.size() + kMaxNewFaces);
  Collapsed even = collapsed<ShortEdges>(split.triangles, shortest_edge);

  WorkingMesh working{std::move(even.triangles), std::vector<std::vector<std::uint32_t>>(input.faces.size())};
  std::vector<std::vector<std::uint32_t>> split_of_plain(plain.triangles.faces.size());
  for (std::uint32_t f = 0; f < split.source_face.size(); ++f)
    split_of_plain[split.source_face[f]].push_back(f);
  std::vector<std::uint32_t> inputs_of_plain(split_of_plain.size());
  for (const std::uint32_t face : plain.face_of_face) ++inputs_of_plain[face];
  tbb::parallel_for(std::size_t{0}, input.faces.size(), [&](std::size_t f) {
    const std::uint32_t face = plain.face_of_face[f];
    const std::vector<std::uint32_t>& faces = split_of_plain[face];
    std::vector<std::uint32_t>& list = working.faces_of_input[f];
    if (inputs_of_plain[face] == 1) {
      for (const std::uint32_t g : faces) list.push_back(even.face_of_face[g]);
    } else {  // it is a part of that face
      const Vec3d middle = centroid(input, static_cast<std::uint32_t>(f));
      list.push_back(even.face_of_face[nearest_face(middle, split.triangles, faces)]);
    }
  });
  return working;
}

}  // namespace sqmap::bake
