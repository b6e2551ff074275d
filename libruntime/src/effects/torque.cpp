// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/effects/torque.hpp"

namespace sqmap::runtime {

void Torque::sum(const Touches& touches, Wrench& wrench) noexcept {
  for (std::size_t i = 0; i < touches.contacts.size(); ++i) {
    const Vec3f arm_m = touches.contacts[i].position_m - touches.body.about_m;
    wrench.torque_nm = wrench.torque_nm + cross(arm_m, touches.force_n[i]);
  }
}

}  // namespace sqmap::runtime
