// SPDX-License-Identifier: Apache-2.0
//
// What the bounds of the surface prove. All of it errs as if the point were moved by less than the bounds'
// tolerance: a sure answer is the truth about a point that near (FORMAT.md 3.1).
#include "certainty.hpp"

#include "combine.hpp"
#include "part_shape.hpp"

namespace sqmap::runtime {
namespace {

// Layer 1 is asked of a slightly larger superquadric, so that its rounding (a part in 1e5 of F at exponent
// 0.1) puts no point outside. The baker's bounds reach farther still: kBoundReach of libbake.
constexpr float kShrink = 1 - 1.0F / 1024;

Vec3f inward(const PartBend& bend, const Vec3f& p_part) noexcept {
  const Vec3f inner = kShrink * bend.straightened(p_part);
  return bend.is_none() ? inner : bend.point(bend.turn_at(inner), inner);
}

}  // namespace

Certainty certainty_of(const Resident& resident, const Vec3f& p_m) noexcept {
  if (!is_finite(p_m)) return Certainty::kUnsure;
  const Vec3f p = resident.from_metres(p_m);
  if (!in_ball(p, resident.sphere_centre(), resident.sphere_square())) return Certainty::kOutside;
  // Parts that hold the point by layer 1 itself go first: query() asks no others.
  bool is_held = false, is_beside = false, is_outside = false;
  for (std::uint32_t k = 0; k < resident.part_count(); ++k) {
    const PartRecord& part = resident.part(k);
    if (!in_ball(p, part.sphere_centre, part.sphere_square)) continue;
    const Vec3f p_part = part.to_part(p);
    if (!in_superquadric(part, inward(part.bend, p_part))) continue;
    const Certainty told = told_by(resident, part, p_part);
    if (in_superquadric(part, p_part)) {
      if (told != Certainty::kUnsure) return told;
      is_held = true;
    } else {
      is_outside = is_outside || told == Certainty::kOutside;
      is_beside = true;
    }
  }
  return !is_held && (is_outside || !is_beside) ? Certainty::kOutside : Certainty::kUnsure;
}

}  // namespace sqmap::runtime
