// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/effects/reaction.hpp"

#include <algorithm>

namespace sqmap::runtime {

std::span<const Parameter<Reaction>> Reaction::parameters() noexcept {
  static constexpr Parameter<Reaction> kTable[] = {
      {"stiffness_n_per_m", &Reaction::stiffness_n_per_m, 0, 1e6F}};
  return kTable;
}

void Reaction::touch(Touches& touches) noexcept {
  for (std::size_t i = 0; i < touches.contacts.size(); ++i) {
    const Contact& contact = touches.contacts[i];
    const float push_n = stiffness_n_per_m * std::max(contact.depth_m, 0.0F);
    touches.force_n[i] = touches.force_n[i] + push_n * contact.normal;
  }
}

}  // namespace sqmap::runtime
