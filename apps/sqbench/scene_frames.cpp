// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene_frames.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "sqmap/runtime/body.hpp"
#include "sqmap/runtime/contact.hpp"
#include "sqmap/runtime/object.hpp"

#include "peer.hpp"
#include "pose_of.hpp"
#include "timing.hpp"
#include "work.hpp"

namespace sqmap::bench {
namespace {

constexpr double kSpacing = 1.75;      ///< of neighbours, in R_max: between them there is room for the probe
constexpr double kDeepEnough = 0.001;  ///< of R_max: which points must be found
constexpr double kMissed_percent = 2.5;  ///< of those

template <class T>
T value_of(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().finding);
  return std::move(result).value();
}

/// An object of the scene with all that is asked of it, in its own frame and with the probe in the size that
/// goes with it: lengths of all objects are scaled to one.
struct Standing {
  const Model& model;
  runtime::Object object;
  Probe probe;
  runtime::PointBody body;
  std::unique_ptr<Peer> grid, bricks;
  std::unique_ptr<ContactPeer> tree;
  std::vector<Placement> object_from_probe;  ///< in every frame of the scene
};

Vec3d middle_m(const Model& model) { return 0.5 * (model.low_m + model.high_m); }

std::size_t ask(const Standing& one, runtime::Layer layer, std::size_t item,
                std::vector<runtime::Contact>& contacts) {
  runtime::ContactQuery query;
  query.options.layer = layer;
  query.within_m = static_cast<float>(kBand * one.model.r_max_m());
  return one.object.contacts(one.body, {pose_of(one.object_from_probe[item]), 1}, contacts, query);
}

std::vector<Standing> stand(const SuiteInput& input, std::size_t count, std::size_t poses) {
  std::vector<Standing> scene;
  std::vector<Sequence> sequences;
  for (std::size_t k = 0; k < count; ++k) {
    const Model& model = input.models[k];
    Probe probe = scaled_probe(input.probe, model);
    sequences.push_back(make_sequence(model, probe, Contact::kTouching, poses));
    if (sequences.back().object_from_probe.size() != poses)
      throw std::runtime_error(model.name + " was not touched");
    auto body = value_of(runtime::PointBody::build(probe.cloud.points_m));
    auto tree = make_fcl(model, probe.mesh, FclTree::kObb, false);
    scene.push_back({model,
                     value_of(runtime::Object::build(model.asset)),
                     std::move(probe),
                     std::move(body),
                     make_grid(model, GridCode::kInt16SimdCulled, 128),
                     make_bricks(model, 128),
                     std::move(tree),
                     {}});
  }
  for (std::size_t touched = 0; touched < count; ++touched)
    for (const Placement& placement : sequences[touched].object_from_probe)
      for (std::size_t k = 0; k < count; ++k) {
        if (k == touched) {
          scene[k].object_from_probe.push_back(placement);
          continue;
        }
        const double apart = kSpacing * (static_cast<double>(k) - static_cast<double>(touched));
        const Model &here = scene[touched].model, &there = scene[k].model;
        const Vec3d from_middle =
            (1 / here.r_max_m()) * (cast<double>(placement.translation_m) - middle_m(here));
        scene[k].object_from_probe.push_back(
            {placement.rotation,
             cast<float>(middle_m(there) + there.r_max_m() * (from_middle - Vec3d{apart, 0, 0}))});
      }
  return scene;
}

/// What the exact meshes say of all frames, and how much of it each layer misses: with all objects asked, and
/// as a control with the touched one left out.
WorkRow check_scene(const std::vector<Standing>& scene, std::size_t poses, Results& results) {
  const std::size_t frames = scene.front().object_from_probe.size();
  std::size_t parts = 0;
  for (const Standing& one : scene) parts += one.model.asset.parts.size();
  WorkRow work{fmt::format("{} objects, {} parts", scene.size(), parts),
               "scene",
               frames,
               scene.front().probe.cloud.count,
               0,
               0,
               0,
               std::numeric_limits<double>::infinity()};
  constexpr runtime::Layer kLayers[] = {runtime::Layer::kTwo, runtime::Layer::kThree};
  std::size_t deep = 0, missed[2] = {}, missed_by_others[2] = {};
  std::vector<runtime::Contact> contacts(work.probe_points);
  for (std::size_t k = 0; k < scene.size(); ++k)
    for (std::size_t item = 0; item < frames; ++item) {
      const Standing& one = scene[k];
      std::vector<std::uint8_t> found[2];
      for (std::size_t l = 0; l < 2; ++l) {
        found[l].resize(one.probe.cloud.count);
        const std::size_t count = ask(one, kLayers[l], item, contacts);
        for (std::size_t c = 0; c < count; ++c)
          if (contacts[c].depth_m > 0) found[l][contacts[c].point] = 1;
      }
      for (std::size_t i = 0; i < one.probe.cloud.count; ++i) {
        const Vec3d p_m = cast<double>(one.object_from_probe[item].apply(one.probe.cloud.points_m[i]));
        const double percent = 100 * one.model.oracle->signed_distance(p_m) / one.model.r_max_m();
        work.nearest_percent = std::min(work.nearest_percent, percent);
        if (std::abs(percent) <= 100 * kBand) work.near_mean += 1;
        if (percent < 0) work.contacts_mean += 1;
        if (percent > -100 * kDeepEnough) continue;
        ++deep;
        for (std::size_t l = 0; l < 2; ++l) {
          if (found[l][i] == 0) ++missed[l];
          if (found[l][i] == 0 || k == item / poses) ++missed_by_others[l];
        }
      }
    }
  work.contacts_mean /= static_cast<double>(frames);
  work.near_mean /= static_cast<double>(frames);
  work.deepest_percent = std::max(0.0, -work.nearest_percent);
  for (std::size_t l = 0; l < 2; ++l)
    for (const bool is_control : {false, true}) {
      const double percent = 100 * static_cast<double>((is_control ? missed_by_others : missed)[l]) /
                             static_cast<double>(std::max<std::size_t>(deep, 1));
      results.checks.push_back(
          {work.model, l == 0 ? "sqmap-layer2" : "sqmap-layer3",
           is_control
               ? "the touched object left out breaks it: points inside an object of the scene that are "
                 "missed, percent"
               : "points inside an object of the scene that are missed, percent",
           percent, kMissed_percent, deep > 0 && (percent <= kMissed_percent) != is_control});
    }
  return work;
}

}  // namespace

void run_scene(const SuiteInput& input, Results& results) {
  const std::size_t count = std::min(input.models.size(), kSceneObjects);
  if (count < 2) return;
  input.note("frames: scene");
  const std::size_t poses = input.is_smoke ? 1 : 6;
  const std::vector<Standing> scene = stand(input, count, poses);
  const WorkRow work = check_scene(scene, poses, results);
  results.works.push_back(work);

  std::vector<runtime::Contact> contacts(work.probe_points);
  Hits hits(work.probe_points);
  const auto all = [&scene](auto ask_one) {
    return [&scene, ask_one](std::size_t item) {
      std::size_t found = 0;
      for (const Standing& one : scene) found += ask_one(one, item);
      return found;
    };
  };
  const auto layer = [&](runtime::Layer chosen) {
    return all(
        [&, chosen](const Standing& one, std::size_t item) { return ask(one, chosen, item, contacts); });
  };
  const auto field = [&](std::unique_ptr<Peer> Standing::*peer) {
    return all([&, peer](const Standing& one, std::size_t item) {
      (one.*peer)->answer(one.probe.cloud, one.object_from_probe[item], hits);
      return hits.count;
    });
  };
  constexpr std::size_t kGrid = 2;
  const std::vector<Contestant> contestants{{"sqmap-layer2", layer(runtime::Layer::kTwo)},
                                            {"sqmap-layer3", layer(runtime::Layer::kThree)},
                                            {kReference, field(&Standing::grid)},
                                            {kBricks, field(&Standing::bricks)},
                                            {kTreeReference, all([](const Standing& one, std::size_t item) {
                                               return one.tree->contacts(one.object_from_probe[item]);
                                             })}};
  const std::vector<Timing> timings = measure(contestants, work.poses, input.is_smoke ? 3 : 15);
  for (std::size_t c = 0; c < contestants.size(); ++c)
    results.frames.push_back({work.model, work.work, contestants[c].name, timings[c].answers_mean,
                              timings[c].spread(1e6), timings[c].ratio_to(timings[kGrid])});
}

}  // namespace sqmap::bench
