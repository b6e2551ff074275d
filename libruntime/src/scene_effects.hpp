// SPDX-License-Identifier: Apache-2.0
//
// The table of effects that scenes pick from by name. A new effect is one line of kRows in the source.
#pragma once

#include <memory>
#include <vector>

#include "sqmap/runtime/scene.hpp"

namespace sqmap::runtime {

/// An effect of a scene: its parameters and memory, and the hooks that it has (the others are null). One call
/// an effect and frame, not a contact.
struct Stage {
  std::unique_ptr<void, void (*)(void*)> effect;
  void (*touch)(void*, Touches&) noexcept = nullptr;
  void (*sum)(void*, const Touches&, Wrench&) noexcept = nullptr;
  void (*limit)(void*, float, Wrench&) noexcept = nullptr;
  std::size_t memory_bytes{};
};

/// The stages of the effects that are named, in the order of a frame, made anew for a probe.
/// Errors: kBadOption.
Result<std::vector<Stage>> make_stages(std::span<const EffectChoice> choices, const Probe& probe);

}  // namespace sqmap::runtime
