// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/effects/force_limit.hpp"

#include <algorithm>
#include <cmath>

namespace sqmap::runtime {
namespace {

/// |v| without overflow of its square.
float length(const Vec3f& v) noexcept { return std::hypot(v.x, v.y, v.z); }

}  // namespace

std::span<const Parameter<ForceLimit>> ForceLimit::parameters() noexcept {
  static constexpr Parameter<ForceLimit> kTable[] = {{"most_n", &ForceLimit::most_n, 0, 1e6F},
                                                     {"most_nm", &ForceLimit::most_nm, 0, 1e6F}};
  return kTable;
}

void ForceLimit::limit(float /*step_s*/, Wrench& wrench) noexcept {
  float scale = 1;
  if (const float force_n = length(wrench.force_n); force_n > most_n) scale = most_n / force_n;
  if (const float torque_nm = length(wrench.torque_nm); torque_nm > most_nm)
    scale = std::min(scale, most_nm / torque_nm);
  wrench.force_n = scale * wrench.force_n;
  wrench.torque_nm = scale * wrench.torque_nm;
}

}  // namespace sqmap::runtime
