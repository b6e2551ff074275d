// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "repair_steps.hpp"

namespace sqmap::bake {
namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFF;

/// Loops up to this length are filled by the cubic search for the least area (2.8e6 triangles at most),
/// longer ones by a fan from their middle.
constexpr std::size_t kMaxSearchedLoop = 256;

/// A fill beyond this share of its component's area is not a hole's but closes the rim of a sheet or a bowl:
/// the disc over a hemisphere has 0.5 of it, that over a flat sheet 1.
constexpr double kRimShare = 0.6;

/// Vertices of each boundary loop in the direction a fill runs, against the faces. Loops that meet themselves
/// at a vertex are cut there; loops that end at a non-manifold edge are left out.
std::vector<std::vector<std::uint32_t>> boundary_loops(const Mesh& mesh,
                                                       const std::vector<std::uint32_t>& twin) {
  std::vector<bool> seen(twin.size());
  std::vector<std::vector<std::uint32_t>> loops;
  std::vector<std::size_t> place(mesh.vertices_m.size(), kNone);  // of a vertex in the current walk
  for (std::uint32_t start = 0; start < twin.size(); ++start) {
    if (twin[start] != EdgeTable::kBoundary || seen[start]) continue;
    std::vector<std::uint32_t> walk;
    std::uint32_t side = start;
    bool is_loop = true;
    std::vector<std::vector<std::uint32_t>> pieces;
    do {
      seen[side] = true;
      const std::uint32_t v = side_begin(mesh.faces, side);
      if (place[v] != kNone) {
        const auto from = walk.begin() + static_cast<std::ptrdiff_t>(place[v]);
        pieces.emplace_back(from, walk.end());
        for (auto at = from; at != walk.end(); ++at) place[*at] = kNone;
        walk.erase(from, walk.end());
      }
      place[v] = walk.size();
      walk.push_back(v);
      side = next_side(side);  // then round the vertex, face by face, to the next side without a neighbour
      while (twin[side] < EdgeTable::kBlocked) side = next_side(twin[side]);
      is_loop = twin[side] == EdgeTable::kBoundary && (side == start || !seen[side]);
    } while (is_loop && side != start);
    for (const std::uint32_t v : walk) place[v] = kNone;
    if (!is_loop) continue;
    pieces.push_back(std::move(walk));
    for (auto& piece : pieces) {
      std::ranges::reverse(piece);
      if (piece.size() >= 3) loops.push_back(std::move(piece));
    }
  }
  return loops;
}

class HoleFiller {
 public:
  HoleFiller(Mesh& mesh, const MeshScale& scale)
      : mesh_(mesh), scale_(scale), edges_(mesh.faces, mesh.vertices_m.size()) {}

  /// Triangles that close the loop; none when its fill would be no hole's.
  std::uint32_t fill(const std::vector<std::uint32_t>& loop, double component_area) {
    std::vector<Face> patch;
    if (loop.size() <= kMaxSearchedLoop) patch = least_area(loop);
    const bool has_middle = patch.empty();
    if (has_middle) patch = fan(loop);
    double fill_area = 0;
    for (const Face& face : patch) fill_area += area(face);
    if (fill_area > kRimShare * component_area) {
      if (has_middle) mesh_.vertices_m.pop_back();
      return 0;
    }
    for (const Face& face : patch) {
      mesh_.faces.push_back(face);
      mesh_.source_face.push_back(kNewFace);
      for (std::size_t k = 0; k < 3; ++k) new_edges_.insert(std::minmax(face[k], face[(k + 1) % 3]));
    }
    return 1;
  }

  /// In squares of the mesh's diagonal.
  double area(const Face& face) const {
    const double per_m = 1 / scale_.diagonal_m;
    const Vec3d& a = mesh_.vertices_m[face[0]];
    return 0.5 *
           norm(cross(per_m * (mesh_.vertices_m[face[1]] - a), per_m * (mesh_.vertices_m[face[2]] - a)));
  }

 private:
  bool has_edge(std::uint32_t a, std::uint32_t b) const {
    const auto vertex_count = static_cast<std::uint32_t>(mesh_.vertices_m.size());
    return (std::max(a, b) < vertex_count && edges_.has_edge(a, b)) || new_edges_.contains(std::minmax(a, b));
  }

  /// Barequet and Sharir 1995: the least area over the sub-chain i .. j is the least over the third corner k
  /// of the triangle on i j. An inner edge that the mesh already has is not allowed; empty when nothing is.
  /// Triangles between collinear corners are allowed: remove_zero_area turns them away.
  std::vector<Face> least_area(const std::vector<std::uint32_t>& loop) const {
    const std::size_t n = loop.size();
    constexpr double kForbidden = std::numeric_limits<double>::infinity();
    std::vector<double> cost(n * n, 0);
    std::vector<std::uint32_t> apex(n * n, kNone);
    for (std::size_t length = 2; length < n; ++length)
      for (std::size_t i = 0; i + length < n; ++i) {
        const std::size_t j = i + length;
        double& least = cost[i * n + j] = kForbidden;
        if (length < n - 1 && has_edge(loop[i], loop[j])) continue;
        for (std::size_t k = i + 1; k < j; ++k) {
          const double below = cost[i * n + k] + cost[k * n + j];
          if (!(below < least)) continue;
          const Face face{loop[i], loop[k], loop[j]};
          const double total = below + area(face);
          if (!(total < least)) continue;
          least = total;
          apex[i * n + j] = static_cast<std::uint32_t>(k);
        }
      }
    std::vector<Face> patch;
    if (cost[n - 1] == kForbidden) return patch;
    std::vector<std::pair<std::size_t, std::size_t>> open{{0, n - 1}};
    while (!open.empty()) {
      const auto [i, j] = open.back();
      open.pop_back();
      if (j - i < 2) continue;
      const std::size_t k = apex[i * n + j];
      patch.push_back({loop[i], loop[k], loop[j]});
      open.emplace_back(k, j);
      open.emplace_back(i, k);
    }
    return patch;
  }

  /// Adds the middle of the loop to the mesh.
  std::vector<Face> fan(const std::vector<std::uint32_t>& loop) {
    Vec3d sum;  // relative to a corner, which keeps the digits of a loop far from zero
    double length_sum = 0;
    const Vec3d origin_m = mesh_.vertices_m[loop[0]];
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Vec3d a = mesh_.vertices_m[loop[i]] - origin_m;
      const Vec3d b = mesh_.vertices_m[loop[(i + 1) % loop.size()]] - origin_m;
      sum = sum + norm(b - a) * (0.5 * (a + b));
      length_sum += norm(b - a);
    }
    const auto middle = static_cast<std::uint32_t>(mesh_.vertices_m.size());
    mesh_.vertices_m.push_back(origin_m + (length_sum > 0 ? 1 / length_sum : 0) * sum);
    std::vector<Face> patch;
    for (std::size_t i = 0; i < loop.size(); ++i)
      patch.push_back({loop[i], loop[(i + 1) % loop.size()], middle});
    return patch;
  }

  Mesh& mesh_;
  const MeshScale& scale_;
  EdgeTable edges_;
  std::set<std::pair<std::uint32_t, std::uint32_t>> new_edges_;
};

}  // namespace

std::uint32_t fill_holes(Mesh& mesh, const MeshScale& scale, std::uint32_t max_hole_edges) {
  const EdgeTable edges(mesh.faces, mesh.vertices_m.size());
  const auto loops = boundary_loops(mesh, edges.twins(mesh.faces));
  if (loops.empty()) return 0;

  HoleFiller filler(mesh, scale);
  const std::vector<std::uint32_t> component = label_components(mesh);
  std::vector<double> component_area(*std::ranges::max_element(component) + 1, 0);
  std::vector<std::uint32_t> component_of(mesh.vertices_m.size());
  for (std::size_t f = 0; f < component.size(); ++f) {
    component_area[component[f]] += filler.area(mesh.faces[f]);
    for (const std::uint32_t v : mesh.faces[f]) component_of[v] = component[f];
  }
  std::uint32_t filled = 0;
  for (const auto& loop : loops)
    if (loop.size() <= max_hole_edges) filled += filler.fill(loop, component_area[component_of[loop[0]]]);
  return filled;
}

}  // namespace sqmap::bake
