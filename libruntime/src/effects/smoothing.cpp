// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/effects/smoothing.hpp"

#include <algorithm>
#include <cmath>

namespace sqmap::runtime {

std::span<const Parameter<Smoothing>> Smoothing::parameters() noexcept {
  static constexpr Parameter<Smoothing> kTable[] = {{"radius_m", &Smoothing::radius_m, 0, 1e3F}};
  return kTable;
}

void Smoothing::touch(Touches& touches) noexcept {
  for (Contact& contact : touches.contacts) {
    if (!(contact.depth_m > 0)) continue;
    const float h = radius_m;
    float depth_m = contact.depth_m;
    Vec3f normal = contact.normal;
    for (const Vec3f& step_m : {Vec3f{h, 0, 0}, Vec3f{-h, 0, 0}, Vec3f{0, h, 0}, Vec3f{0, -h, 0},
                                Vec3f{0, 0, h}, Vec3f{0, 0, -h}}) {
      const Answer answer = touches.field.instance->query(contact.position_m + step_m, touches.field.options);
      const bool is_known = std::isfinite(answer.signed_distance_m);
      depth_m += is_known ? -answer.signed_distance_m : contact.depth_m;
      normal = normal + (is_known ? answer.normal : contact.normal);
    }
    contact.depth_m = std::max(depth_m / 7, 0.0F);
    const Vec3f unit = normalized(normal);
    if (dot(unit, unit) > 0) contact.normal = unit;  // normals that cancel: keep the contact's own
    contact.surface_m = contact.position_m + contact.depth_m * contact.normal;
  }
}

}  // namespace sqmap::runtime
