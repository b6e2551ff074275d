// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/effects/friction.hpp"

#include <algorithm>
#include <cmath>

namespace sqmap::runtime {

std::span<const Parameter<Friction>> Friction::parameters() noexcept {
  static constexpr Parameter<Friction> kTable[] = {
      {"coefficient", &Friction::coefficient, 0, 10},
      {"depth_gain_per_m", &Friction::depth_gain_per_m, 0, 1e4F},
      {"bristle_n_per_m", &Friction::bristle_n_per_m, 0, 1e6F},
  };
  return kTable;
}

void Friction::prepare(std::size_t point_count) { bristles_.assign(point_count, {}); }

void Friction::touch(Touches& touches) noexcept {
  ++frame_;
  for (std::size_t i = 0; i < touches.contacts.size(); ++i) {
    const Contact& contact = touches.contacts[i];
    Bristle& bristle = bristles_[contact.point];
    Vec3f stretch_m;
    if (bristle.frame + 1 == frame_)
      stretch_m = bristle.stretch_m + (contact.position_m - bristle.position_m);
    stretch_m = stretch_m - dot(stretch_m, contact.normal) * contact.normal;
    const float load_n = std::max(dot(touches.force_n[i], contact.normal), 0.0F);
    const float most_n = coefficient * load_n * (1 + depth_gain_per_m * contact.depth_m);
    const float pull_n = bristle_n_per_m * norm(stretch_m);
    if (pull_n > most_n) stretch_m = (most_n / pull_n) * stretch_m;
    // What is not finite must not outlive its frame.
    if (!std::isfinite(dot(stretch_m, stretch_m))) stretch_m = {};
    bristle = {stretch_m, contact.position_m, frame_};
    touches.force_n[i] = touches.force_n[i] - bristle_n_per_m * stretch_m;
  }
}

}  // namespace sqmap::runtime
