// SPDX-License-Identifier: Apache-2.0
//
// The end of layer 3 in cells with a vertex sample: Chart::vertex_fan. Few walks end in one, so they are set
// aside and looked at together.

/// Keeps those of the lanes whose cell has a vertex sample, for fans().
HWY_NOINLINE M Walker::set_aside(const Walk& walk, const VCell& cell, VI entry, M lanes) noexcept {
  HWY_ALIGN std::int32_t texels[kMostLanes];
  hn::Store(cell.texel[0], kDI, texels);
  HWY_ALIGN float held[kMostLanes] = {};
  const std::uint32_t first = fans_.count;
  std::uint32_t count = first;
  for (std::uint32_t wanted = bits_of(lanes); wanted != 0; wanted &= wanted - 1) {
    const int lane = std::countr_zero(wanted);
    const std::uint32_t position =
        looker_.resident().find_fan(part_, static_cast<std::uint32_t>(texels[lane]));
    if (position >= part_.fans.count) continue;
    held[lane] = 1;
    fans_.place[count] = looker_.resident().fan_place(part_, position);
    fans_.code[count++] = looker_.resident().fan_code(part_, position);
  }
  if (count == first) return hn::Lt(hn::Zero(kD), hn::Zero(kD));
  const M found = hn::Gt(hn::Load(kD, held), hn::Zero(kD));
  const Packing packed(found);
  hn::StoreU(packed(walk.p.x), kD, fans_.x + first);
  hn::StoreU(packed(walk.p.y), kD, fans_.y + first);
  hn::StoreU(packed(walk.p.z), kD, fans_.z + first);
  hn::StoreU(packed(walk.row), kD, fans_.row + first);
  hn::StoreU(packed(walk.col), kD, fans_.col + first);
  hn::StoreU(packed(walk.on_rim), kD, fans_.on_rim + first);
  hn::StoreU(packed(walk.cell_row), kDI, fans_.cell_row + first);
  hn::StoreU(packed(walk.cell_col), kDI, fans_.cell_col + first);
  hn::StoreU(packed(entry), kDI, fans_.entry + first);
  fans_.count = count;
  return found;
}

/// nearest_on_segment() and nearest_on_triangle() of triangle.hpp.
HWY_INLINE V3 nearest_on_segment(const V3& p, const V3& a, const V3& b) {
  const V3 d = b - a;
  const V square = dot3(d, d), zero = hn::Zero(kD);
  const M has_length = hn::Gt(square, zero);
  const V along = hn::IfThenElseZero(has_length, dot3(p - a, d) / pick(has_length, square, all(1.0F)));
  return a + limited(along, zero, all(1.0F)) * d;
}
SQMAP_KERNEL V3 nearest_on_triangle(const V3& p, const V3& a, const V3& b, const V3& c) {
  const V zero = hn::Zero(kD);
  const V3 normal = cross3(b - a, c - a);
  const V square = dot3(normal, normal);
  M faces = hn::And(hn::Ge(dot3(cross3(b - a, p - a), normal), zero),
                    hn::Ge(dot3(cross3(c - b, p - b), normal), zero));
  faces = hn::And(faces, hn::Ge(dot3(cross3(a - c, p - c), normal), zero));
  faces = hn::And(faces, hn::Gt(square, zero));
  V3 nearest = nearest_on_segment(p, a, b);
  V least_square = dot3(p - nearest, p - nearest);
  const auto consider = [&](const V3& other) HWY_ATTR {
    const V here = dot3(p - other, p - other);
    const M nearer = hn::Lt(here, least_square);
    least_square = pick(nearer, here, least_square);
    nearest = pick(nearer, other, nearest);
  };
  consider(nearest_on_segment(p, b, c));
  consider(nearest_on_segment(p, c, a));
  const V3 foot = p - (dot3(p - a, normal) / pick(faces, square, all(1.0F))) * normal;
  return pick(faces, foot, nearest);
}

/// Chart::vertex_fan.
HWY_NOINLINE void Walker::fans() noexcept {
  for (std::uint32_t i = 0; i < fans_.count; i += lane_count()) {
    const M lanes = hn::FirstN(kD, fans_.count - i);
    const auto number = [&](const std::int32_t* values) HWY_ATTR {
      return hn::IfThenElseZero(hn::RebindMask(kDI, lanes), hn::LoadU(kDI, values + i));
    };
    const V3 p = load3(fans_.x, fans_.y, fans_.z, i);
    VCell cell = looker_.cell_of(number(fans_.cell_row), number(fans_.cell_col));
    looker_.read(cell);
    const V low = to_float(cell.row), left = to_float(cell.col);
    const V top = low + all(1.0F), right = left + all(1.0F);
    const auto corner_at = [&](V row, V col, V depth)
                               HWY_ATTR { return looker_.surface_at(row, col, depth); };
    const VI where = number(fans_.place);
    const V3 apex = corner_at(low + to_float(hn::And(where, all_int(255))) * all(1 / 256.0F),
                              left + to_float(hn::ShiftRight<8>(where)) * all(1 / 256.0F),
                              looker_.depth_of(number(fans_.code)));
    const V3 corner[4] = {corner_at(low, left, cell.depth[0]), corner_at(low, right, cell.depth[1]),
                          corner_at(top, right, cell.depth[3]), corner_at(top, left, cell.depth[2])};
    V best = all(std::numeric_limits<float>::infinity());
    V3 surface = apex, normal = apex;
    for (int k = 0; k < 4; ++k) {
      const V3 &a = corner[k], &b = corner[(k + 1) % 4];
      const V3 nearest = nearest_on_triangle(p, a, b, apex);
      const V3 d = p - nearest;
      const V square = dot3(d, d);
      const M nearer = hn::Lt(square, best);
      best = pick(nearer, square, best);
      surface = pick(nearer, nearest, surface);
      normal = pick(nearer, cross3(b - a, apex - a), normal);
    }
    write(hn::LoadU(kDI, fans_.entry + i), lanes, hn::LoadU(kD, fans_.row + i), hn::LoadU(kD, fans_.col + i),
          hn::LoadU(kD, fans_.on_rim + i), hn::Sqrt(best), surface, normal);
  }
  fans_.count = 0;
}
