// SPDX-License-Identifier: GPL-3.0-or-later
#include "sqmap/bake/bake.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <sstream>

#include <tbb/parallel_for.h>

#include "sqmap/asset/version.hpp"
#include "sqmap/runtime/object.hpp"

#include "hull.hpp"
#include "long_edges.hpp"
#include "map_budget.hpp"
#include "map_builder.hpp"
#include "map_search.hpp"
#include "measure.hpp"
#include "mesh_order.hpp"
#include "part_builder.hpp"
#include "partition.hpp"
#include "refine.hpp"
#include "repair_steps.hpp"
#include "segment_limit.hpp"
#include "surface_bounds.hpp"

namespace sqmap::bake {

namespace {

// Added to the seed of the points that errors are measured at: not those that maps were chosen by.
constexpr std::uint64_t kMeasureSeed = 1000;
// Parts take whole triangles. So that long ones do not tie together what should be cut, edges are halved down
// to this share of R_max first, as far as the number of added triangles allows.
constexpr double kLongestEdge = 1.0 / 16;
constexpr std::size_t kMostAddedFaces = 20000;
// What the time is worth that one more part takes at run time.
constexpr double kPartTimeBytes = 1000;

// The runtime and the tree of closest points square lengths in float: a thousandth of this squared is still
// normal.
constexpr double kLeastSize_m = 1e-15;

/// Names the stages and keeps their wall times; one that begins again goes on.
class Stages {
 public:
  explicit Stages(const Progress& progress) : progress_(progress) {}
  void begin(const char* stage) {
    end();
    now_ = static_cast<std::size_t>(std::ranges::find(times, stage, &StageTime::stage) - times.begin());
    if (now_ == times.size()) times.push_back({stage, 0});
    start_ = std::chrono::steady_clock::now();
    progress_.at(stage, 0);
  }
  void end() {
    if (times.empty()) return;
    times[now_].seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }
  std::vector<StageTime> times;

 private:
  const Progress& progress_;
  std::size_t now_ = 0;
  std::chrono::steady_clock::time_point start_;
};

/// Largest distance between two vertices [m]. Exact up to 4,000 hull vertices; of more, those extreme in as
/// many directions are compared, which is short by less than 0.2 %.
double largest_vertex_distance(const Mesh& mesh) {
  constexpr std::size_t kMostCompared = 4000;
  std::vector<Vec3d> points_m = convex_hull(mesh.vertices_m).vertices;
  if (points_m.size() > kMostCompared) {
    std::vector<std::size_t> extreme(kMostCompared);
    tbb::parallel_for(std::size_t{0}, kMostCompared, [&](std::size_t k) {
      const double z = 1 - (2 * static_cast<double>(k) + 1) / kMostCompared;
      const double turn = 2 * std::numbers::pi * static_cast<double>(k) / std::numbers::phi;
      const double ring = std::sqrt(1 - z * z);
      const Vec3d direction{ring * std::cos(turn), ring * std::sin(turn), z};
      for (std::size_t i = 1; i < points_m.size(); ++i) {
        if (dot(direction, points_m[i]) > dot(direction, points_m[extreme[k]])) extreme[k] = i;
      }
    });
    std::sort(extreme.begin(), extreme.end());
    extreme.erase(std::unique(extreme.begin(), extreme.end()), extreme.end());
    std::vector<Vec3d> kept;
    for (const std::size_t k : extreme) kept.push_back(points_m[k]);
    points_m = std::move(kept);
  }
  double square = 0;
  for (std::size_t i = 0; i < points_m.size(); ++i) {
    for (std::size_t k = i + 1; k < points_m.size(); ++k) {
      const Vec3d d = points_m[i] - points_m[k];
      square = std::max(square, dot(d, d));
    }
  }
  return std::sqrt(square);
}

/// Parts by descending volume of their superquadrics' spheres would depend on ties; the centre decides them.
void sort_pieces(std::vector<Piece>& pieces) {
  std::sort(pieces.begin(), pieces.end(), [](const Piece& a, const Piece& b) {
    if (a.part.segment != b.part.segment) return a.part.segment < b.part.segment;
    if (a.part.volume_m3 != b.part.volume_m3) return a.part.volume_m3 > b.part.volume_m3;
    const Vec3d &u = a.part.sphere.centre_m, &v = b.part.sphere.centre_m;
    return std::tie(u.x, u.y, u.z) < std::tie(v.x, v.y, v.z);
  });
}

/// The mesh with long edges halved: what parts are made of. source_face numbers the faces of `mesh`.
Mesh fine_mesh(const Mesh& mesh, double longest_edge_m) {
  FineTriangles fine =
      split_long_edges({mesh.vertices_m, mesh.faces}, longest_edge_m, mesh.faces.size() + kMostAddedFaces);
  return {std::move(fine.triangles.points), std::move(fine.triangles.faces), std::move(fine.source_face)};
}

Decomposition on_fine_faces(Decomposition segments, const Mesh& fine) {
  std::vector<std::uint32_t> label(fine.faces.size());
  for (std::size_t f = 0; f < label.size(); ++f) label[f] = segments.label[fine.source_face[f]];
  segments.label = std::move(label);
  return segments;
}

/// Part of each face of the mesh: the one that holds most of its area.
std::vector<std::uint16_t> owners(const std::vector<Piece>& pieces, const Mesh& fine,
                                  std::size_t face_count) {
  struct Share {
    std::uint32_t face;
    std::uint16_t part;
    double area_m2;
  };
  std::vector<Share> shares;
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    for (const std::uint32_t f : pieces[k].cell.solid.face) {
      if (f == kNewFace) continue;
      shares.push_back({fine.source_face[f], static_cast<std::uint16_t>(k), area_m2(fine, f)});
    }
  }
  std::stable_sort(shares.begin(), shares.end(), [](const Share& a, const Share& b) {
    return std::tie(a.face, a.part) < std::tie(b.face, b.part);
  });
  std::vector<std::uint16_t> owner(face_count, kNoPart);
  std::vector<double> most(face_count, -1);
  for (std::size_t i = 0; i < shares.size();) {
    const Share& first = shares[i];
    double sum_m2 = 0;
    for (; i < shares.size() && shares[i].face == first.face && shares[i].part == first.part; ++i)
      sum_m2 += shares[i].area_m2;
    if (sum_m2 > most[first.face]) {
      most[first.face] = sum_m2;
      owner[first.face] = first.part;
    }
  }
  return owner;
}

/// Faces and vertices of the mesh that each part owns.
void count_members(std::vector<Part>& parts, const Mesh& mesh, const std::vector<std::uint16_t>& owner) {
  std::vector<std::vector<std::uint32_t>> vertices(parts.size());
  for (std::size_t f = 0; f < owner.size(); ++f) {
    if (owner[f] == kNoPart) continue;
    ++parts[owner[f]].face_count;
    vertices[owner[f]].insert(vertices[owner[f]].end(), mesh.faces[f].begin(), mesh.faces[f].end());
  }
  for (std::size_t k = 0; k < parts.size(); ++k) {
    std::sort(vertices[k].begin(), vertices[k].end());
    parts[k].vertex_count =
        static_cast<std::uint32_t>(std::unique(vertices[k].begin(), vertices[k].end()) - vertices[k].begin());
  }
}

/// Part of each face of the input; kNoPart for those that repair dropped.
std::vector<std::uint16_t> label_input_faces(const std::vector<std::uint16_t>& owner, const Mesh& mesh,
                                             std::uint32_t input_faces) {
  std::vector<std::uint16_t> labels(input_faces, kNoPart);
  for (std::size_t f = 0; f < owner.size(); ++f) {
    if (mesh.source_face[f] < input_faces) labels[mesh.source_face[f]] = owner[f];
  }
  return labels;
}

/// The asset with the quick fits, such as its partition was judged by. The full fits are smaller, but one in
/// many sees so little of the surface that no map of it meets the target.
Asset with_quick_fits(const Asset& asset, const std::vector<Piece>& pieces) {
  Asset quick = asset;
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    Part part = pieces[k].quick->part;
    part.vertex_count = asset.parts[k].vertex_count;
    part.face_count = asset.parts[k].face_count;
    quick.parts[k] = std::move(part);
  }
  return quick;
}

/// The shapes that each part of the asset may have, its own first.
std::vector<std::vector<PlacedShape>> shapes_of(const Asset& asset, const std::vector<Piece>& pieces) {
  std::vector<std::vector<PlacedShape>> shapes;
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    std::vector<PlacedShape>& of_part = shapes.emplace_back();
    of_part.push_back({asset.parts[k].shape, asset.parts[k].object_from_part});
    for (const FittedPart& other : pieces[k].others)
      of_part.push_back({other.part.shape, other.part.object_from_part});
  }
  return shapes;
}

/// The maps of the parts' first shapes; or of any, where those meet the target as well in fewer bytes. Uses
/// what is `traced`, and leaves there what was.
Result<Drawn> draw_smallest(Asset& asset, const std::vector<Piece>& pieces,
                            const std::vector<double>& areas_m2, const MeshQueries& queries,
                            const MapTarget& target, std::uint64_t seed, TracedShapes& traced) {
  const std::vector<std::vector<PlacedShape>> shapes = shapes_of(asset, pieces);
  MapDrawer drawer(shapes, areas_m2, queries, std::move(traced));
  auto drawn = draw_maps(asset, drawer, 1, queries, target, kSmallEnough, seed);
  traced = drawer.traced();
  const bool have_others =
      std::any_of(shapes.begin(), shapes.end(), [](const auto& s) { return s.size() > 1; });
  if (!drawn || !have_others) return drawn;
  Asset other = asset;
  // Tapers and bends are to save memory, but not at the price of what exactness small objects have.
  const std::size_t fewer = std::clamp(drawn.value().bytes, kSmallEnough / 2, kSmallEnough);
  auto redrawn = draw_maps(other, drawer, kAllShapes, queries, target, fewer, seed);
  traced = drawer.traced();
  if (!redrawn) return redrawn;
  const Drawn &rigid = drawn.value(), &formed = redrawn.value();
  const bool meets = formed.depth_in_aims <= std::max(rigid.depth_in_aims, kAtAims);
  // Where the budget decides, bytes are the same and errors differ.
  const bool gains = rigid.by_budget ? formed.depth_in_aims < rigid.depth_in_aims
                                     : !formed.by_budget && formed.bytes < rigid.bytes;
  if (!meets || !gains) return drawn;
  asset = std::move(other);
  return redrawn;
}

/// A partition with its maps.
struct DrawnPartition {
  Asset asset;
  std::vector<PartFit> fits;
  std::string stopped_by;
  Drawn drawn;

  bool may_be_smaller() const { return stopped_by == "target" && drawn.bytes > kSmallEnough; }
  double part_bytes() const { return kPartTimeBytes * static_cast<double>(asset.parts.size()); }
  /// Bytes, and those that more parts cost in time.
  double cost() const { return static_cast<double>(drawn.bytes) + part_bytes(); }
  /// Costs less, and errs no more than it may.
  bool is_better_than(const DrawnPartition& other) const {
    return stopped_by == "target" &&
           drawn.worst_in_aims() <= std::max(kAtAims, other.drawn.worst_in_aims()) && cost() < other.cost();
  }
};

/// What maps of a partition are drawn from.
struct PartitionDrawer {
  const Mesh& mesh;
  const Mesh& fine;  ///< what parts are made of
  const MeshQueries& queries;
  double r_max_m;
  std::uint32_t source_faces;
  const BakeOptions& options;
  TracedShapes traced;  ///< for the last partition: others have many of its parts

  /// Gives up where that takes more than it costs to keep `rival`, which meets its aims.
  Result<DrawnPartition> draw(Refinement refinement, const DrawnPartition* rival = nullptr) {
    std::vector<Piece>& pieces = refinement.pieces;
    sort_pieces(pieces);
    DrawnPartition result{{}, {}, std::move(refinement.stopped_by), {}};
    Asset& asset = result.asset;
    asset.r_max_m = r_max_m;
    for (const Piece& piece : pieces) {
      asset.parts.push_back(piece.part);
      result.fits.push_back(piece.fit);
    }
    const std::vector<std::uint16_t> owner = owners(pieces, fine, mesh.faces.size());
    count_members(asset.parts, mesh, owner);
    asset.face_labels = label_input_faces(owner, mesh, source_faces);
    MapTarget target{options.max_error_percent / 100 * r_max_m, options.max_bytes};
    if (rival != nullptr && rival->drawn.worst_in_aims() <= kAtAims)
      target.most_held = static_cast<std::size_t>(std::max(0.0, rival->cost() - result.part_bytes()));
    std::vector<double> areas_m2;
    for (const Piece& piece : pieces) areas_m2.push_back(piece.area_m2);
    auto drawn = draw_smallest(asset, pieces, areas_m2, queries, target, options.seed, traced);
    if (!drawn) return drawn.error();
    if (result.stopped_by == "target" && !drawn.value().by_budget && drawn.value().depth_in_aims > kAtAims &&
        drawn.value().bytes <= target.most_held) {
      Asset quick = with_quick_fits(asset, pieces);
      auto redrawn = draw_smallest(quick, pieces, areas_m2, queries, target, options.seed, traced);
      if (!redrawn) return redrawn.error();
      if (redrawn.value().depth_in_aims < drawn.value().depth_in_aims) {
        asset.parts = std::move(quick.parts);
        asset.sphere = quick.sphere;
        drawn = redrawn;
        for (std::size_t k = 0; k < pieces.size(); ++k) result.fits[k] = pieces[k].quick->fit;
      }
    }
    for (std::size_t k = 0; k < pieces.size(); ++k)
      for (const FittedPart& other : pieces[k].others)
        if (other.part.shape == asset.parts[k].shape) result.fits[k] = other.fit;
    // What the drafts foretold may be wrong.
    if (drawn.value().worst_in_aims() <= kAtAims) result.stopped_by = "target";
    if (drawn.value().by_budget) result.stopped_by = "bytes";
    result.drawn = drawn.value();
    return result;
  }
};

Provenance provenance(const SourceMesh& source, const BakeOptions& options) {
  static constexpr const char* kAxisNames[] = {"x", "y", "z"};
  return {"sqbake",
          kVersion,
          source.name,
          source.hash,
          options.to_json(),
          source.metres_per_unit,
          kAxisNames[static_cast<int>(source.up)]};
}

}  // namespace

Result<BakeResult> bake(const SourceMesh& source, const BakeOptions& asked, const Progress& progress) {
  if (auto outcome = asked.check(); !outcome) return outcome.error();
  const auto cancelled = [] { return Error{Status::kCancelled, "cancelled", ""}; };
  Stages stages(progress);

  stages.begin("repair");
  auto repaired = check_and_repair(source, asked.repair);
  if (!repaired) return repaired.error();
  PreparedMesh& prepared = repaired.value();
  prepared.mesh = in_own_order(prepared.mesh);
  prepared.component = label_components(prepared.mesh);

  stages.begin("index");
  const Oracle oracle(prepared.mesh);
  const RayTracer rays(prepared.mesh);
  const OpenPlaces open(prepared.mesh);
  const MeshQueries queries{prepared.mesh, rays, oracle, open};
  const double r_max_m = largest_vertex_distance(prepared.mesh);
  if (!(r_max_m >= kLeastSize_m)) {  // NaN: refuse
    std::ostringstream finding;
    finding << "the mesh is " << r_max_m << " m across, must be at least " << kLeastSize_m << " m";
    return Error{Status::kInvalidMesh, finding.str(), "give the unit that its coordinates are in"};
  }
  if (asked.conservative && !open.none()) {
    const MeshRecord& found = prepared.record;
    return Error{Status::kInvalidMesh,
                 "the surface is open or folded over (" + std::to_string(found.boundary_edges) +
                     " open edges, " + std::to_string(found.non_manifold_edges) +
                     " non-manifold): a conservative bake needs a closed one",
                 "close it, let --repair all do it, or bake without --conservative"};
  }
  BakeOptions options = asked;  // the target as a share of R_max, which is known only now
  if (asked.max_error_m > 0) options.max_error_percent = std::min(100.0, 100 * asked.max_error_m / r_max_m);
  if (progress.stop()) return cancelled();

  stages.begin("decompose");
  auto segments = decompose(prepared, options.decompose, progress);
  if (!segments) return segments.error();
  join_to_limit(prepared.mesh, options.max_parts, segments.value());

  stages.begin("refine");
  const Mesh fine = fine_mesh(prepared.mesh, kLongestEdge * r_max_m);
  const Decomposition fine_segments = on_fine_faces(std::move(segments).value(), fine);
  auto [set, whole] = SolidSet::whole(fine);
  PartitionSearch partitions(set, {fine, rays, oracle, open}, r_max_m, options);
  auto refined = partitions.best(close_segments(set, whole, fine_segments), progress);
  if (!refined) return refined.error();
  PartitionDrawer drawer{prepared.mesh, fine, queries, r_max_m, source.source_face_count, options, {}};
  stages.begin("map");
  auto baked = drawer.draw(std::move(refined).value());
  while (baked && baked.value().may_be_smaller()) {
    if (progress.stop()) return cancelled();
    stages.begin("refine");
    auto other = partitions.other(progress);
    if (!other) return other.error();
    if (!other.value()) break;
    stages.begin("map");
    auto redrawn = drawer.draw(std::move(*other.value()), &baked.value());
    if (!redrawn) return redrawn.error();
    if (redrawn.value().is_better_than(baked.value())) baked = std::move(redrawn);
  }
  if (!baked) return baked.error();
  BakeResult result;
  Asset& asset = result.asset;
  asset = std::move(baked.value().asset);
  result.fits = std::move(baked.value().fits);
  result.stopped_by = std::move(baked.value().stopped_by);
  asset.mesh = prepared.record;
  asset.provenance = provenance(source, asked);
  if (progress.stop()) return cancelled();

  if (options.conservative) {
    stages.begin("bounds");
    tbb::parallel_for(std::size_t{0}, asset.parts.size(), [&](std::size_t k) {
      Part& part = asset.parts[k];
      part.bounds = bound_surface(part, asset.sphere, queries, bound_cells(part, r_max_m));
    });
    if (progress.stop()) return cancelled();
  }

  stages.begin("measure");
  auto object = runtime::Object::build(asset);
  if (!object) return object.error();
  asset.errors = measure(asset, object.value(), queries, options.sample_count, options.seed + kMeasureSeed);
  stages.end();
  result.times = std::move(stages.times);
  return result;
}

}  // namespace sqmap::bake
