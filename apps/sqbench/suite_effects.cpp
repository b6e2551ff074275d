// SPDX-License-Identifier: GPL-3.0-or-later
//
// What each thing that a frame may ask of the runtime adds to it.
#include <algorithm>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "sqmap/runtime/object.hpp"
#include "sqmap/runtime/scene.hpp"

#include "pose_of.hpp"
#include "suites.hpp"
#include "timing.hpp"
#include "work.hpp"

namespace sqmap::bench {
namespace {

struct Outputs {
  std::vector<float> distance_m;
  std::vector<Vec3f> normal, surface_m;
  std::vector<std::uint8_t> inside;
};

struct Variant {
  const char* name;
  runtime::QueryOptions options;
  bool wants_distance, wants_normal, wants_surface;
};

/// Frames of a scene with the reaction, and with each effect beside it. Lengths that are parameters grow with
/// the object.
void run_scenes(const SuiteInput& input, const Model& model, const Probe& probe, const Sequence& sequence,
                Results& results) {
  struct Timed {
    std::string name;
    runtime::Scene scene;
  };
  std::vector<Timed> scenes;
  const auto add = [&](const std::string& name, std::vector<runtime::EffectChoice> effects) {
    const runtime::SceneObject object{&model.asset, {}};
    auto scene = runtime::Scene::build({&object, 1}, {probe.cloud.points_m},
                                       {{runtime::Layer::kThree, 0, 0}, std::move(effects)});
    if (!scene) throw std::runtime_error(scene.error().finding);
    scenes.push_back({"scene, layer 3: " + name, std::move(scene).value()});
  };
  add("contacts", {});
  add("reaction", {{"reaction", {}}});
  for (const runtime::EffectInfo& effect : runtime::effect_table()) {
    const std::string name = effect.name;
    if (name == "reaction") continue;
    runtime::EffectChoice choice{name, {}};
    for (const auto& parameter : effect.parameters)
      if (const std::string length = parameter.name; length.ends_with("_m") && !length.ends_with("_per_m"))
        choice.values.emplace_back(length, std::clamp(parameter.initial * static_cast<float>(model.r_max_m()),
                                                      parameter.least, parameter.most));
    add("reaction, " + name, {{"reaction", {}}, choice});
  }
  std::vector<Contestant> contestants;
  for (Timed& timed : scenes)
    contestants.push_back(
        {timed.name, [&](std::size_t pose) -> std::size_t {
           return timed.scene.frame(pose_of(sequence.object_from_probe[pose]), {}, 1e-3F).inside;
         }});
  const std::vector<Timing> timings =
      measure(contestants, sequence.object_from_probe.size(), input.is_smoke ? 3 : 11);
  for (std::size_t i = 0; i < contestants.size(); ++i) {
    results.effects.push_back({model.name, contestants[i].name, timings[i].spread(1e6)});
    if (i > 0)
      results.checks.push_back(
          {model.name, contestants[i].name, "contacts a frame, as without the effect",
           timings[i].answers_mean, timings[0].answers_mean,
           timings[i].answers_mean == timings[0].answers_mean && timings[0].answers_mean > 0});
  }
}

}  // namespace

void run_effects(const SuiteInput& input, Results& results) {
  using runtime::Layer;
  for (const Model& model : input.models) {
    input.note(fmt::format("effects: {}", model.name));
    const auto object = runtime::Object::build(model.asset);
    if (!object) throw std::runtime_error(object.error().finding);
    const Probe probe = scaled_probe(input.probe, model);
    const Sequence sequence = make_sequence(model, probe, Contact::kTouching, input.is_smoke ? 2 : 12);
    std::vector<std::vector<Vec3f>> frames;
    for (const Placement& placement : sequence.object_from_probe) {
      auto& frame = frames.emplace_back();
      for (const Vec3f& p : probe.cloud.points_m) frame.push_back(placement.apply(p));
    }
    const auto edge_m = static_cast<float>(0.01 * model.r_max_m());
    const Variant variants[] = {
        {"layer 1: inside", {Layer::kOne, 0, 0}, false, false, false},
        {"layer 2: inside", {Layer::kTwo, 0, 0}, false, false, false},
        {"layer 2: distance", {Layer::kTwo, 0, 0}, true, false, false},
        {"layer 2: distance, normal", {Layer::kTwo, 0, 0}, true, true, false},
        {"layer 2: distance, normal, surface point", {Layer::kTwo, 0, 0}, true, true, true},
        {"layer 2: distance, normal, offset for edges", {Layer::kTwo, 0, edge_m}, true, true, false},
        {"layer 3: distance, normal", {Layer::kThree, 0, 0}, true, true, false},
        {"layer 3: distance, normal, offset for edges", {Layer::kThree, 0, edge_m}, true, true, false},
    };
    Outputs out;
    out.distance_m.resize(probe.cloud.count);
    out.normal.resize(probe.cloud.count);
    out.surface_m.resize(probe.cloud.count);
    out.inside.resize(probe.cloud.count);
    std::vector<Contestant> contestants;
    for (const Variant& variant : variants)
      contestants.push_back({variant.name, [&](std::size_t pose) {
                               runtime::Answers answers;
                               answers.inside = out.inside;
                               if (variant.wants_distance) answers.signed_distance_m = out.distance_m;
                               if (variant.wants_normal) answers.normal = out.normal;
                               if (variant.wants_surface) answers.surface_m = out.surface_m;
                               object.value().query(frames[pose], answers, variant.options);
                               return frames[pose].size();
                             }});
    const std::vector<Timing> timings = measure(contestants, frames.size(), input.is_smoke ? 3 : 11);
    for (std::size_t i = 0; i < contestants.size(); ++i)
      results.effects.push_back({model.name, contestants[i].name, timings[i].spread(1e6)});
    run_scenes(input, model, probe, sequence, results);
  }
}

}  // namespace sqmap::bench
