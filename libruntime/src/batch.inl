// SPDX-License-Identifier: Apache-2.0
//
// A chunk of points against all parts: which superquadrics hold which points (cull.inl), what each of their
// charts says (look.inl, walk.inl), and what the charts say together. Each step is done for whole vectors of
// entries, part by part.

/// Unpacked curves of the parts that were asked last.
class Charts {
 public:
  explicit Charts(const Resident& resident) noexcept : resident_(resident) {
    std::fill(std::begin(held_), std::end(held_), kNowhere);
  }
  const Tables& of(std::uint32_t part) noexcept {
    // Parts of one chunk tend to be few: the slots go round.
    for (std::uint32_t k = 0; k < kTables; ++k)
      if (held_[k] == part) return tables_[k];
    const std::uint32_t slot = next_;
    next_ = (next_ + 1) % kTables;
    held_[slot] = part;
    Tables& tables = tables_[slot];
    resident_.unpack(resident_.part(part), tables.shape);
    tables.set_cells();
    return tables;
  }

 private:
  static constexpr std::uint32_t kTables = 8;
  const Resident& resident_;
  std::uint32_t held_[kTables], next_ = 0;
  Tables tables_[kTables];
};

/// Answers one chunk after another.
class Answerer {
 public:
  Answerer(const Resident& resident, const QueryOptions& options, const Wants& wants) noexcept
      : resident_(resident), options_(options), wants_(wants), charts_(resident) {}

  /// Pairs of a point and a superquadric that holds it.
  HWY_NOINLINE std::uint64_t pairs(const Chunk& chunk) noexcept {
    std::uint64_t sum = 0;
    for (std::uint32_t k = 0; k < resident_.part_count(); ++k) {
      entries_.clear();
      cull(resident_.part(k), chunk, entries_);
      if (entries_.count > 0) first_layer(resident_.part(k), 0, entries_);
      sum += entries_.count;
    }
    return sum;
  }

  HWY_NOINLINE void answer(const Chunk& chunk, Findings& findings) noexcept {
    findings.count = 0;
    entries_.clear();
    std::memset(known_, 0, sizeof known_);
    bool is_whole = true;  // all entries of the chunk are at hand together
    for (std::uint32_t k = 0; k < resident_.part_count(); ++k) {
      const PartRecord& part = resident_.part(k);
      if (!entries_.has_room_for(chunk.count)) {
        is_whole = false;
        look(chunk, is_whole, findings);
        entries_.clear();
      }
      const std::uint32_t begin = entries_.count;
      cull(part, chunk, entries_);
      if (entries_.count == begin) continue;
      first_layer(part, begin, entries_);
      if (entries_.count == begin) continue;
      entries_.ranges[entries_.range_count++] = {k, begin, entries_.count};
      // Ranges begin at whole vectors; those in between are of a point that nobody reads.
      entries_.count = (entries_.count + lane_count() - 1) / lane_count() * lane_count();
    }
    if (entries_.range_count > 0) look(chunk, is_whole, findings);
  }

 private:
  void look(const Chunk& chunk, bool is_whole, Findings& findings) noexcept {
    if (options_.layer == Layer::kOne) return answer_first(findings);
    second_layer();
    third_layer(chunk, is_whole);
    combine(findings);
    list(findings);
    if (options_.edge_length_m > 0) offset(findings);
    if (!wants_.normal && !wants_.surface) return;
    mark_wanted(is_whole, findings);
    for (std::uint32_t r = 0; r < entries_.range_count; ++r) place(entries_.ranges[r]);
    hand_over(findings);
  }

  /// The points that have a finding, in their order, which does not depend on that of the parts.
  void list(Findings& findings) const noexcept {
    findings.count = 0;
    for (std::uint32_t word = 0; word < kChunkPoints / 32; ++word)
      for (std::uint32_t bits = known_[word]; bits != 0; bits &= bits - 1)
        findings.points[findings.count++] =
            static_cast<std::uint16_t>(32 * word + static_cast<std::uint32_t>(std::countr_zero(bits)));
  }
  bool is_new(std::int32_t point) noexcept {
    std::uint32_t& word = known_[static_cast<std::uint32_t>(point) / 32];
    const std::uint32_t bit = 1U << (static_cast<std::uint32_t>(point) % 32);
    const bool result = (word & bit) == 0;
    word |= bit;
    return result;
  }
  HWY_NOINLINE void answer_first(Findings& findings) noexcept;
  HWY_NOINLINE void second_layer() noexcept;
  HWY_NOINLINE void third_layer(const Chunk& chunk, bool is_whole) noexcept;
  HWY_NOINLINE void combine(Findings& findings) noexcept;
  HWY_NOINLINE void offset(Findings& findings) noexcept;
  HWY_NOINLINE void mark_wanted(bool is_whole, Findings& findings) noexcept;
  HWY_NOINLINE void place(const EntryRange& range) noexcept;
  HWY_NOINLINE void hand_over(Findings& findings) noexcept;

  const Resident& resident_;
  const QueryOptions& options_;
  Wants wants_;
  Charts charts_;
  Entries entries_;
  HWY_ALIGN std::int32_t asked_[kPadded];
  std::uint32_t known_[kChunkPoints / 32];  // points that have a finding, one bit each
};

/// The superquadric alone: inside any part is inside; the first that holds a point answers.
HWY_NOINLINE void Answerer::answer_first(Findings& findings) noexcept {
  for (std::uint32_t r = 0; r < entries_.range_count; ++r) {
    const EntryRange& range = entries_.ranges[r];
    const PartRecord& part = resident_.part(range.part);
    for (std::uint32_t i = range.begin; wants_.normal && i < range.end; i += lane_count()) {
      const V3 n =
          rotated(part.object_from_part, shape_normal_of(part, load3(entries_.x, entries_.y, entries_.z, i)));
      hn::StoreU(n.x, kD, entries_.normal[0] + i);
      hn::StoreU(n.y, kD, entries_.normal[1] + i);
      hn::StoreU(n.z, kD, entries_.normal[2] + i);
    }
    for (std::uint32_t i = range.begin; i < range.end; ++i) {
      const std::int32_t point = entries_.point[i];
      if (!is_new(point)) continue;
      Finding& finding = findings.of[point];
      finding.clear();
      finding.inside = true;
      finding.part = range.part;
      finding.layer = 1;
      for (int axis = 0; axis < 3 && wants_.normal; ++axis) finding.normal[axis] = entries_.normal[axis][i];
    }
  }
  list(findings);
}

HWY_NOINLINE void Answerer::second_layer() noexcept {
  for (std::uint32_t r = 0; r < entries_.range_count; ++r) {
    const EntryRange& range = entries_.ranges[r];
    const PartRecord& part = resident_.part(range.part);
    const Looker looker(resident_, part, charts_.of(range.part), options_);
    for (std::uint32_t i = range.begin; i < range.end; i += lane_count()) {
      const Look look = looker.look(load3(entries_.x, entries_.y, entries_.z, i),
                                    hn::FirstN(kD, range.end - i), part.straight_reach(wants_.reach));
      hn::StoreU(look.row, kD, entries_.row + i);
      hn::StoreU(look.col, kD, entries_.col + i);
      hn::StoreU(look.crossing, kD, entries_.crossing + i);
      hn::StoreU(look.distance, kD, entries_.distance + i);
      hn::StoreU(look.certainty, kD, entries_.certainty + i);
      hn::StoreU(look.flags, kDI, entries_.flags + i);
      hn::StoreU(look.foot_row, kD, entries_.foot_row + i);
      hn::StoreU(look.foot_col, kD, entries_.foot_col + i);
    }
    if (part.bound_cells > 0) prove(resident_, part, range, entries_);
  }
}

/// Layer 3 for the charts of points that need it: all, or those that can be contacts. That a point cannot is
/// known only when all its charts have been asked.
HWY_NOINLINE void Answerer::third_layer(const Chunk& chunk, bool is_whole) noexcept {
  const bool selects = wants_.contacts && is_whole;
  for (std::uint32_t i = 0; i < chunk.count; i += lane_count())
    hn::Store(all_int(selects ? 0 : 1), kDI, asked_ + i);
  asked_[kChunkPoints] = 0;
  for (std::uint32_t r = 0; selects && r < entries_.range_count; ++r) {
    for (std::uint32_t i = entries_.ranges[r].begin; i < entries_.ranges[r].end; ++i)
      if ((entries_.flags[i] & (kInside | kWithin)) != 0) asked_[entries_.point[i]] = 1;
  }
  for (std::uint32_t r = 0; r < entries_.range_count; ++r) {
    const EntryRange& range = entries_.ranges[r];
    const PartRecord& part = resident_.part(range.part);
    const Looker looker(resident_, part, charts_.of(range.part), options_);
    Walker walker(looker, wants_, entries_);
    if (layer_for(part, options_) == Layer::kThree) {
      walker.refine(range.begin, range.end, asked_);
    } else {
      walker.find_lost(range.begin, range.end);
    }
  }
}

/// Charts overlap. The nearest represented surface tells the distance, and the side too, unless another
/// chart's ray leaves far less doubt: Object::query(point).
HWY_NOINLINE void Answerer::combine(Findings& findings) noexcept {
  for (std::uint32_t r = 0; r < entries_.range_count; ++r) {
    const EntryRange& range = entries_.ranges[r];
    const auto layer = static_cast<std::uint8_t>(layer_for(resident_.part(range.part), options_));
    for (std::uint32_t i = range.begin; i < range.end; ++i) {
      const std::int32_t point = entries_.point[i];
      Finding& finding = findings.of[point];
      if (is_new(point)) {
        finding.clear();
      }
      finding.layer = std::max(finding.layer, layer);
      const bool inside = (entries_.flags[i] & kInside) != 0;
      if (entries_.certainty[i] > finding.sharpest) {
        finding.sharpest = entries_.certainty[i];
        finding.inside = inside;
        if (finding.part == kNowhere) finding.part = range.part;
      }
      if (entries_.distance[i] < finding.nearest) {
        finding.nearest = entries_.distance[i];
        finding.nearest_certainty = entries_.certainty[i];
        finding.nearest_inside = inside;
        finding.nearest_faces = (entries_.flags[i] & kFaces) != 0;
        finding.part = range.part;
        finding.nearest_entry = static_cast<std::int32_t>(i);
      }
    }
  }
}

HWY_NOINLINE void Answerer::offset(Findings& findings) noexcept {
  const float edge = resident_.units_per_m() * options_.edge_length_m;
  for (std::uint32_t k = 0; k < findings.count; ++k) {
    const std::int32_t nearest = findings.of[findings.points[k]].nearest_entry;
    if (nearest >= 0) entries_.flags[nearest] |= kAnswer;
  }
  for (std::uint32_t r = 0; r < entries_.range_count; ++r) {
    const EntryRange& range = entries_.ranges[r];
    const PartRecord& part = resident_.part(range.part);
    const Looker looker(resident_, part, charts_.of(range.part), options_);
    for (std::uint32_t i = range.begin; i < range.end; i += lane_count()) {
      const VI flags = hn::LoadU(kDI, entries_.flags + i);
      const M answers = as_float(hn::Ne(hn::And(flags, hn::Set(kDI, kAnswer)), hn::Zero(kDI)));
      if (none(hn::And(answers, hn::FirstN(kD, range.end - i)))) continue;
      const V row = hn::LoadU(kD, entries_.row + i), col = hn::LoadU(kD, entries_.col + i);
      hn::StoreU(looker.offset(row, col, edge), kD, entries_.certainty + i);
    }
  }
  for (std::uint32_t k = 0; k < findings.count; ++k) {
    Finding& finding = findings.of[findings.points[k]];
    if (finding.nearest_entry >= 0) finding.offset = entries_.certainty[finding.nearest_entry];
  }
}

HWY_NOINLINE void Answerer::mark_wanted(bool is_whole, Findings& findings) noexcept {
  const bool selects = wants_.contacts && is_whole;
  for (std::uint32_t k = 0; k < findings.count; ++k) {
    const Finding& finding = findings.of[findings.points[k]];
    if (finding.nearest_entry < 0) continue;
    const bool is_wanted = !selects || finding.signed_distance_m(resident_.unit_m()) < wants_.within_m;
    entries_.flags[finding.nearest_entry] |= is_wanted ? kWanted : 0;
  }
}

/// Surfaces and normals of the entries that want them, in the object's frame.
HWY_NOINLINE void Answerer::place(const EntryRange& range) noexcept {
  const PartRecord& part = resident_.part(range.part);
  const Looker looker(resident_, part, charts_.of(range.part), options_);
  const float blur = part.blur(looker.stride());
  const bool third = layer_for(part, options_) == Layer::kThree;
  const auto loaded = [](float(&values)[3][Entries::kLength], std::uint32_t i)
                          HWY_ATTR { return load3(values[0], values[1], values[2], i); };
  const auto store = [](const V3& v, float(&values)[3][Entries::kLength], std::uint32_t i) HWY_ATTR {
    hn::StoreU(v.x, kD, values[0] + i);
    hn::StoreU(v.y, kD, values[1] + i);
    hn::StoreU(v.z, kD, values[2] + i);
  };
  for (std::uint32_t i = range.begin; i < range.end; i += lane_count()) {
    const VI flags = hn::LoadU(kDI, entries_.flags + i);
    const auto has = [&](std::int32_t flag) HWY_ATTR {
      return as_float(hn::Ne(hn::And(flags, hn::Set(kDI, flag)), hn::Zero(kDI)));
    };
    const M wanted = hn::And(hn::FirstN(kD, range.end - i), has(kWanted));
    if (none(wanted)) continue;
    const M refined = has(kRefined);
    V3 surface = loaded(entries_.surface, i), normal = loaded(entries_.normal, i);
    // Those whose surface is the nearest known, not that along the superquadric's normal.
    const M nearest = hn::And(wanted, third ? hn::Or(refined, hn::Not(has(kPatch))) : refined);
    const bool needs_surface = wants_.surface || !none(nearest);
    const M rough = hn::AndNot(refined, wanted);
    if (wants_.normal) normal = direction3(normal);
    if (!none(rough)) {
      const V row = hn::LoadU(kD, entries_.row + i), col = hn::LoadU(kD, entries_.col + i);
      if (needs_surface)
        surface = pick(refined, surface, looker.surface_at(row, col, hn::LoadU(kD, entries_.crossing + i)));
      if (wants_.normal)
        normal = pick(refined, normal, looker.normal_at(rough, row, col, has(kLeaving), has(kPatch)));
    }
    if (wants_.normal && !none(nearest)) {
      const V3 p = load3(entries_.x, entries_.y, entries_.z, i);
      const V3 out = pick(has(kInside), surface - p, p - surface);
      const V row = hn::LoadU(kD, entries_.row + i);
      const float near = kShortOfPole * looker.size();
      const M beside_pole = hn::Or(hn::Lt(row, all(near)), hn::Gt(row, all(looker.last_row() - near)));
      const M on_rim = hn::And(refined, hn::Or(hn::Not(has(kFaces)), beside_pole));
      normal = pick(nearest, outward3(out, normal, blur, on_rim), normal);
    }
    if (wants_.surface)
      store(rotated(part.object_from_part, surface) + all(part.translation), entries_.surface, i);
    if (wants_.normal) store(rotated(part.object_from_part, normal), entries_.normal, i);
  }
}

HWY_NOINLINE void Answerer::hand_over(Findings& findings) noexcept {
  for (std::uint32_t k = 0; k < findings.count; ++k) {
    Finding& finding = findings.of[findings.points[k]];
    const std::int32_t i = finding.nearest_entry;
    if (i < 0 || (entries_.flags[i] & kWanted) == 0) continue;
    for (int axis = 0; axis < 3; ++axis) {
      finding.normal[axis] = entries_.normal[axis][i];
      finding.surface[axis] = entries_.surface[axis][i];
    }
    finding.nearest_entry = -1;
  }
}

// What Object promises of the stack; the rest is a few vectors that did not fit registers.
static_assert(sizeof(Answerer) + sizeof(Walker) + sizeof(Chunk) + sizeof(Findings) + sizeof(EntryList) <=
              std::size_t{416} * 1024);

/// Default answers.
inline void clear(const Answers& answers, std::size_t begin, std::size_t count) noexcept {
  const Answer nothing;
  const auto fill = [&](const auto& values, auto value) {
    if (!values.empty()) std::fill_n(values.begin() + static_cast<std::ptrdiff_t>(begin), count, value);
  };
  fill(answers.signed_distance_m, nothing.signed_distance_m);
  fill(answers.normal, nothing.normal);
  fill(answers.surface_m, nothing.surface_m);
  fill(answers.part, nothing.part);
  fill(answers.layer, std::uint8_t{0});
  fill(answers.inside, std::uint8_t{0});
}
inline void put(const Resident& resident, const Finding& finding, const Answers& answers,
                std::size_t to) noexcept {
  if (!answers.signed_distance_m.empty())
    answers.signed_distance_m[to] = finding.signed_distance_m(resident.unit_m());
  if (!answers.normal.empty()) answers.normal[to] = finding.normal_vector();
  if (!answers.surface_m.empty()) answers.surface_m[to] = resident.to_metres(finding.surface_point());
  if (!answers.part.empty()) answers.part[to] = finding.part;
  if (!answers.layer.empty()) answers.layer[to] = finding.layer;
  if (!answers.inside.empty()) answers.inside[to] = finding.is_inside() ? 1 : 0;
}

/// Object::query(span).
void query(const Resident& resident, std::span<const Vec3f> points_m, const Answers& answers,
           const QueryOptions& options) noexcept {
  Wants wants;
  wants.normal = !answers.normal.empty();
  wants.surface = !answers.surface_m.empty();
  Chunk chunk;
  Findings findings;
  Answerer answerer(resident, options, wants);
  for (std::size_t begin = 0; begin < points_m.size(); begin += kChunkPoints) {
    const auto count =
        static_cast<std::uint32_t>(std::min<std::size_t>(kChunkPoints, points_m.size() - begin));
    chunk.count = count;
    for (std::uint32_t i = 0; i < count; ++i) {
      const Vec3f p = resident.from_metres(points_m[begin + i]);
      chunk.x[i] = p.x;
      chunk.y[i] = p.y;
      chunk.z[i] = p.z;
    }
    for (std::uint32_t i = count; i < count + lane_count(); ++i) chunk.x[i] = chunk.y[i] = chunk.z[i] = 0;
    make_blocks(resident, chunk);
    answerer.answer(chunk, findings);
    clear(answers, begin, count);
    for (std::uint32_t k = 0; k < findings.count; ++k)
      put(resident, findings.of[findings.points[k]], answers, begin + findings.points[k]);
  }
}
