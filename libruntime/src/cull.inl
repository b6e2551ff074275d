// SPDX-License-Identifier: Apache-2.0
//
// Which points lie in which superquadrics: bounds on blocks, bounds on points, layer 1.

HWY_INLINE M in_ball(const V3& p, const Vec3f& centre, float square) {
  const V3 d = p - all(centre);
  return hn::Le(dot3(d, d), all(square));
}
/// |p| over the half extents of the part's box, p in its straight frame.
HWY_INLINE V3 in_box(const PartRecord& part, const V3& p) {
  return {hn::Abs(p.x) * all(part.inverse_extents.x), hn::Abs(p.y) * all(part.inverse_extents.y),
          hn::Abs(p.z) * all(part.inverse_extents.z)};
}

/// Which of the balls reach into the part's sphere and, of a straight part, to the inner side of all its
/// planes.
HWY_INLINE M reaching(const PartRecord& part, const V3& centre, V radius, M wanted) {
  const V3 d = centre - all(part.sphere_centre);
  const V reach = all(part.sphere_radius) + radius;
  M near = hn::And(wanted, hn::Le(dot3(d, d), reach * reach));
  if (none(near) || !part.bend.is_none()) return near;
  const V3 w = in_box(part, rotated_back(part.object_from_part, centre - all(part.translation)));
  const auto within = [&](V sum, float bound, float factor)
                          HWY_ATTR { near = hn::And(near, hn::Le(sum, all(bound) + all(factor) * radius)); };
  const Slabs& slabs = part.slabs;
  within(w.x, 1.0F, part.inverse_extents.x);
  within(w.y, 1.0F, part.inverse_extents.y);
  within(w.z, 1.0F, part.inverse_extents.z);
  within(w.x + w.y, slabs.across, slabs.across_reach);
  within(w.x + w.z, slabs.up, slabs.up_x_reach);
  within(w.y + w.z, slabs.up, slabs.up_y_reach);
  within(w.x + w.y + w.z, slabs.diagonal, slabs.diagonal_reach);
  return near;
}

/// Appends the lanes of mask.
HWY_INLINE void append(M mask, const V3& p, VI point, Entries& out) {
  // A whole store: a compressing store is microcode on some processors.
  const Packing packed(mask);
  hn::StoreU(packed(p.x), kD, out.x + out.count);
  hn::StoreU(packed(p.y), kD, out.y + out.count);
  hn::StoreU(packed(p.z), kD, out.z + out.count);
  hn::StoreU(packed(point), kDI, out.point + out.count);
  out.count += packed.count();
}

/// Appends the points between the part's planes.
HWY_NOINLINE void cull(const PartRecord& part, const Chunk& chunk, Entries& out) {
  const Slabs& slabs = part.slabs;
  for (std::uint32_t first = 0; first < chunk.block_count; first += lane_count()) {
    const V3 centre = load3(chunk.block_centre[0], chunk.block_centre[1], chunk.block_centre[2], first);
    const V radius = hn::LoadU(kD, chunk.block_radius + first);
    std::uint32_t blocks = bits_of(reaching(part, centre, radius, hn::FirstN(kD, chunk.block_count - first)));
    for (; blocks != 0; blocks &= blocks - 1) {
      const std::uint32_t begin =
          (first + static_cast<std::uint32_t>(std::countr_zero(blocks))) * kBlockPoints;
      const std::uint32_t end = std::min(chunk.count, begin + kBlockPoints);
      for (std::uint32_t i = begin; i < end; i += lane_count()) {
        const V3 p = load3(chunk.x, chunk.y, chunk.z, i);
        const V3 q = rotated_back(part.object_from_part, p - all(part.translation));
        const V3 w = in_box(part, straightened(part.bend, q));
        M in = hn::And(hn::Le(w.x, all(1.0F)), hn::FirstN(kD, end - i));
        in = hn::And(in, hn::And(hn::Le(w.y, all(1.0F)), hn::Le(w.z, all(1.0F))));
        in = hn::And(in, hn::Le(w.x + w.y, all(slabs.across)));
        in = hn::And(in, hn::Le(most(w.x, w.y) + w.z, all(slabs.up)));
        in = hn::And(in, hn::Le(w.x + w.y + w.z, all(slabs.diagonal)));
        if (none(in)) continue;
        append(in, q, hn::Iota(kDI, static_cast<std::int32_t>(i)), out);
      }
    }
  }
}

/// Of the entries from `begin` on, leaves those in the object's sphere and the part's superquadric, and pads
/// them to whole vectors with entries of a point that nobody reads.
HWY_NOINLINE void first_layer(const PartRecord& part, std::uint32_t begin, Entries& entries) {
  const std::uint32_t end = entries.count;
  entries.count = begin;
  for (std::uint32_t i = begin; i < end; i += lane_count()) {
    const V3 p = load3(entries.x, entries.y, entries.z, i);
    const VI point = hn::LoadU(kDI, entries.point + i);
    const V3 straight = straightened(part.bend, p);
    V3 w = in_box(part, straight);
    if (part.taper != 0) {
      const V narrowing = narrowing_of(part, straight.z);
      w.x = w.x * narrowing;
      w.y = w.y * narrowing;
    }
    const V across = power_of(w.x, part.power_2) + power_of(w.y, part.power_2);
    const V sum = power_of(across, part.power_ratio) + power_of(w.z, part.power_1);
    append(hn::And(hn::Le(sum, all(1.0F)), hn::FirstN(kD, end - i)), p, point, entries);
  }
  if (entries.count == begin) return;
  hn::StoreU(hn::Zero(kD), kD, entries.x + entries.count);
  hn::StoreU(hn::Zero(kD), kD, entries.y + entries.count);
  hn::StoreU(hn::Zero(kD), kD, entries.z + entries.count);
  hn::StoreU(all_int(kChunkPoints), kDI, entries.point + entries.count);
}

/// Makes blocks of the points [0, chunk.count), strikes off those outside the object's sphere, and puts balls
/// around the others.
HWY_NOINLINE void make_blocks(const Resident& resident, Chunk& chunk) {
  constexpr float kSlack = 4e-6F;  // of all lengths that take part: rounding moves no point out of its ball
  const V infinity = all(std::numeric_limits<float>::infinity());
  const Vec3f& object = resident.sphere_centre();
  const float span = std::abs(object.x) + std::abs(object.y) + std::abs(object.z) + resident.sphere_radius();
  chunk.block_count = (chunk.count + kBlockPoints - 1) / kBlockPoints;
  for (std::uint32_t block = 0; block < chunk.block_count; ++block) {
    const std::uint32_t begin = block * kBlockPoints, end = std::min(chunk.count, begin + kBlockPoints);
    V3 low{infinity, infinity, infinity};
    V3 high{hn::Neg(infinity), hn::Neg(infinity), hn::Neg(infinity)};
    for (std::uint32_t i = begin; i < end; i += lane_count()) {
      const V3 p = load3(chunk.x, chunk.y, chunk.z, i);
      const M in = hn::And(in_ball(p, object, resident.sphere_square()), hn::FirstN(kD, end - i));
      const V3 up = pick(in, p, low), down = pick(in, p, high);
      low = {hn::Min(low.x, up.x), hn::Min(low.y, up.y), hn::Min(low.z, up.z)};
      high = {hn::Max(high.x, down.x), hn::Max(high.y, down.y), hn::Max(high.z, down.z)};
      hn::StoreU(pick(in, p.x, infinity), kD, chunk.x + i);
    }
    const Vec3f least{hn::GetLane(hn::MinOfLanes(kD, low.x)), hn::GetLane(hn::MinOfLanes(kD, low.y)),
                      hn::GetLane(hn::MinOfLanes(kD, low.z))};
    const Vec3f greatest{hn::GetLane(hn::MaxOfLanes(kD, high.x)), hn::GetLane(hn::MaxOfLanes(kD, high.y)),
                         hn::GetLane(hn::MaxOfLanes(kD, high.z))};
    const Vec3f half = 0.5F * (greatest - least);  // of an empty block: minus infinity, and its centre NaN
    for (int axis = 0; axis < 3; ++axis) chunk.block_centre[axis][block] = least[axis] + half[axis];
    chunk.block_radius[block] = norm(half) * (1 + kSlack) + span * kSlack;
  }
}
