// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "sqmap/runtime/effects/touches.hpp"

namespace sqmap::runtime {

/// The hooks an effect may have.
template <class E>
concept ChangesTouches = requires(E e, Touches& touches) {
  e.touch(touches);
};
template <class E>
concept AddsToTotal = requires(E e, const Touches& touches, Wrench& wrench) {
  e.sum(touches, wrench);
};
template <class E>
concept LimitsTotal = requires(E e, Wrench& wrench) {
  e.limit(1e-3F, wrench);
};
template <class E>
concept RemembersPoints = requires(E e) {
  e.prepare(std::size_t{});
};

/// A force model composed at compile time: the effects run in the order they are written, which should be
///
///     Smoothing, Tracking, Texture, Reaction, Friction, ImpactZones, Passivity, Torque, ForceLimit,
///     SlewLimit
///
/// less what is not wanted. What is not named is not computed, not stored and not linked.
///
///     ForceModel model(Reaction{.stiffness_n_per_m = 800}, ForceLimit{});
///     if (auto ok = model.prepare(points.size()); !ok) ...
///     const Wrench wrench = model.frame({&instance}, {points_m});      // or, of a PointBody that moves,
///     const Wrench wrench = model.frame({&instance}, {.body = &body, .at = {world_from_body}});
///
/// One body against one instance; a frame allocates nothing. For several objects or effects chosen at run
/// time: Scene.
template <class... Effects>
class ForceModel {
 public:
  explicit ForceModel(Effects... effects) : effects_(std::move(effects)...) {}

  /// Checks the parameters and allocates for this many points. Errors: kBadOption.
  Outcome prepare(std::size_t point_count) {
    Outcome outcome = Done{};
    const auto one = [&](auto& effect) {
      if (!outcome) return;
      outcome = check_parameters(effect);
      if constexpr (RemembersPoints<std::remove_reference_t<decltype(effect)>>)
        if (outcome) effect.prepare(point_count);
    };
    std::apply([&](auto&... effect) { (one(effect), ...); }, effects_);
    contacts_.resize(point_count);
    force_n_.resize(point_count);
    return outcome;
  }

  /// Queries the points and returns the total force. prepare() was called with at least as many points.
  Wrench frame(const Field& field, const BodyState& body) noexcept {
    const Found found = find_touches(field, body, contacts_);
    Touches touches{field, body, std::span(contacts_).first(found.count),
                    std::span(force_n_).first(found.count)};
    const Wrench wrench = apply(touches);
    return found.is_finite ? wrench : Wrench{{}, {}, false, wrench.contacts};
  }

  /// The same for contacts found elsewhere; `touches.force_n` is overwritten.
  Wrench apply(Touches& touches) noexcept {
    for (Vec3f& force_n : touches.force_n) force_n = {};
    std::apply([&](auto&... effect) { (touch(effect, touches), ...); }, effects_);
    Wrench wrench = total(touches);
    std::apply([&](auto&... effect) { (sum(effect, touches, wrench), ...); }, effects_);
    wrench = finite_or_zero(wrench);
    std::apply([&](auto&... effect) { (limit(effect, touches.body.step_s, wrench), ...); }, effects_);
    return wrench;
  }

  template <class Effect>
  Effect& get() noexcept {
    return std::get<Effect>(effects_);
  }

 private:
  template <class Effect>
  static void touch(Effect& effect, Touches& touches) noexcept {
    if constexpr (ChangesTouches<Effect>) effect.touch(touches);
  }
  template <class Effect>
  static void sum(Effect& effect, const Touches& touches, Wrench& wrench) noexcept {
    if constexpr (AddsToTotal<Effect>) effect.sum(touches, wrench);
  }
  template <class Effect>
  static void limit(Effect& effect, float step_s, Wrench& wrench) noexcept {
    if constexpr (LimitsTotal<Effect>) effect.limit(step_s, wrench);
  }

  std::tuple<Effects...> effects_;
  std::vector<Contact> contacts_;
  std::vector<Vec3f> force_n_;
};

}  // namespace sqmap::runtime
