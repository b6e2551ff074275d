// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <unordered_map>
#include <utility>

#include "sqmap/bake/mesh.hpp"

#include "edge_table.hpp"
#include "repair_steps.hpp"

namespace sqmap::bake {
namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFF;
/// Side numbers, three a face, and the marks beside them must fit 32 bits.
constexpr std::size_t kMaxFaces = 1'000'000'000;

bool repeats_vertex(const Face& f) { return f[0] == f[1] || f[1] == f[2] || f[2] == f[0]; }

Outcome check(const SourceMesh& source, const RepairOptions& options) {
  if (!(options.weld_tolerance >= 0 && options.weld_tolerance <= 0.1))
    return Error{
        Status::kBadOption,
        "repair.weld_tolerance = " + std::to_string(options.weld_tolerance) + ", must be in [0, 0.1]", ""};
  const Mesh& mesh = source.mesh;
  const std::string name = "\"" + source.name + "\"";
  if (mesh.faces.size() > kMaxFaces)
    return Error{Status::kInvalidMesh,
                 name + " has " + std::to_string(mesh.faces.size()) + " triangles, the limit is 1e9",
                 "simplify the mesh"};
  if (mesh.source_face.size() != mesh.faces.size())
    return Error{Status::kInvalidMesh,
                 name + " has " + std::to_string(mesh.faces.size()) + " triangles and " +
                     std::to_string(mesh.source_face.size()) + " source faces, need as many",
                 "number the source face of every triangle"};
  for (std::size_t f = 0; f < mesh.faces.size(); ++f)
    for (const std::uint32_t v : mesh.faces[f]) {
      if (v >= mesh.vertices_m.size())
        return Error{Status::kInvalidMesh,
                     "triangle " + std::to_string(f) + " of " + name + ": vertex index " + std::to_string(v) +
                         ", must be below " + std::to_string(mesh.vertices_m.size()),
                     "export the mesh again"};
      const Vec3d& p_m = mesh.vertices_m[v];
      if (!std::isfinite(p_m.x) || !std::isfinite(p_m.y) || !std::isfinite(p_m.z))
        return Error{Status::kInvalidMesh,
                     "vertex " + std::to_string(v) + " of " + name + " has a coordinate that is not finite",
                     "remove the vertex, or export the mesh again"};
    }
  return Done{};
}

/// Drops the vertices no face uses.
void compact(Mesh& mesh) {
  std::vector<bool> used(mesh.vertices_m.size());
  for (const Face& face : mesh.faces)
    for (const std::uint32_t v : face) used[v] = true;
  std::vector<std::uint32_t> new_index(mesh.vertices_m.size());
  std::uint32_t count = 0;
  for (std::size_t v = 0; v < used.size(); ++v) {
    if (!used[v]) continue;
    mesh.vertices_m[count] = mesh.vertices_m[v];
    new_index[v] = count++;
  }
  mesh.vertices_m.resize(count);
  for (Face& face : mesh.faces)
    for (std::uint32_t& v : face) v = new_index[v];
}

/// Drops faces that name a vertex twice.
std::uint32_t drop_repeating(Mesh& mesh) {
  std::vector<bool> keep(mesh.faces.size());
  for (std::size_t f = 0; f < keep.size(); ++f) keep[f] = !repeats_vertex(mesh.faces[f]);
  return keep_faces(mesh, keep);
}

double signed_volume_m3(const Mesh& mesh, const Vec3d& about_m) {
  double six_volumes = 0;
  for (const auto& [a, b, c] : mesh.faces)
    six_volumes +=
        dot(mesh.vertices_m[a] - about_m, cross(mesh.vertices_m[b] - about_m, mesh.vertices_m[c] - about_m));
  return six_volumes / 6;
}

/// Vertices by the cell of a cubic grid they lie in. A point is near a cell's wall half of the time an axis
/// at most, so that a look-up visits three or four cells, not 27.
class Grid {
 public:
  Grid(const MeshScale& scale, double tolerance_m)
      : origin_m_(scale.centre_m),
        tolerance_m_(tolerance_m),
        // A tolerance of zero asks for equal points; cell numbers must still fit 64 bits.
        cell_m_(4 * std::max(tolerance_m, 1e-15 * scale.diagonal_m)) {}

  /// Calls visit(vertex) for the members of all cells that may hold a point within the tolerance of p.
  template <class Visit>
  void near(const Vec3d& p_m, const Visit& visit) const {
    const Vec3d reach{tolerance_m_, tolerance_m_, tolerance_m_};
    const Cell low = cell(p_m - reach), high = cell(p_m + reach);
    for (std::int64_t x = low[0]; x <= high[0]; ++x)
      for (std::int64_t y = low[1]; y <= high[1]; ++y)
        for (std::int64_t z = low[2]; z <= high[2]; ++z)
          if (const auto at = head_.find(Cell{x, y, z}); at != head_.end())
            for (std::uint32_t v = at->second; v != kNone; v = next_.at(v)) visit(v);
  }
  void add(const Vec3d& p_m, std::uint32_t vertex) {
    const auto [at, is_new] = head_.try_emplace(cell(p_m), kNone);
    if (next_.size() <= vertex) next_.resize(vertex + 1, kNone);
    next_[vertex] = std::exchange(at->second, vertex);
  }

 private:
  using Cell = std::array<std::int64_t, 3>;
  struct Hash {
    std::size_t operator()(const Cell& c) const {
      std::uint64_t h = 0;
      for (const std::int64_t i : c) {
        h = (h ^ static_cast<std::uint64_t>(i)) * 0x9E3779B97F4A7C15;  // 2^64 / golden ratio
        h ^= h >> 32;
      }
      return h;
    }
  };

  Cell cell(const Vec3d& p_m) const {
    Cell c{};
    for (int axis = 0; axis < 3; ++axis)
      c[static_cast<std::size_t>(axis)] =
          static_cast<std::int64_t>(std::floor((p_m[axis] - origin_m_[axis]) / cell_m_));
    return c;
  }

  Vec3d origin_m_;
  double tolerance_m_, cell_m_;
  std::unordered_map<Cell, std::uint32_t, Hash> head_;
  std::vector<std::uint32_t> next_;
};

}  // namespace

MeshScale measure_scale(const Mesh& mesh) {
  MeshScale scale;
  if (mesh.faces.empty()) return scale;
  Vec3d low = mesh.vertices_m[mesh.faces[0][0]], high = low;
  for (const Face& face : mesh.faces)
    for (const std::uint32_t v : face)
      for (int axis = 0; axis < 3; ++axis) {
        low[axis] = std::min(low[axis], mesh.vertices_m[v][axis]);
        high[axis] = std::max(high[axis], mesh.vertices_m[v][axis]);
      }
  scale.centre_m = 0.5 * low + 0.5 * high;
  scale.diagonal_m = std::hypot(high.x - low.x, high.y - low.y, high.z - low.z);
  // Collinear points leave a height of a few roundings: of the size of the mesh, or of its distance from
  // zero.
  const double farthest_m = std::max({std::abs(low.x), std::abs(low.y), std::abs(low.z), std::abs(high.x),
                                      std::abs(high.y), std::abs(high.z)});
  scale.zero_height_m =
      std::max(1e-12 * scale.diagonal_m, 8 * std::numeric_limits<double>::epsilon() * farthest_m);
  return scale;
}

bool has_no_area(const Mesh& mesh, const Face& face, const MeshScale& scale) {
  if (!(scale.diagonal_m > std::numeric_limits<double>::min())) return true;
  const double per_m = 1 / scale.diagonal_m;  // squares of lengths below 1e-154 would underflow
  const Vec3d &a = mesh.vertices_m[face[0]], &b = mesh.vertices_m[face[1]], &c = mesh.vertices_m[face[2]];
  const Vec3d ab = per_m * (b - a), bc = per_m * (c - b), ca = per_m * (a - c);
  const double longest = std::max({norm(ab), norm(bc), norm(ca)});
  return !(norm(cross(ab, ca)) > per_m * scale.zero_height_m * longest);
}

std::uint32_t keep_faces(Mesh& mesh, const std::vector<bool>& keep) {
  std::size_t kept = 0;
  for (std::size_t f = 0; f < keep.size(); ++f) {
    if (!keep[f]) continue;
    mesh.faces[kept] = mesh.faces[f];
    mesh.source_face[kept++] = mesh.source_face[f];
  }
  const auto dropped = static_cast<std::uint32_t>(mesh.faces.size() - kept);
  mesh.faces.resize(kept);
  mesh.source_face.resize(kept);
  return dropped;
}

std::uint32_t weld(Mesh& mesh, double tolerance_m) {
  if (mesh.vertices_m.empty()) return 0;
  Grid grid(measure_scale(mesh), tolerance_m);
  std::vector<std::uint32_t> kept(mesh.vertices_m.size());
  std::uint32_t welded = 0;
  for (std::uint32_t v = 0; v < kept.size(); ++v) {
    const Vec3d& p_m = mesh.vertices_m[v];
    kept[v] = v;
    grid.near(p_m, [&](std::uint32_t other) {
      const Vec3d d_m = mesh.vertices_m[other] - p_m;
      if (std::hypot(d_m.x, d_m.y, d_m.z) <= tolerance_m) kept[v] = std::min(kept[v], other);
    });
    if (kept[v] == v)
      grid.add(p_m, v);
    else
      ++welded;
  }
  for (Face& face : mesh.faces)
    for (std::uint32_t& v : face) v = kept[v];
  return welded;
}

Result<PreparedMesh> check_and_repair(const SourceMesh& source, const RepairOptions& options) {
  if (Outcome outcome = check(source, options); !outcome) return outcome.error();
  PreparedMesh prepared;
  Mesh& mesh = prepared.mesh = source.mesh;
  MeshRecord& record = prepared.record;
  record.source_vertices = static_cast<std::uint32_t>(mesh.vertices_m.size());
  record.source_faces = source.source_face_count;

  const MeshScale scale = measure_scale(mesh);
  if (std::ranges::all_of(mesh.faces, [&](const Face& face) { return has_no_area(mesh, face, scale); }))
    return Error{
        Status::kInvalidMesh,
        "\"" + source.name + "\" has no face with an area (" + std::to_string(mesh.faces.size()) + " faces)",
        "export a mesh whose faces are not points or lines"};

  compact(mesh);
  const bool is_safe = options.policy != Repair::kNone;
  if (is_safe) record.welded_vertices = weld(mesh, options.weld_tolerance * scale.diagonal_m);
  record.degenerate_faces = drop_repeating(mesh);
  if (is_safe) {
    record.duplicate_faces = drop_duplicates(mesh);
    record.flipped_faces = orient(mesh, scale);
    if (options.policy == Repair::kAll) record.filled_holes = fill_holes(mesh, scale, options.max_hole_edges);
    record.degenerate_faces += remove_zero_area(mesh, scale);
  } else {
    std::vector<bool> keep(mesh.faces.size());
    for (std::size_t f = 0; f < keep.size(); ++f) keep[f] = !has_no_area(mesh, mesh.faces[f], scale);
    record.degenerate_faces += keep_faces(mesh, keep);
  }
  compact(mesh);
  if (mesh.faces.empty())
    return Error{Status::kInvalidMesh, "\"" + source.name + "\" has no face left after repair",
                 "lower repair.weld_tolerance"};

  prepared.component = label_components(mesh);
  record.vertices = static_cast<std::uint32_t>(mesh.vertices_m.size());
  record.faces = static_cast<std::uint32_t>(mesh.faces.size());
  record.components = *std::ranges::max_element(prepared.component) + 1;
  EdgeTable(mesh.faces, mesh.vertices_m.size()).for_each_edge([&](std::span<const std::uint32_t> sides) {
    record.boundary_edges += sides.size() == 1;
    record.non_manifold_edges += sides.size() > 2;
  });
  record.is_closed = record.boundary_edges == 0 && record.non_manifold_edges == 0;
  record.volume_m3 = signed_volume_m3(mesh, scale.centre_m);
  return prepared;
}

}  // namespace sqmap::bake
