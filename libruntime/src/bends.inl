// SPDX-License-Identifier: Apache-2.0
//
// part_bend.hpp for a vector of points of one bent part.

template <int kCount>
HWY_INLINE V series_of(const float (&coefficient)[kCount], V square) {
  V sum = all(coefficient[kCount - 1]);
  for (int k = kCount - 2; k >= 0; --k) sum = all(coefficient[k]) + square * sum;
  return sum;
}

/// Where points of the part frame lie in its straight frame: PartBend::straightened.
HWY_NOINLINE V3 unbent(const PartBend& bend, const V3& p) {
  const V one = all(1.0F);
  const V c = one - all(bend.curvature) * (all(bend.x) * p.x + all(bend.y) * p.y);
  const V w = all(bend.curvature) * p.z;
  const V sum = hn::Sqrt(c * c + w * w) + c;
  const V farthest = all(float{kMostBendTangent});
  const V size = hn::Abs(w);
  const M near = hn::And(hn::Lt(size, farthest * sum), hn::Le(sum, all(std::numeric_limits<float>::max())));
  const V t = pick(near, size / pick(near, sum, one), farthest);
  const V u = t / (one + hn::Sqrt(one + t * t));
  const V angle = (all(4.0F) * u) * series_of(kArctangentSeries, u * u);
  const V lean = hn::Abs(p.z) * t;
  return {p.x - all(bend.x) * lean, p.y - all(bend.y) * lean, hn::CopySign(all(bend.radius()) * angle, p.z)};
}
HWY_INLINE V3 straightened(const PartBend& bend, const V3& p) {
  if (bend.is_none()) [[likely]]
    return p;
  return unbent(bend, p);
}

/// PartBend::Turn.
struct VTurn {
  V sine, versine, stretch;
};
HWY_INLINE VTurn turn_at(const PartBend& bend, const V3& straight) {
  const V half = limited(all(0.5F * bend.curvature) * straight.z, all(-kMostHalfTurn), all(kMostHalfTurn));
  const V square = half * half;
  const V s = half * series_of(kSineSeries, square), c = series_of(kCosineSeries, square);
  return {(s + s) * c, (s + s) * s,
          all(1.0F) - all(bend.curvature) * (all(bend.x) * straight.x + all(bend.y) * straight.y)};
}
/// PartBend::point.
HWY_INLINE V3 bent_point(const PartBend& bend, const VTurn& turn, const V3& straight) {
  const V reach = turn.stretch * all(bend.radius()), lean = turn.versine * reach;
  return {straight.x + all(bend.x) * lean, straight.y + all(bend.y) * lean, turn.sine * reach};
}
/// PartBend::step and, with `along` = v.z / stretch, PartBend::gradient.
HWY_INLINE V3 turned(const PartBend& bend, const VTurn& turn, const V3& v, V along) {
  const V across = all(bend.x) * v.x + all(bend.y) * v.y;
  const V lean = turn.sine * along - turn.versine * across;
  return {v.x + all(bend.x) * lean, v.y + all(bend.y) * lean,
          (all(1.0F) - turn.versine) * along - turn.sine * across};
}

/// shape_normal() of part_shape.hpp.
SQMAP_KERNEL V3 shape_normal_of(const PartRecord& part, const V3& p_part) {
  const V3 p = straightened(part.bend, p_part);
  const V zero = hn::Zero(kD), one = all(1.0F);
  const V narrowing = narrowing_of(part, p.z);
  const V bx = all(part.inverse_extents.x) * narrowing, by = all(part.inverse_extents.y) * narrowing,
          bz = all(part.inverse_extents.z);
  const V x = hn::Abs(p.x) * bx, y = hn::Abs(p.y) * by, z = hn::Abs(p.z) * bz;
  const V more = most(x, y);
  const M off_axis = hn::Gt(more, zero);
  const V divisor = pick(off_axis, more, one);
  const V u_x = x / divisor, u_y = y / divisor;
  const V size = power_of(power_of(u_x, part.power_2) + power_of(u_y, part.power_2), 1 / part.power_2);
  const V u = hn::IfThenElseZero(off_axis, more * size);
  const V normal_x = hn::IfThenElseZero(off_axis, power_of(u_x / size, part.power_2 - 1));
  const V normal_y = hn::IfThenElseZero(off_axis, power_of(u_y / size, part.power_2 - 1));
  const V scale = most(u, z);
  const M known = hn::Gt(scale, zero);
  const V whole = pick(known, scale, one);
  const V rim = power_of(u / whole, part.power_1 - 1);
  const V lean = (all(part.taper) * (narrowing / all(1.0F + std::abs(part.taper)))) * (rim * u) * bz;
  V3 n{hn::CopySign(rim * normal_x * bx, p.x), hn::CopySign(rim * normal_y * by, p.y),
       hn::CopySign(power_of(z / whole, part.power_1 - 1) * bz, p.z) - lean};
  if (!part.bend.is_none()) [[unlikely]] {
    const VTurn turn = turn_at(part.bend, p);
    n = turned(part.bend, turn, n, n.z / turn.stretch);
  }
  return pick(known, normalized3(n), V3{zero, zero, zero});
}
