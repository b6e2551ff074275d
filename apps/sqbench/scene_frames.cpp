// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene_frames.hpp"

#include <limits>
#include <memory>
#include <stdexcept>

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

constexpr double kSpacing = 1.1;  // of neighbours, in R_max: their spheres overlap, their surfaces do not

template <class T>
T value_of(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().finding);
  return std::move(result).value();
}

/// The probe where it touches one of the objects.
struct Touched {
  Probe probe;
  runtime::PointBody body;
  Sequence sequence;
  std::unique_ptr<Peer> grid;
};

/// The probe, placed against object `other` of the scene where it stands at `placement` against object
/// `touched`.
runtime::BodyPlacement placement_against(std::size_t other, double other_r_max_m, std::size_t touched,
                                         double touched_r_max_m, const Placement& placement) {
  const double apart = kSpacing * (static_cast<double>(other) - static_cast<double>(touched));
  runtime::BodyPlacement result{pose_of(placement), other_r_max_m / touched_r_max_m};
  Vec3d& t_m = result.object_from_body.translation_m;
  t_m = result.scale * (t_m - Vec3d{apart * touched_r_max_m, 0, 0});
  return result;
}

}  // namespace

void run_scene(const SuiteInput& input, Results& results) {
  if (input.models.size() < kSceneObjects) return;
  input.note("frames: scene");
  std::vector<runtime::Object> objects;
  std::vector<Touched> touched;
  std::size_t parts = 0;
  WorkRow work{"", "scene", 0, 0, 0, 0, 0, std::numeric_limits<double>::infinity()};
  const std::size_t poses = input.is_smoke ? 1 : 6;
  for (std::size_t k = 0; k < kSceneObjects; ++k) {
    const Model& model = input.models[k];
    objects.push_back(value_of(runtime::Object::build(model.asset)));
    parts += model.asset.parts.size();
    Probe probe = scaled_probe(input.probe, model);
    auto body = value_of(runtime::PointBody::build(probe.cloud.points_m));
    Sequence sequence = make_sequence(model, probe, Contact::kTouching, poses);
    if (sequence.object_from_probe.size() != poses) throw std::runtime_error(model.name + " was not touched");
    work.probe_points = probe.cloud.count;
    work.contacts_mean += sequence.contacts_mean / kSceneObjects;
    work.near_mean += sequence.near_mean / kSceneObjects;
    work.deepest_percent = std::max(work.deepest_percent, sequence.deepest_percent);
    work.nearest_percent = std::min(work.nearest_percent, sequence.nearest_percent);
    touched.push_back({std::move(probe), std::move(body), std::move(sequence),
                       make_grid(model, GridCode::kInt16Simd, 128)});
  }
  work.model = fmt::format("{} objects, {} parts", kSceneObjects, parts);
  work.poses = kSceneObjects * poses;
  results.works.push_back(work);

  std::vector<runtime::Contact> contacts(work.probe_points);
  const auto frame = [&](runtime::Layer layer, std::size_t item) {
    const std::size_t here = item / poses;
    const Placement& placement = touched[here].sequence.object_from_probe[item % poses];
    const double here_r_max_m = input.models[here].r_max_m();
    std::size_t found = 0;
    for (std::size_t k = 0; k < kSceneObjects; ++k) {
      const double r_max_m = input.models[k].r_max_m();
      runtime::ContactQuery query;
      query.options.layer = layer;
      query.within_m = static_cast<float>(kBand * r_max_m);
      found += objects[k].contacts(
          touched[here].body, placement_against(k, r_max_m, here, here_r_max_m, placement), contacts, query);
    }
    return found;
  };
  Hits hits(work.probe_points);
  std::vector<Contestant> contestants;
  for (const auto& [name, layer] :
       {std::pair{"sqmap-layer2", runtime::Layer::kTwo}, std::pair{"sqmap-layer3", runtime::Layer::kThree}})
    contestants.push_back({name, [&, chosen = layer](std::size_t item) { return frame(chosen, item); }});
  contestants.push_back({kReference, [&](std::size_t item) {
                           const Touched& one = touched[item / poses];
                           one.grid->answer(one.probe.cloud, one.sequence.object_from_probe[item % poses],
                                            hits);
                           return hits.count;
                         }});
  const std::vector<Timing> timings = measure(contestants, work.poses, input.is_smoke ? 3 : 15);
  for (std::size_t c = 0; c < contestants.size(); ++c)
    results.frames.push_back({work.model, work.work, contestants[c].name, timings[c].answers_mean,
                              timings[c].spread(1e6), timings[c].ratio_to(timings.back())});
}

}  // namespace sqmap::bench
