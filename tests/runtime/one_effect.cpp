// SPDX-License-Identifier: Apache-2.0
// The table of scene_effects.hpp as it would be if the reaction were the only effect there is; linked in its
// place.
#include "sqmap/runtime/effects/reaction.hpp"

#include "scene_effects.hpp"

namespace sqmap::runtime {

std::vector<EffectInfo> effect_table() { return {{Reaction::kName, {}}}; }

Result<std::vector<Stage>> make_stages(std::span<const EffectChoice> choices, const Probe&) {
  std::vector<Stage> stages;
  if (choices.empty()) return stages;
  if (choices.size() > 1 || choices[0].name != Reaction::kName) return Error{Status::kBadOption, "", ""};
  Stage stage{{new Reaction, [](void* e) { delete static_cast<Reaction*>(e); }}};
  stage.touch = [](void* e, Touches& touches) noexcept { static_cast<Reaction*>(e)->touch(touches); };
  stage.memory_bytes = sizeof(Reaction);
  stages.push_back(std::move(stage));
  return stages;
}

}  // namespace sqmap::runtime
