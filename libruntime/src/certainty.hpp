// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sqmap/runtime/object.hpp"

#include "resident.hpp"

namespace sqmap::runtime {

/// What the bounds of one part prove of a point in its superquadric. Part frame, units of Resident::unit_m.
inline Certainty told_by(const Resident& resident, const PartRecord& part, const Vec3f& p_part) noexcept {
  if (part.bound_cells == 0) return Certainty::kUnsure;
  const auto side_of = [](bool is_inside) { return is_inside ? Certainty::kInside : Certainty::kOutside; };
  const Vec3f q{p_part.x * part.inverse_extents.x, p_part.y * part.inverse_extents.y,
                p_part.z * part.inverse_extents.z};
  const BoundPlace<float> at = bound_place(q, part.bound_cells);
  const BoundCell cell = resident.bound(part, at.cell);
  const float height = bound_height(cell, at);
  if (cell.outer != BoundCell::kNone && height >= static_cast<float>(cell.outer))
    return side_of((cell.sides & 1U) != 0);
  if (height >= static_cast<float>(cell.lower) && height <= static_cast<float>(cell.upper))
    return side_of((cell.sides & 2U) != 0);
  return Certainty::kUnsure;
}

/// Object::certainty of one point.
Certainty certainty_of(const Resident& resident, const Vec3f& p_m) noexcept;

}  // namespace sqmap::runtime
