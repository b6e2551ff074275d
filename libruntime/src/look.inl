// SPDX-License-Identifier: Apache-2.0
//
// Layer 2 of Chart (chart.hpp) for a vector of points. Further sheets of a ray, which few points need, are
// read a point at a time.

/// What layer 2 knows of the lanes of one vector.
struct Look {
  V row, col, crossing, distance, certainty, foot_row, foot_col;
  VI flags;
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

/// One part at one layer and level, with what every step of a look needs of it.
class Looker {
 public:
  Looker(const Resident& resident, const PartRecord& part, const Tables& tables,
         const QueryOptions& options) noexcept
      : resident_(resident),
        part_(part),
        tables_(tables),
        stride_(part.stride_at(options.level)),
        third_(layer_for(part, options) == Layer::kThree),
        last_row_(static_cast<float>(part.rows - 1)),
        turn_(static_cast<float>(part.cols)),
        size_(static_cast<float>(stride_)),
        inverse_size_(1.0F / size_) {}

  /// Layer 2. Wants::reach decides about kWithin.
  SQMAP_KERNEL Look look(const V3& p, M wanted, float reach) const noexcept;
  /// Where layer 2 says the surface is, and its normal there.
  HWY_INLINE V3 surface_at(V row, V col, V crossing) const noexcept {
    const Sample r = sample_at(tables_, row, col);
    const V3 straight = r.point - crossing * r.normal;
    if (part_.bend.is_none()) [[likely]]
      return straight;
    return bent_point(part_.bend, turn_at(part_.bend, straight), straight);
  }
  HWY_INLINE V3 normal_at(M lanes, V row, V col, M leaving, M on_patch) const noexcept {
    VCell cell = cell_at(row, col);
    read(cell);
    V3 normal = direction3(patch_across(cell, row, col));
    if (!none(hn::AndNot(on_patch, lanes))) normal = pick(on_patch, normal, shape_normal_at(row, col));
    return pick(leaving, all(-1.0F), all(1.0F)) * normal;
  }
  /// Chart::shape_normal_at.
  HWY_INLINE V3 shape_normal_at(V row, V col) const noexcept {
    const Sample r = sample_at(tables_, row, col);
    if (part_.bend.is_none()) [[likely]]
      return r.normal;
    const VTurn turn = turn_at(part_.bend, r.point);
    return turned(part_.bend, turn, r.normal, r.normal.z / turn.stretch);
  }
  /// Resident::start, of a place in the straight frame.
  HWY_INLINE VI start_of(const V3& p, int k) const noexcept {
    const StartTable& starts = part_.starts;
    const auto along = [&](V coordinate, int axis) HWY_ATTR {
      const auto count = static_cast<float>(starts.boxes[axis]);
      const V place = (coordinate * all(part_.inverse_extents[axis]) + all(1.0F)) * all(0.5F * count) +
                      all(StartTable::shift(k, axis));
      return to_int(limited(place, hn::Zero(kD), all(count - 1.0F)));
    };
    const VI slice = along(p.z, 2) * all_int(starts.boxes[1]) + along(p.y, 1);
    const VI box = slice * all_int(starts.boxes[0]) + along(p.x, 0);
    const VI bit = box * all_int(StartTable::kBits);
    const VU word = gather_bytes(resident_.bytes() + starts.at, hn::ShiftRight<3>(bit)) >>
                    hn::And(hn::BitCast(kDU, bit), hn::Set(kDU, 7U));
    return hn::BitCast(kDI, hn::And(word, hn::Set(kDU, StartTable::kNone)));
  }
  /// Of what Resident::start names.
  HWY_INLINE V start_row(VI start) const noexcept {
    return start_place(hn::ShiftRightSame(start, part_.starts.col_bits));
  }
  HWY_INLINE V start_col(VI start) const noexcept {
    return start_place(hn::And(start, all_int((1U << part_.starts.col_bits) - 1U)));
  }

  /// Whether Chart::start_away stays.
  HWY_INLINE M is_named(const V3& straight, V row, V col) const noexcept {
    const VI name = start_of(straight, StartTable::kOwn);
    const V reach = all(part_.starts.reach()), across = hn::Abs(col - start_col(name));
    const M near_row = hn::Le(hn::Abs(row - start_row(name)), reach);
    return hn::And(near_row, hn::Le(least(across, all(turn_) - across), reach));
  }

  // What Walker builds on.

  HWY_INLINE VCell cell_of(VI row, VI col) const noexcept {
    VCell cell;
    cell.row = row;
    cell.col = col;
    const VI next = next_col(col);
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
  /// Chart::wrapped.
  HWY_INLINE V wrapped(V col) const noexcept {
    const V turn = all(turn_), raised = pick(hn::Lt(col, hn::Zero(kD)), col + turn, col);
    return pick(hn::Lt(raised, turn), raised, raised - turn);
  }
  HWY_INLINE V depth_of(VI code) const noexcept {
    return all(part_.depth_min) + to_float(code) * all(part_.depth_step);
  }
  /// Reads the texels of the corners of (cell.row, cell.col); sets their depths.
  SQMAP_KERNEL Corners read(VCell& cell) const noexcept {
    const std::uint8_t* base = resident_.bytes() + part_.texels_at;
    const VU mask = hn::Set(kDU, (1U << part_.texel_bits) - 1U);
    const auto word_at = [&](VI place) HWY_ATTR {
      const VI bit = place * all_int(part_.texel_bits);
      return gather_bytes(base, hn::ShiftRight<3>(bit)) >> hn::And(hn::BitCast(kDU, bit), hn::Set(kDU, 7U));
    };
    const auto texel_of = [&](VU word) HWY_ATTR { return hn::BitCast(kDI, hn::And(word, mask)); };
    Corners corners;
    VI row_word[4];  // of the lower row and its next, of the upper row and its next
    row_words(cell.row, row_word);
    for (int k = 0; k < 4; k += 2) {
      const VRow row = row_of(row_word[k], row_word[k + 1]);
      // Resident::texel. The next column is the next of those held, or neither is.
      const VI left = place_of(cell.col, row.first);
      const VI right = stride_ == 1 ? left + all_int(1) : place_of(next_col(cell.col), row.first);
      const VU left_word = word_at(row.at + hn::Min(left, row.count));
      // Two neighbours fit one word.
      const VU right_word = stride_ == 1 && part_.texel_bits <= 12
                                ? left_word >> hn::Set(kDU, part_.texel_bits)
                                : word_at(row.at + hn::Min(right, row.count));
      corners.texel[k] = hn::IfThenElse(hn::Lt(left, row.count), texel_of(left_word), row.others);
      corners.texel[k + 1] = hn::IfThenElse(hn::Lt(right, row.count), texel_of(right_word), row.others);
    }
    const VI miss = all_int(part_.miss_code());
    const VI highest =
        hn::Max(hn::Max(corners.texel[0], corners.texel[1]), hn::Max(corners.texel[2], corners.texel[3]));
    corners.eligible = as_float(hn::Lt(highest, miss));
    for (int k = 0; k < 4; ++k) cell.depth[k] = depth_of(hn::And(corners.texel[k], miss));
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
    const Sample r = sample_at(tables_, row, col);
    VPatch patch{r.point - depth * r.normal, r.point_row - depth_row * r.normal - depth * r.normal_row,
                 r.point_col - depth_col * r.normal - depth * r.normal_col};
    if (!part_.bend.is_none()) [[unlikely]]
      bend(patch);
    return patch;
  }
  SQMAP_KERNEL V3 patch_across(const VCell& cell, V row, V col) const noexcept {
    const VPatch patch = patch_at(cell, limited(row, all(kBesidePole), all(last_row_ - kBesidePole)), col);
    return cross3(patch.col, patch.row);
  }
  /// Chart::offset.
  SQMAP_KERNEL V offset(V row, V col, float edge) const noexcept;
  HWY_INLINE M block_holds(const SideList& list, VI texel) const noexcept {
    static_assert(Resident::kBlock == 8);
    const VI block = hn::ShiftRight<3>(texel);
    const VU word = gather_bytes(resident_.bytes() + list.blocks_at, hn::ShiftRight<3>(block));
    const VU bit = (word >> hn::And(hn::BitCast(kDU, block), hn::Set(kDU, 7U))) & hn::Set(kDU, 1U);
    return hn::RebindMask(kD, hn::Ne(bit, hn::Zero(kDU)));
  }

  const Resident& resident() const noexcept { return resident_; }
  const PartRecord& part() const noexcept { return part_; }
  std::uint32_t stride() const noexcept { return stride_; }
  float size() const noexcept { return size_; }
  float last_row() const noexcept { return last_row_; }
  float turn() const noexcept { return turn_; }

 private:
  struct VRow {
    VI at, first, count;  // MapRow
    VI others;            // the texels that are not held
  };
  HWY_INLINE VI next_col(VI col) const noexcept {
    const VI right = col + all_int(stride_);
    return hn::IfThenElseZero(hn::Lt(right, all_int(part_.cols)), right);
  }
  HWY_INLINE void row_words(VI row, VI (&words)[4]) const noexcept {
    const std::uint8_t* base = resident_.bytes() + part_.texels_at - part_.row_bytes();
    const auto size = static_cast<std::int32_t>(part_.row_word_bytes());
    const VI mask = hn::BitCast(kDI, hn::Set(kDU, part_.row_word_mask()));
    const auto word_at = [&](VI at)
                             HWY_ATTR { return hn::And(hn::BitCast(kDI, gather_bytes(base, at)), mask); };
    const VI next = all_int(size), at = row * next, above = at + all_int(stride_ * size);
    words[0] = word_at(at);
    words[1] = word_at(at + next);
    words[2] = stride_ == 1 ? words[1] : word_at(above);
    words[3] = word_at(above + next);
  }
  /// Resident::row.
  HWY_INLINE VRow row_of(VI word, VI next) const noexcept {
    const int bits = static_cast<int>(part_.row_place_bits());
    const VI mask = all_int((1U << part_.row_place_bits()) - 1U);
    VI at = hn::And(word, mask), end = hn::And(next, mask);
    if (part_.row_shift != 0) [[unlikely]] {
      at = hn::ShiftLeftSame(at, part_.row_shift);
      end = hn::ShiftLeftSame(end, part_.row_shift);
    }
    const VU inside = hn::ShiftRightSame(hn::BitCast(kDU, word), bits - part_.code_bits);
    const VU start = hn::And(inside, hn::Set(kDU, 1U << part_.code_bits));
    return {at, hn::BitCast(kDI, hn::ShiftRightSame(hn::BitCast(kDU, word), bits + 1)), end - at,
            hn::BitCast(kDI, hn::Or(start, hn::Set(kDU, part_.miss_code())))};
  }
  HWY_INLINE VI place_of(VI col, VI first) const noexcept {
    const VU place = hn::BitCast(kDU, col - first);  // below 0: beyond all others
    return hn::BitCast(kDI, hn::Min(place, place + hn::Set(kDU, std::uint32_t{part_.cols})));
  }
  HWY_NOINLINE void bend(VPatch& patch) const noexcept {
    const VTurn turn = turn_at(part_.bend, patch.point);
    patch.point = bent_point(part_.bend, turn, patch.point);
    patch.row = turned(part_.bend, turn, patch.row, turn.stretch * patch.row.z);
    patch.col = turned(part_.bend, turn, patch.col, turn.stretch * patch.col.z);
  }
  /// StartTable::place.
  HWY_INLINE V start_place(VI k) const noexcept {
    const StartTable& starts = part_.starts;
    const VI first = hn::ShiftLeftSame(k, starts.step_shift) + all_int((1U << starts.step_shift) / 2);
    return to_float(first) + all(0.5F);
  }
  HWY_NOINLINE V over_fans(M lanes, const VCell& cell, V s, V t, V depth) const noexcept;
  HWY_NOINLINE void further_sheets(M lanes, VI texel, V shift, V depth, V& gap, V& crossing, V& inside,
                                   V& leaving, V& later) const noexcept;

  const Resident& resident_;
  const PartRecord& part_;
  const Tables& tables_;
  std::uint32_t stride_;
  bool third_;
  float last_row_, turn_, size_, inverse_size_;
};

SQMAP_KERNEL V Looker::offset(V row, V col, float edge) const noexcept {
  struct Centre {
    V3 point, normal;
    M eligible;
  };
  const auto centre_at = [&](V r, V c) HWY_ATTR {
    VCell cell = cell_at(r, wrapped(c));
    const M eligible = read(cell).eligible;
    const V half = all(size_ / 2);
    const VPatch patch = patch_at(cell, to_float(cell.row) + half, to_float(cell.col) + half);
    return Centre{patch.point, normalized3(cross3(patch.col, patch.row)), eligible};
  };
  const V zero = hn::Zero(kD), last = all(last_row_ - 0.5F);
  const Centre here = centre_at(row, col);
  V curvature = zero;
  for (const auto& [d_row, d_col] : {std::pair{size_, 0.0F}, {-size_, 0.0F}, {0.0F, size_}, {0.0F, -size_}}) {
    const Centre there = centre_at(limited(row + all(d_row), zero, last), col + all(d_col));
    const V3 d = there.point - here.point;
    const V square = dot3(d, d);
    const M counts = hn::And(there.eligible, hn::Gt(square, zero));
    const V here_most = most(curvature, dot3(there.normal - here.normal, d) / square);
    curvature = pick(counts, here_most, curvature);
  }
  const V bend = all(edge) * curvature, one = all(1.0F), three = all(3.0F);
  return all(edge) * bend / (three * (one + hn::Sqrt(one + bend * bend / three)));
}

SQMAP_KERNEL Look Looker::look(const V3& p, M wanted, float reach) const noexcept {
  const VFoot foot = foot_of(tables_, straightened(part_.bend, p));
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
  V here = low + s * (high - low);
  if (third_ && stride_ == 1 && part_.fans.count > 0) {
    const M held = hn::And(hn::And(wanted, corners.eligible), block_holds(part_.fans, cell.texel[0]));
    if (!none(held)) here = over_fans(held, cell, s, t, here);
  }
  const V shift = hn::IfThenElseZero(corners.eligible, here - near_depth);
  const V shallow = least(least(depth[0], depth[1]), least(depth[2], depth[3]));
  const V deep = most(most(depth[0], depth[1]), most(depth[2], depth[3]));
  const V doubt =
      pick(corners.eligible, all(0.25F) * (deep - shallow) + all(part_.depth_step), foot.cell * all(size_));

  const VI miss = all_int(part_.miss_code());
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
  Look look;
  look.row = look.foot_row = foot.row;
  look.col = look.foot_col = foot.col;
  look.crossing = crossing;
  const V infinity = all(std::numeric_limits<float>::infinity());
  look.distance = pick(corners.eligible, gap, infinity);
  if (!part_.bend.is_none()) [[unlikely]] {  // the gap is that in the straight frame
    const V3 d = p - surface_at(foot.row, foot.col, crossing);
    const M has_gap = hn::And(corners.eligible, hn::Lt(gap, infinity));
    look.distance = pick(has_gap, hn::Sqrt(dot3(d, d)), look.distance);
  }
  // No patch, but a point of the surface: where the ray of the nearest texel crosses it.
  const M has_point = hn::And(hn::And(wanted, inside), hn::AndNot(corners.eligible, hit));
  if (!none(has_point)) {
    const V size = all(size_);
    const V node_row = to_float(cell.row) + hn::IfThenZeroElse(lower, size);
    const V node_col = to_float(cell.col) + hn::IfThenZeroElse(left, size);
    look.row = pick(has_point, node_row, look.row);
    look.col = pick(has_point, node_col, look.col);
    const V3 d = p - surface_at(look.row, look.col, crossing);
    look.distance = pick(has_point, hn::Sqrt(dot3(d, d)), look.distance);
  }
  const auto flag = [](M mask, std::int32_t bit)
                        HWY_ATTR { return pick(mask, hn::Set(kDI, bit), hn::Zero(kDI)); };
  const M on_no_patch = hn::Or(has_point, hn::And(corners.eligible, hn::Gt(later, half)));
  const M leaves = hn::Xor(hn::Gt(leaving, half), as_float(start));
  look.flags = hn::Or(hn::Or(flag(inside, kInside), flag(on_no_patch, kPoint)),
                      hn::Or(flag(leaves, kLeaving), flag(corners.eligible, kPatch)));
  if (reach > 0)
    look.flags = hn::Or(look.flags, flag(hn::Lt(all(part_.depth_min) - foot.depth, all(reach)), kWithin));
  // What the bounds prove may yet turn a point outside into one inside.
  const M inner = part_.bound_cells > 0 ? wanted : hn::And(inside, wanted);
  const M lost = hn::And(inner, hn::Eq(look.distance, all(std::numeric_limits<float>::infinity())));
  if (!third_) look.flags = hn::Or(look.flags, flag(lost, kAgain));
  const V sure = pick(as_float(mixed), most(foot.depth, zero), all(part_.sphere_radius));
  look.certainty = least(gap, sure) / most(doubt, all(kLeastDoubt * part_.sphere_radius));
  return look;
}

/// Chart::over_fan.
HWY_NOINLINE V Looker::over_fans(M lanes, const VCell& cell, V s, V t, V depth) const noexcept {
  HWY_ALIGN std::int32_t texels[kMostLanes];
  HWY_ALIGN float all_s[kMostLanes], all_t[kMostLanes], corners[4][kMostLanes], depths[kMostLanes];
  hn::Store(cell.texel[0], kDI, texels);
  hn::Store(s, kD, all_s);
  hn::Store(t, kD, all_t);
  for (int k = 0; k < 4; ++k) hn::Store(cell.depth[k], kD, corners[k]);
  hn::Store(depth, kD, depths);
  for (std::uint32_t left = bits_of(lanes); left != 0; left &= left - 1) {
    const int lane = std::countr_zero(left);
    const std::uint32_t position = resident_.find_fan(part_, static_cast<std::uint32_t>(texels[lane]));
    if (position >= part_.fans.count) continue;
    const float corner[4] = {corners[0][lane], corners[1][lane], corners[2][lane], corners[3][lane]};
    depths[lane] = resident_.fan_depth_at(part_, position, corner, all_s[lane], all_t[lane]);
  }
  return hn::Load(kD, depths);
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
    for (std::uint32_t k = resident_.find(part_, part_.sheets, key);
         k < part_.sheets.count && resident_.key(part_, part_.sheets, k) == key; ++k, odd = !odd) {
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
