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
/// Areas differ by less than this share where a surface stays the same.
constexpr double kSameArea = 1e-3;
/// About as many neighbours a vertex has at most after others have moved into it.
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
      if (has_room(v, u) && keeps_area(v, u) && collapser_.may_move(u, v)) return u;
    return std::nullopt;
  }
  /// If v lies on a rim, leaves of ring_ the two beside it there where the rim is straight, else none.
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
  /// Not so where the surface is folded flat onto itself.
  bool keeps_area(std::uint32_t v, std::uint32_t into) const {
    double before = 0, after = 0;
    for (const std::uint32_t f : collapser_.faces_around(v)) {
      std::array<Vec3d, 3> p{};
      for (std::size_t i = 0; i < 3; ++i) p[i] = mesh_.points[mesh_.faces[f][i]];
      before += norm(cross(p[1] - p[0], p[2] - p[0]));
      for (std::size_t i = 0; i < 3; ++i)
        if (mesh_.faces[f][i] == v) p[i] = mesh_.points[into];
      after += norm(cross(p[1] - p[0], p[2] - p[0]));
    }
    return std::abs(after - before) <= kSameArea * before;
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

/// Distances are the same that differ by this share of the face they are measured from.
constexpr double kAsNear = 0.01;

/// What is left of a mesh after collapses, and where each of its faces went.
struct Collapsed {
  Triangles triangles;                      ///< faces in their old order
  std::vector<std::uint32_t> face_of_face;  ///< that each face was or became part of
};

Vec3d centroid(const Triangles& triangles, std::uint32_t face) {
  const auto& [a, b, c] = triangles.faces[face];
  return (1.0 / 3.0) * (triangles.points[a] + triangles.points[b] + triangles.points[c]);
}

double longest_side(const Triangles& triangles, std::uint32_t face) {
  const auto& [a, b, c] = triangles.faces[face];
  const Vec3d &p = triangles.points[a], &q = triangles.points[b], &r = triangles.points[c];
  return std::max({norm(q - p), norm(r - q), norm(p - r)});
}

double distance_to(const Vec3d& p, const Triangles& triangles, std::uint32_t face) {
  const auto& [a, b, c] = triangles.faces[face];
  return norm(nearest_of_triangle(p, {triangles.points[a], triangles.points[b], triangles.points[c]}) - p);
}

/// The one of `candidates`, faces of `triangles`, that is nearest to p. Of those that are as near but for
/// `tolerance`, as when p is nearest to an edge they share, the one with the nearest centroid.
std::uint32_t nearest_face(const Vec3d& p, double tolerance, const Triangles& triangles,
                           std::span<const std::uint32_t> candidates) {
  std::vector<double> distance;
  for (const std::uint32_t f : candidates) distance.push_back(distance_to(p, triangles, f));
  const double most = *std::min_element(distance.begin(), distance.end()) + tolerance;
  std::uint32_t best = candidates.front();
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (!(distance[i] <= most)) continue;
    const double to_centroid = norm(centroid(triangles, candidates[i]) - p);
    if (!(to_centroid < least)) continue;
    least = to_centroid;
    best = candidates[i];
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
  // A face that collapsed is represented by the nearest of the faces around its vertices, but for those of
  // hubs, which all faces around them would look through.
  constexpr std::size_t kHub = 4 * kMostNeighbours;
  const Rows faces_at = group_rows(after.points.size(), pairs);
  std::vector<std::uint32_t> corners, around;
  for (std::uint32_t f = 0; f < before.faces.size(); ++f) {
    std::uint32_t stands_for = f;
    if (!collapser.is_alive(f)) {
      corners.clear();
      for (const std::uint32_t v : before.faces[f]) corners.push_back(collapser.survivor(v));
      std::sort(corners.begin(), corners.end());
      corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
      around.clear();
      for (const bool with_hubs : {false, true})
        for (const std::uint32_t v : corners)
          if (around.empty() || !with_hubs)
            if (with_hubs || faces_at[v].size() <= kHub)
              around.insert(around.end(), faces_at[v].begin(), faces_at[v].end());
      stands_for = nearest_face(centroid(before, f), kAsNear * longest_side(before, f), after, around);
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

/// Pieces of one flat face, by where they lie along it.
class PiecesAlong {
 public:
  PiecesAlong(const Triangles& whole, std::uint32_t face, const Triangles& pieces,
              const std::vector<std::uint32_t>& faces)
      : pieces_(pieces) {
    const auto& [a, b, c] = whole.faces[face];
    const Vec3d &p = whole.points[a], &q = whole.points[b], &r = whole.points[c];
    for (const Vec3d& side : {q - p, r - q, p - r})
      if (dot(side, side) > dot(along_, along_)) along_ = side;
    along_ = normalized(along_);
    for (const std::uint32_t f : faces) {
      place_.emplace_back(dot(along_, centroid(pieces, f)), f);
      largest_ = std::max(largest_, longest_side(pieces, f));
    }
    std::sort(place_.begin(), place_.end());
  }

  /// Those with their centroid in a face of `inputs` that is a part of the whole; the nearest, if there is
  /// none.
  std::vector<std::uint32_t> of(const Triangles& inputs, std::uint32_t face) const {
    const Vec3d middle = centroid(inputs, face);
    const double size = longest_side(inputs, face), tolerance = kAsNear * size;
    std::vector<std::uint32_t> found = within(dot(along_, middle), size);
    std::erase_if(
        found, [&](std::uint32_t f) { return distance_to(centroid(pieces_, f), inputs, face) > tolerance; });
    if (!found.empty()) return found;
    std::vector<std::uint32_t> near = within(dot(along_, middle), 2 * largest_ + size);
    if (near.empty()) near = within(dot(along_, middle), std::numeric_limits<double>::infinity());
    return {nearest_face(middle, tolerance, pieces_, near)};
  }

 private:
  std::vector<std::uint32_t> within(double place, double reach) const {
    std::vector<std::uint32_t> found;
    auto it = std::lower_bound(place_.begin(), place_.end(), std::pair(place - reach, 0U));
    for (; it != place_.end() && it->first <= place + reach; ++it) found.push_back(it->second);
    return found;
  }

  const Triangles& pieces_;
  Vec3d along_;
  std::vector<std::pair<double, std::uint32_t>> place_;
  double largest_ = 0;
};

}  // namespace

WorkingMesh make_working_mesh(const Triangles& input, double shortest_edge, double longest_edge) {
  constexpr std::size_t kMaxNewFaces = 60'000;  // a mesh of long needles would otherwise grow without bound
  const Collapsed plain = without_plain_vertices(input);
  const FineTriangles split =
      split_long_edges(plain.triangles, longest_edge, input.faces.size() + kMaxNewFaces);
  Collapsed even = collapsed<ShortEdges>(split.triangles, shortest_edge);

  WorkingMesh working{std::move(even.triangles), std::vector<std::vector<std::uint32_t>>(input.faces.size())};
  const std::size_t plain_count = plain.triangles.faces.size();
  std::vector<std::vector<std::uint32_t>> splits(plain_count), inputs(plain_count);
  for (std::uint32_t f = 0; f < split.source_face.size(); ++f) splits[split.source_face[f]].push_back(f);
  for (std::uint32_t f = 0; f < input.faces.size(); ++f) inputs[plain.face_of_face[f]].push_back(f);
  tbb::parallel_for(std::size_t{0}, plain_count, [&](std::size_t p) {
    if (inputs[p].empty()) return;
    const PiecesAlong pieces(plain.triangles, static_cast<std::uint32_t>(p), split.triangles, splits[p]);
    for (const std::uint32_t f : inputs[p])
      for (const std::uint32_t g : inputs[p].size() == 1 ? splits[p] : pieces.of(input, f))
        working.faces_of_input[f].push_back(even.face_of_face[g]);
  });
  return working;
}

}  // namespace sqmap::bake
