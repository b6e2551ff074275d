// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/force.hpp"

namespace sqmap::runtime {

float penetration_m(const Answer& answer) noexcept {
  return answer.signed_distance_m < 0 ? -answer.signed_distance_m : 0;  // NaN: no contact
}

Vec3f reaction_force(const Answer& answer, float stiffness_n_per_m) noexcept {
  return (stiffness_n_per_m * penetration_m(answer)) * answer.normal;
}

}  // namespace sqmap::runtime
