// SPDX-License-Identifier: Apache-2.0
//
// Layer 3 of Chart (chart_search.hpp) for the entries of one part. Most searches end within two steps; those
// that do not are gathered from all vectors and go on together.

/// Searches under way: Chart::third_layer. The next step starts from the nearest place so far.
struct Walk {
  V3 p;
  V row, col, square, d_row, d_col, gain;  // gain: Chart::Step
  VI cell_row, cell_col;
  V3 point, normal;  // normal: unnormalised
  V3 way;            // Chart::Step
  V on_rim;          // 1 or 0
};
constexpr int kWalkFields = 19;  // those of float
HWY_INLINE void fields_of(Walk& walk, V* (&fields)[kWalkFields]) {
  V* const all_fields[] = {&walk.p.x,     &walk.p.y,      &walk.p.z,      &walk.row,      &walk.col,
                           &walk.square,  &walk.d_row,    &walk.d_col,    &walk.point.x,  &walk.point.y,
                           &walk.point.z, &walk.normal.x, &walk.normal.y, &walk.normal.z, &walk.on_rim,
                           &walk.gain,    &walk.way.x,    &walk.way.y,    &walk.way.z};
  std::copy_n(all_fields, kWalkFields, fields);
}

/// Walks that are not over; entries are numbers of the part's.
struct alignas(64) Pending {
  float values[kWalkFields][kPadded];
  std::int32_t cell_row[kPadded], cell_col[kPadded], entry[kPadded];
  std::uint32_t count = 0;
};

/// Walks that ended in cells with a vertex sample.
struct alignas(64) Fans {
  float x[kPadded], y[kPadded], z[kPadded], row[kPadded], col[kPadded], on_rim[kPadded];
  std::int32_t cell_row[kPadded], cell_col[kPadded], entry[kPadded];
  std::int32_t place[kPadded], code[kPadded];  // of the sample: Resident::fan_place, fan_code
  std::uint32_t count = 0;
};

/// Entries set aside, so that vectors are full.
struct alignas(64) EntryList {
  std::int32_t entry[kPadded];
  std::uint32_t count = 0;

  HWY_INLINE void append(VI entries, M lanes) noexcept {
    if (none(lanes)) return;
    const Packing packed(lanes);
    hn::StoreU(packed(entries), kDI, entry + count);
    count += packed.count();
  }
};

class Walker {
 public:
  Walker(const Looker& looker, const Wants& wants, Entries& entries) noexcept
      : looker_(looker), part_(looker.part()), wants_(wants), entries_(entries) {}

  /// Refines those of the entries [begin, end) for whose points `asked` is not 0: Chart::look.
  HWY_NOINLINE void refine(std::uint32_t begin, std::uint32_t end, const std::int32_t* asked) noexcept {
    EntryList aside;
    for (std::uint32_t i = begin; i < end; i += lane_count()) {
      const VI wished = hn::GatherIndex(kDI, asked, hn::LoadU(kDI, entries_.point + i));
      const M wanted = hn::And(hn::FirstN(kD, end - i), as_float(hn::Gt(wished, hn::Zero(kDI))));
      if (!none(wanted)) set_out(i, wanted, aside);
    }
    set_out_strays(aside);
    go_on();
    if (fans_.count > 0) fans();
    set_out_again(begin, end, kAgain, aside);
  }
  /// Finds, for layer 2, the surface near inner points above which it knows none: Chart::look.
  HWY_NOINLINE void find_lost(std::uint32_t begin, std::uint32_t end) noexcept {
    EntryList lost;
    set_out_again(begin, end, kAgain | kInside, lost);
  }

 private:
  static constexpr int kFirstSteps = 2;
  static constexpr std::uint32_t kNobody = kMostEntries;  // an entry that nobody reads

  SQMAP_KERNEL void solve(Walk& walk, const VPatch& patch, const V3& error, M lanes) const noexcept;
  SQMAP_KERNEL M advance(Walk& walk, VCell& cell, M active) const noexcept;
  /// Lanes whose next step is not worth its while.
  HWY_INLINE M is_over(const Walk& walk) const noexcept {
    const float least_gain = kLeastGain * part_.depth_step;
    return hn::Or(hn::Lt(hn::Abs(walk.d_row) + hn::Abs(walk.d_col), all(kLeastCellStep)),
                  hn::Lt(walk.gain * walk.gain, all(least_gain * least_gain) * walk.square));
  }
  SQMAP_KERNEL Walk begin(const V3& p, V row, V col, VCell& cell, M& eligible) const noexcept;
  HWY_NOINLINE V find_beside(const V3& p, M lanes, V& row, V& col) const noexcept;
  HWY_NOINLINE V find_named(const V3& p, M lanes, V& row, V& col) const noexcept;
  HWY_NOINLINE void set_out(std::uint32_t i, M wanted, EntryList& strays) noexcept;
  HWY_NOINLINE void set_out_strays(const EntryList& strays) noexcept;
  HWY_NOINLINE void set_out_again(std::uint32_t begin, std::uint32_t end, std::int32_t needed,
                                  EntryList& remote) noexcept;
  SQMAP_KERNEL void go(Walk& walk, VCell& cell, VI entry, M lanes) noexcept;
  HWY_NOINLINE void go_on() noexcept;
  HWY_NOINLINE void keep(Walk& walk, VI entry, M lanes) noexcept;
  HWY_NOINLINE void end(const Walk& walk, VI entry, M lanes) noexcept;
  HWY_NOINLINE M set_aside(const Walk& walk, const VCell& cell, VI entry, M lanes) noexcept;
  HWY_NOINLINE void fans() noexcept;
  SQMAP_KERNEL void write(VI entry, M lanes, V row, V col, V on_rim, V distance, const V3& surface,
                          const V3& normal) noexcept;

  const Looker& looker_;
  const PartRecord& part_;
  const Wants& wants_;
  Entries& entries_;
  Pending pending_;
  Fans fans_;
  bool must_be_nearer_ = false;             ///< by kNearer than what is known
  std::uint32_t first_in_a_row_ = kNobody;  ///< what is written are entries in a row from here; kNobody: not
};

/// Chart::step_towards, for some lanes.
SQMAP_KERNEL void Walker::solve(Walk& walk, const VPatch& patch, const V3& error, M lanes) const noexcept {
  const V one = all(1.0F);
  const V a = dot3(patch.row, patch.row), b = dot3(patch.row, patch.col), c = dot3(patch.col, patch.col);
  const V f = dot3(patch.row, error), g = dot3(patch.col, error);
  const V product = a * c, determinant = product - b * b;
  const M regular = hn::Gt(determinant, all(kLeastAngle) * product);
  const M rows_only = hn::AndNot(regular, hn::Gt(a, hn::Zero(kD)));
  const V inverse = one / pick(regular, determinant, pick(rows_only, a, one));
  const V d_row = pick(regular, (c * f - b * g) * inverse, hn::IfThenElseZero(rows_only, f * inverse));
  const V d_col = hn::IfThenElseZero(regular, (a * g - b * f) * inverse);
  const V most_row = all(kMostCells * looker_.size());
  V most_col = least(all(looker_.turn() * 0.125F), most_row);
  if (!none(hn::And(lanes, hn::Gt(hn::Abs(d_col), most_col)))) {
    const V slimness =
        hn::Sqrt(a / most(most(c, all(kLeastAngle) * a), all(std::numeric_limits<float>::min())));
    most_col = least(all(looker_.turn() * 0.125F), most_row * most(slimness, one));
  }
  const V short_row = limited(d_row, hn::Neg(most_row), most_row);
  const V short_col = limited(d_col, hn::Neg(most_col), most_col);
  walk.d_row = pick(lanes, short_row, walk.d_row);
  walk.d_col = pick(lanes, short_col, walk.d_col);
  walk.gain = pick(lanes, f * short_row + g * short_col, walk.gain);
  walk.way = pick(lanes, short_row * patch.row + short_col * patch.col, walk.way);
}

/// `eligible`: the lanes whose cell bounds a patch; the others' walks mean nothing.
SQMAP_KERNEL Walk Walker::begin(const V3& p, V row, V col, VCell& cell, M& eligible) const noexcept {
  cell = looker_.cell_at(row, col);
  eligible = looker_.read(cell).eligible;
  const VPatch patch = looker_.patch_at(cell, row, col);
  const V3 error = p - patch.point;
  Walk walk;
  walk.p = p;
  walk.row = row;
  walk.col = col;
  walk.square = dot3(error, error);
  walk.cell_row = cell.row;
  walk.cell_col = cell.col;
  walk.point = patch.point;
  walk.normal = cross3(patch.col, patch.row);
  walk.on_rim = walk.d_row = walk.d_col = walk.gain = hn::Zero(kD);
  walk.way = {walk.gain, walk.gain, walk.gain};
  const M everyone = hn::Eq(walk.on_rim, walk.on_rim);
  solve(walk, patch, error, everyone);
  return walk;
}

/// One step of the active lanes; those that are not over. `cell` is that of (row, col).
SQMAP_KERNEL M Walker::advance(Walk& walk, VCell& cell, M active) const noexcept {
  const V zero = hn::Zero(kD), one = all(1.0F), least_step = all(kLeastCellStep), size = all(looker_.size());
  active = hn::AndNot(is_over(walk), active);
  if (none(active)) return active;
  V next_row = limited(walk.row + walk.d_row, zero, all(looker_.last_row()));
  const V moved = walk.col + walk.d_col;
  V next_col = looker_.wrapped(moved);
  VCell next = looker_.cell_at(next_row, next_col);
  M stays = hn::And(active, hn::Not(looker_.read(next).eligible));
  if (!none(stays)) {  // half the way, where that is another cell
    const V half_row = limited(walk.row + all(0.5F) * walk.d_row, zero, all(looker_.last_row()));
    const V half_col = looker_.wrapped(walk.col + all(0.5F) * walk.d_col);
    VCell between = looker_.cell_at(half_row, half_col);
    const M open = looker_.read(between).eligible;
    const M leaves = as_float(hn::Or(hn::Ne(between.row, cell.row), hn::Ne(between.col, cell.col)));
    const M goes = hn::And(stays, hn::And(open, leaves));
    next_row = pick(goes, half_row, next_row);
    next_col = pick(goes, half_col, next_col);
    next.row = pick(goes, between.row, next.row);
    next.col = pick(goes, between.col, next.col);
    for (int k = 0; k < 4; ++k) next.depth[k] = pick(goes, between.depth[k], next.depth[k]);
    stays = hn::AndNot(goes, stays);
  }
  if (!none(stays)) {
    const V low_row = to_float(cell.row), low_col = to_float(cell.col);
    const V rim_row = limited(walk.row + walk.d_row, low_row, low_row + size);
    const V rim_col = limited(moved, low_col, low_col + size);
    const M ends =
        hn::And(stays, hn::Lt(hn::Abs(rim_row - walk.row) + hn::Abs(rim_col - walk.col), least_step));
    active = hn::AndNot(ends, active);
    next_row = pick(stays, rim_row, next_row);
    next_col = pick(stays, least(rim_col, all(std::nextafter(looker_.turn(), 0.0F))), next_col);
    next.row = pick(stays, cell.row, next.row);
    next.col = pick(stays, cell.col, next.col);
    for (int k = 0; k < 4; ++k) next.depth[k] = pick(stays, cell.depth[k], next.depth[k]);
  }
  const VPatch patch = looker_.patch_at(next, next_row, next_col);
  const V3 error = walk.p - patch.point;
  const V square = dot3(error, error);
  const M better = hn::And(active, hn::Lt(square, walk.square));
  walk.square = pick(better, square, walk.square);
  walk.row = pick(better, next_row, walk.row);
  walk.col = pick(better, next_col, walk.col);
  walk.cell_row = cell.row = pick(better, next.row, cell.row);
  walk.cell_col = cell.col = pick(better, next.col, cell.col);
  for (int k = 0; k < 4; ++k) cell.depth[k] = pick(better, next.depth[k], cell.depth[k]);
  walk.point = pick(better, patch.point, walk.point);
  walk.on_rim = pick(better, hn::IfThenElseZero(stays, one), walk.on_rim);
  if (wants_.normal) walk.normal = pick(better, cross3(patch.col, patch.row), walk.normal);
  const V kept = pick(active, all(kBackStep), one);
  walk.d_row = walk.d_row * kept;
  walk.d_col = walk.d_col * kept;
  walk.gain = walk.gain * kept;
  walk.way = kept * walk.way;
  solve(walk, patch, error, better);
  return active;
}

SQMAP_KERNEL void Walker::go(Walk& walk, VCell& cell, VI entry, M lanes) noexcept {
  M active = lanes;
  for (int step = 0; step < kFirstSteps; ++step) {
    active = advance(walk, cell, active);
    if (none(active)) break;
  }
  // Lanes that advance() would end at once are over, too.
  active = hn::AndNot(is_over(walk), active);
  const M over = hn::AndNot(active, lanes);
  if (!none(active)) keep(walk, entry, active);
  if (!none(over)) end(walk, entry, over);
}

HWY_NOINLINE void Walker::keep(Walk& walk, VI entry, M lanes) noexcept {
  V* fields[kWalkFields];
  fields_of(walk, fields);
  const std::uint32_t at = pending_.count;
  const Packing packed(lanes);
  for (int k = 0; k < kWalkFields; ++k) hn::StoreU(packed(*fields[k]), kD, pending_.values[k] + at);
  hn::StoreU(packed(walk.cell_row), kDI, pending_.cell_row + at);
  hn::StoreU(packed(walk.cell_col), kDI, pending_.cell_col + at);
  hn::StoreU(packed(entry), kDI, pending_.entry + at);
  pending_.count += packed.count();
}

HWY_NOINLINE void Walker::go_on() noexcept {
  for (std::uint32_t i = 0; i < pending_.count; i += lane_count()) {
    Walk walk;
    V* fields[kWalkFields];
    fields_of(walk, fields);
    const M lanes = hn::FirstN(kD, pending_.count - i);
    // Beyond the last lie leftovers, whose cells may be another part's.
    for (int k = 0; k < kWalkFields; ++k)
      *fields[k] = hn::IfThenElseZero(lanes, hn::LoadU(kD, pending_.values[k] + i));
    walk.cell_row = pick(lanes, hn::LoadU(kDI, pending_.cell_row + i), hn::Zero(kDI));
    walk.cell_col = pick(lanes, hn::LoadU(kDI, pending_.cell_col + i), hn::Zero(kDI));
    VCell cell = looker_.cell_of(walk.cell_row, walk.cell_col);
    looker_.read(cell);
    M active = lanes;
    for (int step = kFirstSteps; step < kThirdLayerSteps; ++step) {
      active = advance(walk, cell, active);
      if (none(active)) break;
    }
    end(walk, hn::LoadU(kDI, pending_.entry + i), lanes);
  }
  pending_.count = 0;
}

/// Chart::start_beside, which moves (row, col): how far from the start, squared; infinite where there is
/// none.
HWY_NOINLINE V Walker::find_beside(const V3& p, M lanes, V& row, V& col) const noexcept {
  const V half = all(looker_.size() / 2), zero = hn::Zero(kD);
  const VCell middle = looker_.cell_at(row, col);
  const V mid_row = to_float(middle.row) + half, mid_col = to_float(middle.col) + half;
  const V infinity = all(std::numeric_limits<float>::infinity());
  V best = infinity;
  M seeking = lanes;
  for (int ring = 0; ring < kRings && !none(seeking); ++ring) {
    const V step = all(static_cast<float>(looker_.stride() << ring));
    for (int k = 0; k < 9; ++k) {
      if (k == 4) continue;  // the middle
      const int rows_up = k / 3 - 1;
      const V here_row = mid_row + all(static_cast<float>(rows_up)) * step;
      const V here_col = looker_.wrapped(mid_col + all(static_cast<float>(k % 3 - 1)) * step);
      M open = hn::And(hn::Gt(here_row, zero), hn::Lt(here_row, all(looker_.last_row())));
      open = hn::And(seeking, hn::And(open, hn::Ge(here_col, zero)));
      VCell cell = looker_.cell_at(here_row, here_col);
      open = hn::And(open, looker_.read(cell).eligible);
      if (none(open)) continue;
      const V3 error = p - looker_.patch_at(cell, here_row, here_col).point;
      const V square = dot3(error, error);
      const M better = hn::And(open, hn::Lt(square, best));
      best = pick(better, square, best);
      row = pick(better, here_row, row);
      col = pick(better, here_col, col);
    }
    seeking = hn::AndNot(hn::Lt(best, infinity), seeking);
  }
  return best;
}

/// Chart::start_named, which sets (row, col): how far from the start, squared; infinite where there is none.
HWY_NOINLINE V Walker::find_named(const V3& p, M lanes, V& row, V& col) const noexcept {
  V best = all(std::numeric_limits<float>::infinity());
  VI chosen = all_int(StartTable::kNone);
  row = col = hn::Zero(kD);
  const V3 straight = straightened(part_.bend, p);
  for (int k = 0; k < StartTable::kAround; ++k) {
    const VI name = pick(lanes, looker_.start_of(straight, k), all_int(StartTable::kNone));
    // Most of the boxes around a point name the same.
    const M is_new =
        hn::And(as_float(hn::Ne(name, all_int(StartTable::kNone))), as_float(hn::Ne(name, chosen)));
    if (none(is_new)) continue;
    const VI known = pick(is_new, name, hn::Zero(kDI));
    const V here_row = looker_.start_row(known), here_col = looker_.start_col(known);
    VCell cell = looker_.cell_at(here_row, here_col);
    const M open = hn::And(is_new, looker_.read(cell).eligible);
    if (none(open)) continue;
    const V3 error = p - looker_.patch_at(cell, here_row, here_col).point;
    const V square = dot3(error, error);
    const M better = hn::And(open, hn::Lt(square, best));
    best = pick(better, square, best);
    row = pick(better, here_row, row);
    col = pick(better, here_col, col);
    chosen = pick(better, name, chosen);
  }
  return best;
}

/// From the foot. Inner points that have no patch there are set aside.
HWY_NOINLINE void Walker::set_out(std::uint32_t i, M wanted, EntryList& strays) noexcept {
  const VI flags = hn::LoadU(kDI, entries_.flags + i), entry = hn::Iota(kDI, static_cast<std::int32_t>(i));
  const auto has = [&](std::int32_t flag) HWY_ATTR {
    return as_float(hn::Ne(hn::And(flags, all_int(static_cast<std::uint32_t>(flag))), hn::Zero(kDI)));
  };
  const M at_foot = hn::And(wanted, has(kPatch)), inside = hn::And(wanted, has(kInside));
  strays.append(entry, hn::AndNot(at_foot, inside));
  if (none(at_foot)) return;
  const VI again = pick(at_foot, all_int(kAgain), hn::Zero(kDI));
  hn::StoreU(hn::Or(flags, again), kDI, entries_.flags + i);
  const V row = hn::LoadU(kD, entries_.foot_row + i), col = hn::LoadU(kD, entries_.foot_col + i);
  VCell cell;
  M eligible;
  Walk walk = begin(load3(entries_.x, entries_.y, entries_.z, i), row, col, cell, eligible);
  first_in_a_row_ = i;
  go(walk, cell, entry, at_foot);
  first_in_a_row_ = kNobody;
}

/// Beside the foot or, where that is nearer, where the table of starts says.
HWY_NOINLINE void Walker::set_out_strays(const EntryList& strays) noexcept {
  const V infinity = all(std::numeric_limits<float>::infinity());
  for (std::uint32_t i = 0; i < strays.count; i += lane_count()) {
    const M wanted = hn::FirstN(kD, strays.count - i);
    const VI entry = pick(wanted, hn::LoadU(kDI, strays.entry + i), all_int(kNobody));
    const auto field = [&](const float* values) HWY_ATTR {
      return hn::IfThenElseZero(wanted, hn::GatherIndex(kD, values, entry));
    };
    const V3 p{field(entries_.x), field(entries_.y), field(entries_.z)};
    V row = field(entries_.foot_row), col = field(entries_.foot_col), named_row, named_col;
    const V beside = find_beside(p, wanted, row, col), named = find_named(p, wanted, named_row, named_col);
    const M nearer = hn::Lt(named, beside);
    row = pick(nearer, named_row, row);
    col = pick(nearer, named_col, col);
    const M lanes = hn::And(wanted, hn::Lt(least(named, beside), infinity));
    if (none(lanes)) continue;
    VCell cell;
    M eligible;
    Walk walk = begin(p, row, col, cell, eligible);
    go(walk, cell, entry, lanes);
  }
}

/// From where the table of starts says, for points with the flags `needed` that are far from the surface that
/// was found; outer ones from what their own box names, unless that is where they are.
HWY_NOINLINE void Walker::set_out_again(std::uint32_t begin, std::uint32_t end, std::int32_t needed,
                                        EntryList& remote) noexcept {
  const V far = all(part_.far_from(looker_.stride()));
  remote.count = 0;
  for (std::uint32_t i = begin; i < end; i += lane_count()) {
    const VI flags = hn::LoadU(kDI, entries_.flags + i);
    M is_far = as_float(hn::Eq(hn::And(flags, hn::Set(kDI, needed)), hn::Set(kDI, needed)));
    is_far = hn::And(is_far, hn::FirstN(kD, end - i));
    is_far = hn::And(is_far, hn::Gt(hn::LoadU(kD, entries_.distance + i), far));
    if (none(is_far)) continue;
    const V3 straight = straightened(part_.bend, load3(entries_.x, entries_.y, entries_.z, i));
    const M named =
        looker_.is_named(straight, hn::LoadU(kD, entries_.row + i), hn::LoadU(kD, entries_.col + i));
    const M outer = as_float(hn::Eq(hn::And(flags, all_int(kInside)), hn::Zero(kDI)));
    is_far = hn::AndNot(hn::And(named, outer), is_far);
    remote.append(hn::Iota(kDI, static_cast<std::int32_t>(i)), is_far);
  }
  if (remote.count == 0) return;
  must_be_nearer_ = true;
  for (std::uint32_t i = 0; i < remote.count; i += lane_count()) {
    const M lanes = hn::FirstN(kD, remote.count - i);
    const VI entry = pick(lanes, hn::LoadU(kDI, remote.entry + i), all_int(kNobody));
    const auto field = [&](const float* values)
                           HWY_ATTR { return hn::IfThenElseZero(lanes, hn::GatherIndex(kD, values, entry)); };
    const V3 p{field(entries_.x), field(entries_.y), field(entries_.z)};
    const VI flags = hn::GatherIndex(kDI, entries_.flags, entry);
    const M outer = hn::And(lanes, as_float(hn::Eq(hn::And(flags, all_int(kInside)), hn::Zero(kDI))));
    const M inner = hn::AndNot(outer, lanes);
    V row = hn::Zero(kD), col = row;
    M found = outer;
    if (!none(inner)) {
      const M near = hn::Lt(find_named(p, inner, row, col), all(std::numeric_limits<float>::infinity()));
      found = hn::Or(outer, hn::And(inner, near));
    }
    if (!none(outer)) {
      const VI name = looker_.start_of(straightened(part_.bend, p), StartTable::kOwn);
      row = pick(outer, looker_.start_row(name), row);
      col = pick(outer, looker_.start_col(name), col);
      found = hn::AndNot(hn::And(outer, as_float(hn::Eq(name, all_int(StartTable::kNone)))), found);
    }
    VCell cell;
    M eligible;
    Walk walk = this->begin(p, row, col, cell, eligible);
    const M open = hn::And(found, eligible);
    if (!none(open)) go(walk, cell, entry, open);
  }
  go_on();
  if (fans_.count > 0) fans();
  must_be_nearer_ = false;
}

HWY_NOINLINE void Walker::end(const Walk& walk, VI entry, M lanes) noexcept {
  VCell cell = looker_.cell_of(walk.cell_row, walk.cell_col);
  if (looker_.stride() == 1 && part_.fans.count > 0) {
    const M held = hn::And(lanes, looker_.block_holds(part_.fans, cell.texel[0]));
    if (!none(held)) lanes = hn::AndNot(set_aside(walk, cell, entry, held), lanes);
  }
  const V3 further = walk.point + walk.way;
  const V rest = dot3(walk.p - further, walk.p - further);
  const M nearer =
      hn::And(hn::And(is_over(walk), hn::Eq(walk.on_rim, hn::Zero(kD))), hn::Lt(rest, walk.square));
  const V distance = hn::Sqrt(pick(nearer, rest, walk.square));
  V3 normal = walk.normal;
  if (wants_.normal) {
    const M beside_pole =
        hn::Or(hn::Lt(walk.row, all(kBesidePole)), hn::Gt(walk.row, all(looker_.last_row() - kBesidePole)));
    if (!none(hn::And(lanes, beside_pole))) {
      looker_.read(cell);
      normal = pick(beside_pole, looker_.patch_across(cell, walk.row, walk.col), normal);
    }
  }
  write(entry, lanes, walk.row, walk.col, walk.on_rim, distance, pick(nearer, further, walk.point), normal);
}

SQMAP_KERNEL void Walker::write(VI entry, M lanes, V row, V col, V on_rim, V distance, const V3& surface,
                                const V3& normal) noexcept {
  const VI nobody = all_int(kNobody), at = pick(lanes, entry, nobody);
  const VI flags = hn::GatherIndex(kDI, entries_.flags, at);
  // A crossing that is on no patch stands where it is nearer.
  M has_rival = as_float(hn::Ne(hn::And(flags, all_int(kPoint)), hn::Zero(kDI)));
  if (must_be_nearer_) has_rival = lanes;
  if (!none(hn::And(lanes, has_rival))) {
    const V known = all(must_be_nearer_ ? kNearer : 1.0F) * hn::GatherIndex(kD, entries_.distance, at);
    lanes = hn::AndNot(hn::AndNot(hn::Lt(distance, known), has_rival), lanes);
  }
  const VI faces = pick(hn::Gt(on_rim, hn::Zero(kD)), hn::Zero(kDI), all_int(kFaces));
  const VI others = hn::AndNot(all_int(kFaces), flags);
  const VI new_flags = hn::Or(hn::Or(others, faces), all_int(kRefined | kPatch));
  const auto put_all = [&](auto put) HWY_ATTR {
    put(new_flags, kDI, entries_.flags);
    put(distance, kD, entries_.distance);
    put(row, kD, entries_.row);
    put(col, kD, entries_.col);
    if (wants_.surface || wants_.normal) {
      put(surface.x, kD, entries_.surface[0]);
      put(surface.y, kD, entries_.surface[1]);
      put(surface.z, kD, entries_.surface[2]);
    }
    if (!wants_.normal) return;
    put(normal.x, kD, entries_.normal[0]);
    put(normal.y, kD, entries_.normal[1]);
    put(normal.z, kD, entries_.normal[2]);
  };
  if (first_in_a_row_ < kNobody) {  // a scattering store costs as much as a lane each
    put_all([&](auto value, auto tag, auto* values) HWY_ATTR {
      hn::BlendedStore(value, hn::RebindMask(tag, lanes), tag, values + first_in_a_row_);
    });
  } else {
    const VI to = pick(lanes, at, nobody);
    put_all([&](auto value, auto tag, auto* values) HWY_ATTR { hn::ScatterIndex(value, tag, values, to); });
  }
}
