// SPDX-License-Identifier: Apache-2.0
//
// What the bounds of the surface prove. All of it errs as if the point were moved by less than the bounds'
// tolerance: a sure answer is the truth about a point that near (FORMAT.md 3.1).
#include "certainty.hpp"

#include "chart.hpp"
#include "combine.hpp"

namespace sqmap::runtime {
namespace {

// Layer 1 is asked of a slightly larger superquadric, so that its rounding (a part in 1e5 of F at exponent
// 0.1) puts no point outside. The baker's bounds reach farther still: kBoundReach of libbake.
constexpr float kShrink = 1 - 1.0F / 1024;

Certainty side_of(bool is_inside) noexcept { return is_inside ? Certainty::kInside : Certainty::kOutside; }

Certainty told_by(const Resident& resident, const PartRecord& part, const Vec3f& p_part) noexcept {
  if (part.bound_cells == 0) return Certainty::kUnsure;
  const Vec3f q{p_part.x * part.inverse_axes.x, p_part.y * part.inverse_axes.y,
                p_part.z * part.inverse_axes.z};
  const BoundPlace<float> at = bound_place(q, part.bound_cells);
  const BoundCell cell = resident.bound(part, at.cell);
  const float height = bound_height(cell, at);
  if (cell.outer != BoundCell::kNone && height >= static_cast<float>(cell.outer))
    return side_of((cell.sides & 1U) != 0);
  if (height >= static_cast<float>(cell.lower) && height <= static_cast<float>(cell.upper))
    return side_of((cell.sides & 2U) != 0);
  return Certainty::kUnsure;
}

}  // namespace

Certainty certainty_of(const Resident& resident, const Vec3f& p_m) noexcept {
  if (!is_finite(p_m)) return Certainty::kUnsure;
  const Vec3f p = resident.units_per_m() * p_m;
  Certainty told = Certainty::kOutside;
  if (!in_ball(p, resident.sphere_centre(), resident.sphere_square())) return told;
  for (std::uint32_t k = 0; k < resident.part_count(); ++k) {
    const PartRecord& part = resident.part(k);
    if (!in_ball(p, part.sphere_centre, part.sphere_square)) continue;
    const Vec3f p_part = part.to_part(p);
    if (!in_superquadric(part, kShrink * p_part)) continue;
    told = told_by(resident, part, p_part);
    if (told != Certainty::kUnsure) return told;
  }
  return told;
}

}  // namespace sqmap::runtime
