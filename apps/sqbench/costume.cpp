// SPDX-License-Identifier: GPL-3.0-or-later
#include "costume.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

#include "sqmap/runtime/body.hpp"
#include "sqmap/runtime/contact.hpp"
#include "sqmap/runtime/object.hpp"

#include "peer.hpp"
#include "peer_fcl_sheet.hpp"
#include "peer_rows.hpp"
#include "timing.hpp"
#include "work.hpp"

namespace sqmap::bench {
namespace {

constexpr double kSink = 0.005;  ///< of R_max: how deep the sheet sinks in, straight down
constexpr const char* kRebuiltTree = "fcl-obb-rebuilt-all-contacts";
constexpr double kPairsOff_percent = 2;  ///< pairs that touch within rounding

template <class T>
T value_of(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().finding);
  return std::move(result).value();
}

/// A square of `side` x `side` points over the object, and its places frame by frame.
struct Sheet {
  bake::Mesh mesh;                           ///< as in the first frame
  std::vector<std::vector<Vec3d>> places_m;  ///< rounded to float: all methods see the same points
};

Sheet falling_sheet(const Model& model, std::uint32_t side, std::size_t frames) {
  Sheet sheet;
  const bake::RayTracer tracer(model.mesh);
  const Vec3d size = model.high_m - model.low_m;
  const double above_m = model.high_m.z + size.z;
  std::vector<double> stop_m;  // how low each point may fall
  std::vector<bake::RayTracer::Hit> hits;
  for (std::uint32_t j = 0; j < side; ++j)
    for (std::uint32_t i = 0; i < side; ++i) {
      const auto at = [side](std::uint32_t k) { return 1.1 * (k / (side - 1.0) - 0.5) + 0.5; };
      const Vec3d from{model.low_m.x + at(i) * size.x, model.low_m.y + at(j) * size.y, above_m};
      tracer.trace(from, {0, 0, -1}, hits);
      stop_m.push_back(hits.empty() ? -std::numeric_limits<double>::infinity()
                                    : above_m - hits.front().t_m - kSink * model.r_max_m());
      sheet.mesh.vertices_m.push_back(from);
    }
  for (std::uint32_t j = 0; j + 1 < side; ++j)
    for (std::uint32_t i = 0; i + 1 < side; ++i) {
      const std::uint32_t a = j * side + i;
      sheet.mesh.faces.push_back({a, a + 1, a + side + 1});
      sheet.mesh.faces.push_back({a, a + side + 1, a + side});
    }
  sheet.mesh.source_face.assign(sheet.mesh.faces.size(), bake::kNewFace);
  for (std::size_t f = 0; f < frames; ++f) {
    const double share = (static_cast<double>(f) + 1) / static_cast<double>(frames);
    const double fall_m = model.high_m.z - share * size.z;
    std::vector<Vec3d> places = sheet.mesh.vertices_m;
    for (std::size_t k = 0; k < places.size(); ++k) {
      places[k].z = std::max(fall_m, stop_m[k]);
      places[k] = cast<double>(cast<float>(places[k]));
    }
    sheet.places_m.push_back(std::move(places));
  }
  sheet.mesh.vertices_m = sheet.places_m.front();
  return sheet;
}

WorkRow work_of(const Model& model, const Sheet& sheet) {
  WorkRow work{model.name,
               "costume",
               sheet.places_m.size(),
               sheet.mesh.vertices_m.size(),
               0,
               0,
               0,
               std::numeric_limits<double>::infinity()};
  for (const auto& places_m : sheet.places_m)
    for (const Vec3d& p_m : places_m) {
      const double percent = 100 * model.oracle->signed_distance(p_m) / model.r_max_m();
      const double share = 1 / static_cast<double>(sheet.places_m.size());
      if (percent < 0) work.contacts_mean += share;
      if (std::abs(percent) <= 100 * kBand) work.near_mean += share;
      work.nearest_percent = std::min(work.nearest_percent, percent);
    }
  work.deepest_percent = std::max(0.0, -work.nearest_percent);
  return work;
}

}  // namespace

void run_costume(const SuiteInput& input, const Model& model, Results& results) {
  input.note(fmt::format("frames: {}, costume", model.name));
  const Sheet sheet = falling_sheet(model, input.is_smoke ? 24 : 70, input.is_smoke ? 4 : 16);
  const std::size_t frames = sheet.places_m.size();
  results.works.push_back(work_of(model, sheet));

  std::vector<std::vector<Vec3f>> places_m(frames);
  for (std::size_t f = 0; f < frames; ++f)
    for (const Vec3d& p_m : sheet.places_m[f]) places_m[f].push_back(cast<float>(p_m));
  const runtime::Object object = value_of(runtime::Object::build(model.asset));
  runtime::PointBody body = value_of(runtime::PointBody::build(places_m.front()));
  std::vector<runtime::Contact> contacts(body.point_count());
  Cloud cloud(sheet.mesh.vertices_m);
  Hits hits(cloud.count);
  const auto grid = make_grid(model, GridCode::kInt16SimdCulled, 128), bricks = make_bricks(model, 128);
  const auto refitted = make_fcl_sheet(model, sheet.mesh, TreeUpdate::kRefit);
  std::vector<double> seconds;
  const auto rebuilt =
      make_timed([&] { return make_fcl_sheet(model, sheet.mesh, TreeUpdate::kRebuild); }, seconds);
  for (PeerRow tree : results.peers)
    if (tree.model == model.name && tree.peer == kTreeReference) {  // the object's side is the same
      tree.peer = kRebuiltTree;
      tree.build_s = spread_of(seconds);
      results.peers.push_back(std::move(tree));
      break;
    }

  std::vector<Contestant> contestants;
  for (const int layer : {1, 2, 3})
    contestants.push_back({fmt::format("sqmap-layer{}", layer), [&, layer](std::size_t f) {
                             body.refit(places_m[f]);
                             runtime::ContactQuery query;
                             query.options.layer = static_cast<runtime::Layer>(layer);
                             query.within_m = static_cast<float>(kBand * model.r_max_m());
                             return object.contacts(body, {}, contacts, query);
                           }});
  const auto add_field = [&](const char* name, const Peer& peer) {
    contestants.push_back({name, [&](std::size_t f) {
                             cloud.refit(places_m[f]);
                             peer.answer(cloud, {}, hits);
                             return hits.count;
                           }});
  };
  add_field(kReference, *grid);
  add_field(kBricks, *bricks);
  const auto plain_grid = make_grid(model, GridCode::kInt16Simd, 128);
  contestants.push_back({"grid-int16-128-simd", [&](std::size_t f) {  // needs no bounds of blocks
                           for (std::size_t i = 0; i < cloud.count; ++i) {
                             const Vec3f& p_m = places_m[f][cloud.source[i]];
                             cloud.x_m[i] = p_m.x;
                             cloud.y_m[i] = p_m.y;
                             cloud.z_m[i] = p_m.z;
                           }
                           plain_grid->answer(cloud, {}, hits);
                           return hits.count;
                         }});
  contestants.push_back(
      {kTreeReference, [&](std::size_t f) { return refitted->contacts(sheet.places_m[f]); }});
  contestants.push_back({kRebuiltTree, [&](std::size_t f) { return rebuilt->contacts(sheet.places_m[f]); }});

  bake::Mesh here = sheet.mesh;
  here.vertices_m = sheet.places_m[frames / 2];
  const auto expected = static_cast<double>(crossing_pairs(model, here, {}).size());
  for (const Contestant& contestant : {contestants[6], contestants[7]}) {
    const auto found = static_cast<double>(contestant.run(frames / 2));
    const double off = 100 * std::abs(found - expected) / std::max(expected, 1.0);
    results.checks.push_back({model.name, contestant.name,
                              "crossing pairs off the brute-force count, costume, percent", off,
                              kPairsOff_percent, off <= kPairsOff_percent && expected > 0});
  }
  const std::vector<Timing> timings = measure(contestants, frames, input.is_smoke ? 3 : 15);
  for (std::size_t c = 0; c < contestants.size(); ++c)
    results.frames.push_back({model.name, "costume", contestants[c].name, timings[c].answers_mean,
                              timings[c].spread(1e6), timings[c].ratio_to(timings[3])});
}

}  // namespace sqmap::bench
