// SPDX-License-Identifier: Apache-2.0
#include "scene_effects.hpp"

#include <algorithm>
#include <string>
#include <string_view>

#include "sqmap/runtime/effects/force_limit.hpp"
#include "sqmap/runtime/effects/force_model.hpp"
#include "sqmap/runtime/effects/friction.hpp"
#include "sqmap/runtime/effects/impact_zones.hpp"
#include "sqmap/runtime/effects/passivity.hpp"
#include "sqmap/runtime/effects/reaction.hpp"
#include "sqmap/runtime/effects/slew_limit.hpp"
#include "sqmap/runtime/effects/smoothing.hpp"
#include "sqmap/runtime/effects/texture.hpp"
#include "sqmap/runtime/effects/torque.hpp"
#include "sqmap/runtime/effects/tracking.hpp"

namespace sqmap::runtime {
namespace {

template <class E>
concept KnowsZones = requires(E e, std::span<const std::uint32_t> zones) {
  e.set_zones(zones);
};

template <class E>
Outcome set_parameter([[maybe_unused]] E& effect, const std::string& name, [[maybe_unused]] float value) {
  std::string known;
  if constexpr (HasParameters<E>) {
    for (const Parameter<E>& p : E::parameters()) {
      if (name == p.name) {
        effect.*p.member = value;
        return Done{};
      }
      known += (known.empty() ? "" : ", ") + std::string(p.name);
    }
  }
  return Error{Status::kBadOption, std::string(E::kName) + "." + name + " is no parameter",
               known.empty() ? "this effect has none" : "the parameters are " + known};
}

template <class E>
Result<Stage> make_stage(const EffectChoice& choice, const Probe& probe) {
  auto owner = std::make_unique<E>();
  E& effect = *owner;
  for (const auto& [name, value] : choice.values)
    if (const Outcome ok = set_parameter(effect, name, value); !ok) return ok.error();
  if (const Outcome ok = check_parameters(effect); !ok) return ok.error();
  if constexpr (KnowsZones<E>) effect.set_zones(probe.zone);
  if constexpr (RemembersPoints<E>) effect.prepare(probe.points_m.size());

  Stage stage{{owner.release(), [](void* e) { delete static_cast<E*>(e); }}};
  if constexpr (ChangesTouches<E>)
    stage.touch = [](void* e, Touches& touches) noexcept { static_cast<E*>(e)->touch(touches); };
  if constexpr (AddsToTotal<E>)
    stage.sum = [](void* e, const Touches& touches, Wrench& wrench) noexcept {
      static_cast<E*>(e)->sum(touches, wrench);
    };
  if constexpr (LimitsTotal<E>)
    stage.limit = [](void* e, float step_s, Wrench& wrench) noexcept {
      static_cast<E*>(e)->limit(step_s, wrench);
    };
  stage.memory_bytes = sizeof(E);
  if constexpr (RemembersPoints<E>) stage.memory_bytes += effect.memory_bytes();
  return stage;
}

template <class E>
EffectInfo info() {
  EffectInfo result{E::kName, {}};
  if constexpr (HasParameters<E>) {
    const E initial;
    for (const Parameter<E>& p : E::parameters())
      result.parameters.push_back({p.name, p.least, p.most, initial.*p.member, p.is_whole});
  }
  return result;
}

struct Row {
  std::string_view name;
  Result<Stage> (*make)(const EffectChoice&, const Probe&);
  EffectInfo (*info)();
  std::string_view needs;  ///< an effect that must be named, too
};

template <class E>
constexpr Row row(std::string_view needs = {}) {
  return {E::kName, &make_stage<E>, &info<E>, needs};
}

/// In the order in which a frame runs them: contacts are corrected before forces are taken from them, and the
/// total is limited last.
constexpr Row kRows[] = {
    row<Smoothing>(),
    row<Tracking>(),
    row<Texture>("reaction"),
    row<Reaction>(),
    row<Friction>("reaction"),
    row<ImpactZones>("reaction"),
    row<Passivity>("reaction"),
    row<Torque>("reaction"),
    row<ForceLimit>("reaction"),
    row<SlewLimit>("reaction"),
};

Outcome check_choice(std::span<const EffectChoice> choices, const EffectChoice& choice) {
  const auto row = std::ranges::find(kRows, choice.name, &Row::name);
  if (row == std::end(kRows)) {
    std::string known;
    for (const Row& r : kRows) known += (known.empty() ? "" : ", ") + std::string(r.name);
    return Error{Status::kBadOption, "no effect is called \"" + choice.name + "\"",
                 "the effects are " + known};
  }
  if (std::ranges::count(choices, choice.name, &EffectChoice::name) > 1)
    return Error{Status::kBadOption, "effect \"" + choice.name + "\" is named twice", "name it once"};
  if (!row->needs.empty() && std::ranges::count(choices, row->needs, &EffectChoice::name) == 0)
    return Error{
        Status::kBadOption,
        "effect \"" + choice.name + "\" needs \"" + std::string(row->needs) + "\", which is not named",
        "name both or neither"};
  return Done{};
}

}  // namespace

std::vector<EffectInfo> effect_table() {
  std::vector<EffectInfo> table;
  for (const Row& row : kRows) table.push_back(row.info());
  return table;
}

Result<std::vector<Stage>> make_stages(std::span<const EffectChoice> choices, const Probe& probe) {
  for (const EffectChoice& choice : choices)
    if (const Outcome ok = check_choice(choices, choice); !ok) return ok.error();
  std::vector<Stage> stages;
  for (const Row& row : kRows) {
    const auto choice = std::ranges::find(choices, row.name, &EffectChoice::name);
    if (choice == choices.end()) continue;
    Result<Stage> stage = row.make(*choice, probe);
    if (!stage) return stage.error();
    stages.push_back(std::move(stage).value());
  }
  return stages;
}

}  // namespace sqmap::runtime
