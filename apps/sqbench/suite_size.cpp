// SPDX-License-Identifier: GPL-3.0-or-later
//
// What a touching frame costs as the object has more and more faces, and the probe more and more points. The
// object is one smooth shape, tessellated ever finer.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>

#include <fmt/format.h>

#include "baked.hpp"
#include "peer.hpp"
#include "peer_rows.hpp"
#include "suites.hpp"
#include "timing.hpp"
#include "work.hpp"

namespace sqmap::bench {
namespace {

/// A ball with three waves along each axis, from an icosahedron cut into 20 * 4^subdivisions faces.
bake::Mesh wavy_ball(unsigned subdivisions) {
  const double g = (1 + std::sqrt(5.0)) / 2;
  bake::Mesh mesh;
  mesh.vertices_m = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                     {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  mesh.faces = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (Vec3d& v : mesh.vertices_m) v = normalized(v);
  for (unsigned level = 0; level < subdivisions; ++level) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [place, is_new] = middles.try_emplace({std::min(a, b), std::max(a, b)},
                                                       static_cast<std::uint32_t>(mesh.vertices_m.size()));
      if (is_new) mesh.vertices_m.push_back(normalized(mesh.vertices_m[a] + mesh.vertices_m[b]));
      return place->second;
    };
    std::vector<std::array<std::uint32_t, 3>> finer;
    finer.reserve(4 * mesh.faces.size());
    for (const auto& [a, b, c] : mesh.faces) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    mesh.faces = std::move(finer);
  }
  for (Vec3d& v : mesh.vertices_m)
    v = (1 + 0.06 * (std::sin(6 * v.x) + std::sin(6 * v.y) + std::sin(6 * v.z))) * v;
  return mesh;
}

/// The methods of both.
std::vector<Entrant> entrants() {
  return {
      {"sqmap-layer2", "", [](const Model& model) { return make_sqmap(model, 2, 0); }},
      {"sqmap-layer3", "", [](const Model& model) { return make_sqmap(model, 3, 0); }},
      {kReference, "", [](const Model& model) { return make_grid(model, GridCode::kInt16SimdCulled, 128); }},
      {kBricks, "", [](const Model& model) { return make_bricks(model, 128); }},
      {"embree-closest", "", make_embree}};
}

/// One line a method, over several sizes.
class Curves {
 public:
  Curves(std::string figure, std::string model) : figure_(std::move(figure)), model_(std::move(model)) {}
  void add(const std::string& curve, double x, const Spread& time) {
    auto it =
        std::find_if(rows_.begin(), rows_.end(), [&](const CurveRow& row) { return row.curve == curve; });
    if (it == rows_.end()) it = rows_.insert(it, {figure_, model_, curve, {}, {}});
    it->add(x, time);
  }
  void move_to(Results& results) {
    for (CurveRow& row : rows_) results.curves.push_back(std::move(row));
  }

 private:
  std::string figure_, model_;
  std::vector<CurveRow> rows_;
};

void run_objects(const SuiteInput& input, Results& results) {
  Curves frames("objects", "wavy ball"), builds("objects-build", "wavy ball");
  for (const unsigned subdivisions : {3U, 4U, 5U, 6U, 7U, 8U}) {
    if (input.is_smoke && subdivisions > 4) break;
    const bake::Mesh mesh = wavy_ball(subdivisions);
    const auto faces = static_cast<double>(mesh.faces.size());
    input.note(fmt::format("size: object of {} faces", mesh.faces.size()));
    bake::BakeOptions options;
    if (input.is_smoke) options.max_error_percent = 1, options.sample_count = 2000;
    const auto add_build = [&](const std::string& name, const std::vector<double>& seconds) {
      builds.add(name, faces, spread_of(seconds));
    };
    std::vector<double> bake_s, tree_s;
    const Model model = make_timed([&] { return baked_model("wavy ball", mesh, options); }, bake_s);
    add_build("sqmap: bake", bake_s);
    const Probe probe = scaled_probe(input.probe, model);
    const Sequence sequence = make_sequence(model, probe, Contact::kTouching, input.is_smoke ? 2 : 6);

    std::vector<BuiltPeer> peers;
    for (const Entrant& entrant : entrants()) {
      std::vector<double> seconds;
      peers.push_back({entrant, build_timed(entrant, model, seconds)});
      if (!entrant.id.starts_with("sqmap")) add_build(entrant.id, seconds);  // ours is baked
    }
    const auto tree = make_timed([&] { return make_fcl(model, probe.mesh, FclTree::kObb, false); }, tree_s);
    add_build(kTreeReference, tree_s);

    Hits hits(probe.cloud.count);
    std::vector<Contestant> contestants;
    for (const BuiltPeer& built : peers)
      contestants.push_back({built.entrant.id, [&, one = built.peer.get()](std::size_t pose) {
                               one->answer(probe.cloud, sequence.object_from_probe[pose], hits);
                               return hits.count;
                             }});
    contestants.push_back(
        {kTreeReference, [&](std::size_t pose) { return tree->contacts(sequence.object_from_probe[pose]); }});
    const std::vector<Timing> timings =
        measure(contestants, sequence.object_from_probe.size(), input.is_smoke ? 3 : 9);
    for (std::size_t i = 0; i < contestants.size(); ++i)
      frames.add(contestants[i].name, faces, timings[i].spread(1e6));
  }
  frames.move_to(results);
  builds.move_to(results);
}

/// Points on the surface of the probe, uniform over its area.
std::vector<Vec3d> points_on(const bake::Mesh& mesh, std::size_t count) {
  std::mt19937_64 engine(kSeed);
  const auto uniform = [&] { return static_cast<double>(engine() >> 11) * 0x1.0p-53; };
  std::vector<double> area_to;
  double area = 0;
  for (const auto& [a, b, c] : mesh.faces) {
    area += norm(cross(mesh.vertices_m[b] - mesh.vertices_m[a], mesh.vertices_m[c] - mesh.vertices_m[a]));
    area_to.push_back(area);
  }
  std::vector<Vec3d> points;
  for (std::size_t i = 0; i < count; ++i) {
    const auto at = std::upper_bound(area_to.begin(), area_to.end(), area * uniform()) - area_to.begin();
    const auto& [a, b, c] =
        mesh.faces[std::min<std::size_t>(static_cast<std::size_t>(at), mesh.faces.size() - 1)];
    const double root = std::sqrt(uniform()), v = uniform();
    points.push_back((1 - root) * mesh.vertices_m[a] + root * (1 - v) * mesh.vertices_m[b] +
                     root * v * mesh.vertices_m[c]);
  }
  return points;
}

void run_probes(const SuiteInput& input, const Model& model, Results& results) {
  Curves frames("probes", model.name);
  const Probe probe = scaled_probe(input.probe, model);
  const Sequence sequence = make_sequence(model, probe, Contact::kTouching, input.is_smoke ? 2 : 6);
  std::vector<BuiltPeer> peers;
  for (const Entrant& entrant : entrants()) peers.push_back({entrant, entrant.build(model)});
  for (const std::size_t count : {100U, 1000U, 10000U, 100000U, 1000000U}) {
    if (input.is_smoke && count > 1000) break;
    input.note(fmt::format("size: probe of {} points", count));
    const Cloud cloud(points_on(probe.mesh, count));
    Hits hits(cloud.count);
    std::vector<Contestant> contestants;
    for (const BuiltPeer& built : peers)
      contestants.push_back({built.entrant.id, [&, one = built.peer.get()](std::size_t pose) {
                               one->answer(cloud, sequence.object_from_probe[pose], hits);
                               return hits.count;
                             }});
    const std::vector<Timing> timings = measure(contestants, sequence.object_from_probe.size(),
                                                input.is_smoke  ? 3
                                                : count > 10000 ? 5
                                                                : 9);
    for (std::size_t i = 0; i < contestants.size(); ++i)
      frames.add(contestants[i].name, static_cast<double>(count), timings[i].spread(1e6));
  }
  frames.move_to(results);
}

}  // namespace

void run_size(const SuiteInput& input, Results& results) {
  run_objects(input, results);
  if (!input.models.empty()) run_probes(input, input.models.front(), results);
}

}  // namespace sqmap::bench
