// SPDX-License-Identifier: Apache-2.0
//
// told_by() of certainty.hpp for the entries of one part.

/// What the bounds prove leaves no doubt: Chart::look, with told_by().
HWY_NOINLINE void prove(const Resident& resident, const PartRecord& part, const EntryRange& range,
                        Entries& entries) {
  const std::uint8_t* base = resident.bytes() + part.curves_at + Resident::kCurveBytes;
  const V zero = hn::Zero(kD), one = all(1.0F), two = all(2.0F), half = all(0.5F * part.bound_cells);
  const VI cells = all_int(part.bound_cells), byte = all_int(255);
  for (std::uint32_t i = range.begin; i < range.end; i += lane_count()) {
    const V3 p = load3(entries.x, entries.y, entries.z, i);
    const V3 q{p.x * all(part.inverse_extents.x), p.y * all(part.inverse_extents.y),
               p.z * all(part.inverse_extents.z)};
    const V x = hn::Abs(q.x), y = hn::Abs(q.y), z = hn::Abs(q.z);
    const M x_first = hn::Ge(x, y), by_x = hn::And(x_first, hn::Ge(x, z));
    const M by_y = hn::AndNot(x_first, hn::Ge(y, z));
    const V along = pick(by_x, q.x, pick(by_y, q.y, q.z)), reach = hn::Abs(along);
    const M off_centre = hn::Gt(reach, zero);
    const V divisor = pick(off_centre, reach, one);
    const auto place = [&](V across, V& middle_off) HWY_ATTR {
      const V at = (across / divisor + one) * half;
      const VI index = hn::Min(to_int(at), cells - all_int(1));
      middle_off = hn::IfThenElseZero(off_centre, two * (at - to_float(index)) - one);
      return index;
    };
    V u, v;
    const VI col = place(pick(by_x, q.y, pick(by_y, q.z, q.x)), u);
    const VI row = place(pick(by_x, q.z, pick(by_y, q.x, q.y)), v);
    const VI axis = pick(by_x, hn::Zero(kDI), pick(by_y, all_int(1), all_int(2)));
    const VI face = axis + axis + pick(hn::Lt(along, zero), all_int(1), hn::Zero(kDI));
    const VI cell = pick(off_centre, (face * cells + row) * cells + col, hn::Zero(kDI));
    static_assert(sizeof(BoundCell) == 6 && offsetof(BoundCell, outer) == 2);
    const VI at = cell * all_int(sizeof(BoundCell));
    const VI low = hn::BitCast(kDI, gather_bytes(base, at));
    const VI high = hn::BitCast(kDI, gather_bytes(base, at + all_int(2)));
    const auto tilt = [&](VI code) HWY_ATTR {
      return (to_float(hn::And(code, byte)) - all(float{BoundCell::kLevel})) * all(1.0F / 256);
    };
    const V height =
        (all(float{kBoundSteps}) * reach) * (one + tilt(low) * u + tilt(hn::ShiftRight<8>(low)) * v);
    const VI outer = hn::And(high, byte), sides = hn::ShiftRight<24>(high);
    const V upper = to_float(hn::And(hn::ShiftRight<8>(high), byte));
    const V lower = to_float(hn::And(hn::ShiftRight<16>(high), byte));
    const M known = as_float(hn::Ne(outer, all_int(BoundCell::kNone)));
    const M beyond = hn::And(known, hn::Ge(height, to_float(outer)));
    const M between = hn::And(hn::Ge(height, lower), hn::Le(height, upper));
    const VI side = hn::And(sides, pick(beyond, all_int(1), all_int(2)));
    const VI inside = pick(as_float(hn::Ne(side, hn::Zero(kDI))), hn::Set(kDI, kInside), hn::Zero(kDI));
    const M sure = hn::Or(beyond, between);
    const VI flags = hn::LoadU(kDI, entries.flags + i);
    const VI others = hn::AndNot(hn::Set(kDI, kInside), flags);
    hn::StoreU(pick(sure, hn::Or(others, inside), flags), kDI, entries.flags + i);
    const V certainty = hn::LoadU(kD, entries.certainty + i);
    hn::StoreU(pick(sure, all(std::numeric_limits<float>::infinity()), certainty), kD, entries.certainty + i);
  }
}
