// SPDX-License-Identifier: Apache-2.0
//
// Chart (chart.hpp) for a vector of points: layers 2 and 3. What few points need (further sheets of a ray,
// fans of vertex samples, the offset of faces) is left to Chart itself, a point at a time.

/// What the lanes of one vector know: ChartAnswer.
struct Look {
  M inside, faces_patch;
  M within;  // Wants::reach: layer 2 cannot rule out that the surface is so near
  V certainty, distance, row, col;
  V3 surface, normal;
};

struct VCell {
  VI row, col;
  VI texel[4];
  V depth[4];
};
struct Corners {
  VI texel[4];  // as stored: code and start bit
  M eligible;
};
struct VPatch {
  V3 point, row, col;
};

/// One part at one level, with what every step of a look needs of it.
class Looker {
 public:
  Looker(const Resident& resident, const PartRecord& part, const Chart& chart, std::uint32_t level) noexcept
      : resident_(resident),
        part_(part),
        chart_(chart),
        level_(level),
        stride_(part.stride_at(level)),
        last_row_(static_cast<float>(part.rows - 1)),
        turn_(static_cast<float>(part.cols)),
        size_(static_cast<float>(stride_)),
        inverse_size_(1.0F / size_) {}

  SQMAP_KERNEL Look look(const V3& p, M wanted, bool third, const Wants& wants) const noexcept {
    const VFoot foot = foot_of(chart_.table(), p);
    M behind;
    Look second = second_layer(foot, wanted, third, wants, behind);
    if (!third) return second;
    M eligible = hn::And(wanted, hn::Lt(second.distance, all(std::numeric_limits<float>::infinity())));
    const M lost = hn::AndNot(eligible, hn::And(wanted, second.inside));
    if (!none(lost)) eligible = hn::Or(eligible, start_beside(lost, p, second));
    if (none(eligible)) return second;
    const Look refined = third_layer(p, second.row, second.col, eligible, wants);
    const M better =
        hn::And(eligible, hn::Not(hn::AndNot(hn::Lt(refined.distance, second.distance), behind)));
    second.distance = pick(better, refined.distance, second.distance);
    second.row = pick(better, refined.row, second.row);
    second.col = pick(better, refined.col, second.col);
    second.faces_patch = hn::And(better, refined.faces_patch);
    if (wants.surface) second.surface = pick(better, refined.surface, second.surface);
    if (wants.normal) second.normal = pick(better, refined.normal, second.normal);
    return second;
  }

 private:
  HWY_INLINE VCell cell_of(VI row, VI col) const noexcept {
    VCell cell;
    cell.row = row;
    cell.col = col;
    const VI right = col + all_int(stride_);
    const VI next = hn::IfThenElseZero(hn::Lt(right, all_int(part_.cols)), right);
    const VI low = row * all_int(part_.cols), up = all_int(stride_ * part_.cols);
    cell.texel[0] = low + col;
    cell.texel[1] = low + next;
    cell.texel[2] = cell.texel[0] + up;
    cell.texel[3] = cell.texel[1] + up;
    return cell;
  }
  HWY_INLINE VCell cell_at(V row, V col) const noexcept {
    const VI zero = hn::Zero(kDI), mask = hn::Set(kDI, -static_cast<std::int32_t>(stride_));
    const VI low = hn::And(hn::Max(to_int(row), zero), mask);
    const VI left = hn::And(hn::Min(hn::Max(to_int(col), zero), all_int(part_.cols - 1)), mask);
    return cell_of(hn::Min(low, all_int(part_.rows - 1 - stride_)), left);
  }
  HWY_INLINE V depth_of(VI code) const noexcept {
    return all(part_.depth_min) + to_float(code) * all(part_.depth_step);
  }
  /// Reads the corners' texels; sets their depths.
  SQMAP_KERNEL Corners read(VCell& cell) const noexcept {
    const std::uint8_t* base = resident_.bytes() + part_.texels_at;
    const VU mask = hn::Set(kDU, (1U << part_.texel_bits) - 1U);
    Corners corners;
    corners.eligible = as_float(hn::Eq(hn::Zero(kDI), hn::Zero(kDI)));
    for (int k = 0; k < 4; ++k) {
      const VI bit = cell.texel[k] * all_int(part_.texel_bits);
      const VU word = gather_bytes(base, hn::ShiftRight<3>(bit));
      const VU shifted = word >> hn::And(hn::BitCast(kDU, bit), hn::Set(kDU, 7U));
      corners.texel[k] = hn::BitCast(kDI, hn::And(shifted, mask));
      corners.eligible =
          hn::And(corners.eligible, as_float(hn::Lt(corners.texel[k], all_int(part_.miss_code))));
      cell.depth[k] = depth_of(hn::And(corners.texel[k], all_int(part_.miss_code)));
    }
    return corners;
  }
  SQMAP_KERNEL VPatch patch_at(const VCell& cell, V row, V col) const noexcept {
    const V inverse = all(inverse_size_);
    const V s = (row - to_float(cell.row)) * inverse, t = (col - to_float(cell.col)) * inverse;
    const V rise_low = cell.depth[1] - cell.depth[0], rise_high = cell.depth[3] - cell.depth[2];
    const V low = cell.depth[0] + t * rise_low, high = cell.depth[2] + t * rise_high;
    const V depth = low + s * (high - low);
    const V depth_row = (high - low) * inverse;
    const V depth_col = (rise_low + s * (rise_high - rise_low)) * inverse;
    const Sample r = sample_at(chart_.table(), row, col);
    return {r.point - depth * r.normal, r.point_row - depth_row * r.normal - depth * r.normal_row,
            r.point_col - depth_col * r.normal - depth * r.normal_col};
  }
  SQMAP_KERNEL V3 patch_normal(const VCell& cell, V row, V col) const noexcept {
    const VPatch patch = patch_at(cell, limited(row, all(kBesidePole), all(last_row_ - kBesidePole)), col);
    return normalized3(cross3(patch.col, patch.row));
  }
  HWY_INLINE M block_holds(const SideList& list, VI texel) const noexcept {
    static_assert(Resident::kBlock == 8);
    const VI block = hn::ShiftRight<3>(texel);
    const VU word = gather_bytes(resident_.bytes() + list.blocks_at, hn::ShiftRight<3>(block));
    const VU bit = (word >> hn::And(hn::BitCast(kDU, block), hn::Set(kDU, 7U))) & hn::Set(kDU, 1U);
    return hn::RebindMask(kD, hn::Ne(bit, hn::Zero(kDU)));
  }

  SQMAP_KERNEL Look second_layer(const VFoot& foot, M wanted, bool third, const Wants& wants,
                                 M& behind) const noexcept;
  HWY_NOINLINE M start_beside(M lanes, const V3& p, Look& look) const noexcept;
  HWY_NOINLINE Look third_layer(const V3& p, V row, V col, M active, const Wants& wants) const noexcept;
  HWY_NOINLINE void further_sheets(M lanes, VI texel, V shift, V depth, V& gap, V& crossing, V& inside,
                                   V& leaving, V& later) const noexcept;
  HWY_NOINLINE void vertex_fans(M lanes, const V3& p, const VCell& cell, Look& look) const noexcept;

  const Resident& resident_;
  const PartRecord& part_;
  const Chart& chart_;
  std::uint32_t level_, stride_;
  float last_row_, turn_, size_, inverse_size_;
};

SQMAP_KERNEL Look Looker::second_layer(const VFoot& foot, M wanted, bool third, const Wants& wants,
                                       M& behind) const noexcept {
  const V zero = hn::Zero(kD), one = all(1.0F), half = all(0.5F);
  VCell cell = cell_at(foot.row, foot.col);
  const Corners corners = read(cell);
  const V inverse = all(inverse_size_);
  const V s = (foot.row - to_float(cell.row)) * inverse, t = (foot.col - to_float(cell.col)) * inverse;
  const M lower = hn::Lt(s, half), left = hn::Lt(t, half);
  const auto nearest_of = [&](const auto* corner) HWY_ATTR {
    return pick(lower, pick(left, corner[0], corner[1]), pick(left, corner[2], corner[3]));
  };
  const V* depth = cell.depth;
  const V near_depth = nearest_of(depth);
  const VI near_texel = nearest_of(corners.texel);
  const V low = depth[0] + t * (depth[1] - depth[0]), high = depth[2] + t * (depth[3] - depth[2]);
  const V shift = hn::IfThenElseZero(corners.eligible, (low + s * (high - low)) - near_depth);
  const V shallow = least(least(depth[0], depth[1]), least(depth[2], depth[3]));
  const V deep = most(most(depth[0], depth[1]), most(depth[2], depth[3]));
  const V doubt =
      pick(corners.eligible, all(0.25F) * (deep - shallow) + all(part_.depth_step), foot.cell * all(size_));

  const VI miss = all_int(part_.miss_code);
  const auto starts = [&](VI texel) HWY_ATTR { return hn::Gt(texel, miss); };
  const auto start = starts(near_texel);
  auto mixed = hn::Xor(starts(corners.texel[0]), start);
  for (int k = 1; k < 4; ++k) mixed = hn::Or(mixed, hn::Xor(starts(corners.texel[k]), start));

  const M hit = as_float(hn::Ne(hn::And(near_texel, miss), miss));
  const V first = near_depth + shift;
  M inside = hn::Xor(as_float(start), hn::And(hit, hn::Lt(first, foot.depth)));
  V gap = pick(hit, hn::Abs(first - foot.depth), all(std::numeric_limits<float>::infinity()));
  V crossing = hn::IfThenElseZero(hit, first);
  V leaving = zero, later = zero;
  if (part_.sheets.count > 0) {
    const VI texel = nearest_of(cell.texel);
    const M further = hn::And(hn::And(wanted, hit), block_holds(part_.sheets, texel));
    if (!none(further)) {
      V inside_number = hn::IfThenElseZero(inside, one);
      further_sheets(further, texel, shift, foot.depth, gap, crossing, inside_number, leaving, later);
      inside = hn::Gt(inside_number, half);
    }
  }
  behind = hn::Gt(later, half);

  Look look;
  look.inside = inside;
  look.faces_patch = hn::Lt(one, zero);
  look.within = hn::Lt(all(part_.depth_min) - foot.depth, all(wants.reach));
  if (!(wants.reach > 0)) look.within = look.faces_patch;  // none
  const V reach = pick(as_float(mixed), most(foot.depth, zero), all(part_.sphere_radius));
  look.certainty = least(gap, reach) / most(doubt, all(kLeastDoubt * part_.sphere_radius));
  look.distance = pick(corners.eligible, gap, all(std::numeric_limits<float>::infinity()));
  look.row = foot.row;
  look.col = foot.col;
  look.surface = look.normal = {zero, zero, zero};
  // Layer 3 replaces the place and the normal, unless the crossing is one behind the first.
  const M kept = third ? hn::And(wanted, behind) : wanted;
  if (none(hn::And(kept, corners.eligible))) return look;
  if (wants.surface) {
    const Sample r = sample_at(chart_.table(), foot.row, foot.col);
    look.surface = r.point - crossing * r.normal;
  }
  if (wants.normal) {
    const V side = pick(hn::Gt(leaving, half), all(-1.0F), one);
    look.normal = side * patch_normal(cell, foot.row, foot.col);
  }
  return look;
}

HWY_NOINLINE void Looker::further_sheets(M lanes, VI texel, V shift, V depth, V& gap, V& crossing, V& inside,
                                         V& leaving, V& later) const noexcept {
  HWY_ALIGN std::int32_t texels[kMostLanes];
  HWY_ALIGN float wanted[kMostLanes], shifts[kMostLanes], depths[kMostLanes], gaps[kMostLanes],
      crossings[kMostLanes], insides[kMostLanes], leavings[kMostLanes], laters[kMostLanes];
  hn::Store(texel, kDI, texels);
  hn::Store(hn::IfThenElseZero(lanes, all(1.0F)), kD, wanted);
  hn::Store(shift, kD, shifts);
  hn::Store(depth, kD, depths);
  hn::Store(gap, kD, gaps);
  hn::Store(crossing, kD, crossings);
  hn::Store(inside, kD, insides);
  hn::Store(leaving, kD, leavings);
  hn::Store(later, kD, laters);
  for (std::uint32_t lane = 0; lane < lane_count(); ++lane) {
    if (!(wanted[lane] > 0)) continue;
    bool odd = true;
    const auto key = static_cast<std::uint32_t>(texels[lane]);
    for (std::uint32_t k = resident_.find(part_.sheets, key);
         k < part_.sheets.count && resident_.key(part_.sheets, k) == key; ++k, odd = !odd) {
      const float here = part_.depth_of(resident_.sheet_code(part_, k)) + shifts[lane];
      if (here < depths[lane]) insides[lane] = 1.0F - insides[lane];
      if (!(std::abs(here - depths[lane]) < gaps[lane])) continue;
      gaps[lane] = std::abs(here - depths[lane]);
      crossings[lane] = here;
      laters[lane] = 1;
      leavings[lane] = odd ? 1.0F : 0.0F;
    }
  }
  gap = hn::Load(kD, gaps);
  crossing = hn::Load(kD, crossings);
  inside = hn::Load(kD, insides);
  leaving = hn::Load(kD, leavings);
  later = hn::Load(kD, laters);
}

/// Chart::patch_beside for some lanes: those that found a patch, and its place in `look`.
HWY_NOINLINE M Looker::start_beside(M lanes, const V3& p, Look& look) const noexcept {
  HWY_ALIGN float wanted[kMostLanes], x[kMostLanes], y[kMostLanes], z[kMostLanes], row[kMostLanes],
      col[kMostLanes];
  hn::Store(hn::IfThenElseZero(lanes, all(1.0F)), kD, wanted);
  hn::Store(p.x, kD, x);
  hn::Store(p.y, kD, y);
  hn::Store(p.z, kD, z);
  hn::Store(look.row, kD, row);
  hn::Store(look.col, kD, col);
  for (std::uint32_t lane = 0; lane < lane_count(); ++lane) {
    if (wanted[lane] > 0 && !chart_.patch_beside({x[lane], y[lane], z[lane]}, level_, row[lane], col[lane]))
      wanted[lane] = 0;
  }
  look.row = hn::Load(kD, row);
  look.col = hn::Load(kD, col);
  return hn::Gt(hn::Load(kD, wanted), hn::Zero(kD));
}

HWY_NOINLINE Look Looker::third_layer(const V3& p, V row, V col, M active,
                                      const Wants& wants) const noexcept {
  const V zero = hn::Zero(kD), one = all(1.0F);
  const M asked = active;
  VCell cell = cell_at(row, col);
  read(cell);
  const V last_row = all(last_row_), turn = all(turn_), most_row = all(size_);
  const V last_col = all(std::nextafter(turn_, 0.0F));
  V best_square = all(std::numeric_limits<float>::infinity()), best_row = row, best_col = col;
  VI best_cell_row = cell.row, best_cell_col = cell.col;
  V3 best_point{zero, zero, zero};
  M on_rim = hn::Lt(one, zero), best_on_rim = on_rim;
  for (int step = 0; step <= kThirdLayerSteps; ++step) {
    const VPatch patch = patch_at(cell, row, col);
    const V3 error = p - patch.point;
    const V square = dot3(error, error);
    const M better = hn::And(active, hn::Lt(square, best_square));
    best_square = pick(better, square, best_square);
    best_point = pick(better, patch.point, best_point);
    best_row = pick(better, row, best_row);
    best_col = pick(better, col, best_col);
    best_cell_row = pick(better, cell.row, best_cell_row);
    best_cell_col = pick(better, cell.col, best_cell_col);
    best_on_rim = hn::Or(hn::And(better, on_rim), hn::AndNot(better, best_on_rim));

    const V a = dot3(patch.row, patch.row), b = dot3(patch.row, patch.col), c = dot3(patch.col, patch.col);
    const V f = dot3(patch.row, error), g = dot3(patch.col, error);
    const V product = a * c, determinant = product - b * b;
    const M regular = hn::Gt(determinant, all(kLeastAngle) * product);
    const M rows_only = hn::AndNot(regular, hn::Gt(a, zero));
    const V inverse = one / pick(regular, determinant, pick(rows_only, a, one));
    const V d_row_free = pick(regular, (c * f - b * g) * inverse, hn::IfThenElseZero(rows_only, f * inverse));
    const V d_col_free = hn::IfThenElseZero(regular, (a * g - b * f) * inverse);
    const V slimness =
        hn::Sqrt(a / most(most(c, all(kLeastAngle) * a), all(std::numeric_limits<float>::min())));
    const V most_col = least(all(turn_ * 0.125F), most_row * most(slimness, one));
    const V d_row = limited(d_row_free, hn::Neg(most_row), most_row);
    const V d_col = limited(d_col_free, hn::Neg(most_col), most_col);
    active = hn::AndNot(hn::Lt(hn::Abs(d_row) + hn::Abs(d_col), all(kLeastCellStep)), active);
    if (none(active)) break;

    const V next_row = limited(row + d_row, zero, last_row);
    const V moved = col + d_col;
    const V raised = pick(hn::Lt(moved, zero), moved + turn, moved);
    const V next_col = pick(hn::Lt(raised, turn), raised, raised - turn);
    VCell next = cell_at(next_row, next_col);
    const M moves = read(next).eligible;
    on_rim = hn::Not(moves);
    const V low_row = to_float(cell.row), low_col = to_float(cell.col);
    const V rim_row = limited(row + d_row, low_row, low_row + most_row);
    const V rim_col = limited(moved, low_col, low_col + most_row);
    const M stays = hn::Lt(hn::Abs(rim_row - row) + hn::Abs(rim_col - col), all(kLeastCellStep));
    active = hn::AndNot(hn::And(on_rim, stays), active);
    row = pick(moves, next_row, rim_row);
    col = pick(moves, next_col, least(rim_col, last_col));
    cell.row = pick(moves, next.row, cell.row);
    cell.col = pick(moves, next.col, cell.col);
    for (int k = 0; k < 4; ++k) cell.depth[k] = pick(moves, next.depth[k], cell.depth[k]);
    if (none(active)) break;
  }
  Look look;
  look.inside = look.within = best_on_rim;
  look.faces_patch = hn::Not(best_on_rim);
  look.certainty = zero;
  look.distance = hn::Sqrt(best_square);
  look.surface = best_point;
  look.row = best_row;
  look.col = best_col;
  look.normal = {zero, zero, zero};
  const bool fans = stride_ == 1 && part_.fans.count > 0;
  if (!wants.normal && !fans) return look;
  VCell best_cell = cell_of(best_cell_row, best_cell_col);
  read(best_cell);
  if (wants.normal) look.normal = patch_normal(best_cell, best_row, best_col);
  if (fans) {
    const M held = hn::And(asked, block_holds(part_.fans, best_cell.texel[0]));
    if (!none(held)) vertex_fans(held, p, best_cell, look);
  }
  return look;
}

HWY_NOINLINE void Looker::vertex_fans(M lanes, const V3& p, const VCell& cell, Look& look) const noexcept {
  HWY_ALIGN float wanted[kMostLanes], x[kMostLanes], y[kMostLanes], z[kMostLanes], row[kMostLanes],
      col[kMostLanes], distance[kMostLanes], surface[3][kMostLanes], normal[3][kMostLanes];
  hn::Store(hn::IfThenElseZero(lanes, all(1.0F)), kD, wanted);
  hn::Store(p.x, kD, x);
  hn::Store(p.y, kD, y);
  hn::Store(p.z, kD, z);
  hn::Store(to_float(cell.row), kD, row);
  hn::Store(to_float(cell.col), kD, col);
  hn::Store(look.distance, kD, distance);
  hn::Store(look.surface.x, kD, surface[0]);
  hn::Store(look.surface.y, kD, surface[1]);
  hn::Store(look.surface.z, kD, surface[2]);
  hn::Store(look.normal.x, kD, normal[0]);
  hn::Store(look.normal.y, kD, normal[1]);
  hn::Store(look.normal.z, kD, normal[2]);
  for (std::uint32_t lane = 0; lane < lane_count(); ++lane) {
    if (!(wanted[lane] > 0)) continue;
    ChartAnswer answer;
    if (!chart_.vertex_fan_at({x[lane], y[lane], z[lane]}, row[lane], col[lane], answer)) continue;
    distance[lane] = answer.distance;
    for (int axis = 0; axis < 3; ++axis) {
      surface[axis][lane] = answer.surface[axis];
      normal[axis][lane] = answer.normal[axis];
    }
  }
  look.distance = hn::Load(kD, distance);
  look.surface = {hn::Load(kD, surface[0]), hn::Load(kD, surface[1]), hn::Load(kD, surface[2])};
  look.normal = {hn::Load(kD, normal[0]), hn::Load(kD, normal[1]), hn::Load(kD, normal[2])};
}
