// SPDX-License-Identifier: Apache-2.0
//
// The superquadric of a part: layer 1 and its normals. The SIMD engine (lanes.inl, bends.inl) follows them
// operation by operation and gives the same bits: change both. Part frame; lengths in units of
// Resident::unit_m.
#pragma once

#include <cmath>

#include "part_bend.hpp"
#include "powers.hpp"
#include "resident.hpp"

namespace sqmap::runtime {

/// By how much a tapered part is narrower than its box at z, |z| <= a3; 1 of a rigid one.
inline float narrowing_at(const PartRecord& part, float z) noexcept {
  return (1.0F + std::abs(part.taper)) / (1.0F + part.taper * (z * part.inverse_extents.z));
}

/// Layer 1: F(p) <= 1 (FORMAT.md S1), from powers of the unit coordinates.
inline bool in_superquadric(const PartRecord& part, const Vec3f& p_part) noexcept {
  const Vec3f p = part.bend.straightened(p_part);
  float x = std::abs(p.x) * part.inverse_extents.x, y = std::abs(p.y) * part.inverse_extents.y;
  const float z = std::abs(p.z) * part.inverse_extents.z;
  if (!(x <= 1.0F && y <= 1.0F && z <= 1.0F)) return false;
  if (part.taper != 0) {
    const float narrowing = narrowing_at(part, p.z);
    x *= narrowing;
    y *= narrowing;
  }
  const float across = power_of(x, part.power_2) + power_of(y, part.power_2);
  return power_of(across, part.power_ratio) + power_of(z, part.power_1) <= 1.0F;
}

/// Outward unit normal, at p_part in the part, of the superquadric with the same axis, taper, bend and a3 to
/// which it belongs; zero at the centre.
inline Vec3f shape_normal(const PartRecord& part, const Vec3f& p_part) noexcept {
  const Vec3f p = part.bend.straightened(p_part);
  const float narrowing = narrowing_at(part, p.z);
  const float b_x = part.inverse_extents.x * narrowing, b_y = part.inverse_extents.y * narrowing,
              b_z = part.inverse_extents.z;
  const float x = std::abs(p.x) * b_x, y = std::abs(p.y) * b_y, z = std::abs(p.z) * b_z;
  const float most = greater(x, y);
  float u = 0, normal_x = 0, normal_y = 0;
  if (most > 0) {
    const float u_x = x / most, u_y = y / most;
    const float size = power_of(power_of(u_x, part.power_2) + power_of(u_y, part.power_2), 1 / part.power_2);
    u = most * size;
    normal_x = power_of(u_x / size, part.power_2 - 1);
    normal_y = power_of(u_y / size, part.power_2 - 1);
  }
  const float scale = greater(u, z);
  if (!(scale > 0)) return {};
  const float rim = power_of(u / scale, part.power_1 - 1);
  const float lean = (part.taper * (narrowing / (1.0F + std::abs(part.taper)))) * (rim * u) * b_z;
  const Vec3f gradient{std::copysign(rim * normal_x * b_x, p.x), std::copysign(rim * normal_y * b_y, p.y),
                       std::copysign(power_of(z / scale, part.power_1 - 1) * b_z, p.z) - lean};
  return normalized(part.bend.is_none() ? gradient : part.bend.gradient(part.bend.turn_at(p), gradient));
}

}  // namespace sqmap::runtime
