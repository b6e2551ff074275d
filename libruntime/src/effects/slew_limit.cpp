// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/effects/slew_limit.hpp"

#include <cmath>

namespace sqmap::runtime {
namespace {

/// From `last` towards `wanted`, by at most `most`.
Vec3f approached(const Vec3f& last, const Vec3f& wanted, float most) noexcept {
  const Vec3f change = wanted - last;
  const float length = std::hypot(change.x, change.y, change.z);
  return length > most ? last + (most / length) * change : wanted;
}

}  // namespace

std::span<const Parameter<SlewLimit>> SlewLimit::parameters() noexcept {
  static constexpr Parameter<SlewLimit> kTable[] = {{"n_per_s", &SlewLimit::n_per_s, 0, 1e9F},
                                                    {"nm_per_s", &SlewLimit::nm_per_s, 0, 1e9F}};
  return kTable;
}

void SlewLimit::limit(float step_s, Wrench& wrench) noexcept {
  wrench.force_n = force_n_ = approached(force_n_, wrench.force_n, n_per_s * step_s);
  wrench.torque_nm = torque_nm_ = approached(torque_nm_, wrench.torque_nm, nm_per_s * step_s);
}

}  // namespace sqmap::runtime
