// SPDX-License-Identifier: Apache-2.0
//
// A chunk of points against all parts: sphere and box, layer 1, layers 2 and 3, and what the charts say
// together. Each step is done by whole vectors of points that passed the one before.

/// What is known of each point so far: the variables of Object::query(point).
struct alignas(64) Findings {
  float nearest[kPadded], sharpest[kPadded], nearest_certainty[kPadded], offset[kPadded];
  std::int32_t flags[kPadded];
};
constexpr std::int32_t kInside = 1, kNearestInside = 2, kNearestFaces = 4, kSecondLayer = 8, kThirdLayer = 16,
                       kFirstLayer = 32, kSuspect = 64;

/// Points of the chunk that lie in one part, in its frame.
struct alignas(64) PartPoints {
  float x[kPadded], y[kPadded], z[kPadded];
  std::int32_t index[kPadded];
  std::uint32_t count = 0;
};

HWY_INLINE V3 load3(const float* x, const float* y, const float* z, std::uint32_t i) {
  return {hn::LoadU(kD, x + i), hn::LoadU(kD, y + i), hn::LoadU(kD, z + i)};
}
HWY_INLINE M in_ball(const V3& p, const Vec3f& centre, float square) {
  const V3 d = p - all(centre);
  return hn::Le(dot3(d, d), all(square));
}
/// Appends the lanes of mask.
HWY_INLINE void append(M mask, const V3& p, VI index, PartPoints& out) {
  // Compress and a whole store: a compressing store is microcode on some processors.
  hn::StoreU(hn::Compress(p.x, mask), kD, out.x + out.count);
  hn::StoreU(hn::Compress(p.y, mask), kD, out.y + out.count);
  hn::StoreU(hn::Compress(p.z, mask), kD, out.z + out.count);
  hn::StoreU(hn::Compress(index, hn::RebindMask(kDI, mask)), kDI, out.index + out.count);
  out.count += static_cast<std::uint32_t>(hn::CountTrue(kD, mask));
}

/// Points in the part's sphere, then those of them in its box.
HWY_NOINLINE void cull(const PartRecord& part, const Chunk& chunk, PartPoints& out) {
  HWY_ALIGN std::int32_t in_sphere[kPadded];
  std::uint32_t sphere_count = 0;
  const auto test = [&](std::uint32_t begin, std::uint32_t end) HWY_ATTR {
    for (std::uint32_t i = begin; i < end; i += lane_count()) {
      const V3 p = load3(chunk.x, chunk.y, chunk.z, i);
      const M mask = hn::And(in_ball(p, part.sphere_centre, part.sphere_square), hn::FirstN(kD, end - i));
      const VI index = hn::Iota(kDI, static_cast<std::int32_t>(i));
      hn::StoreU(hn::Compress(index, hn::RebindMask(kDI, mask)), kDI, in_sphere + sphere_count);
      sphere_count += static_cast<std::uint32_t>(hn::CountTrue(kD, mask));
    }
  };
  if (chunk.block_count == 0) test(0, chunk.count);
  for (std::uint32_t first = 0; first < chunk.block_count; first += lane_count()) {
    const V3 d = load3(chunk.block_centre[0], chunk.block_centre[1], chunk.block_centre[2], first) -
                 all(part.sphere_centre);
    const V reach = all(part.sphere_radius) + hn::LoadU(kD, chunk.block_radius + first);
    const M near = hn::And(hn::Le(dot3(d, d), reach * reach), hn::FirstN(kD, chunk.block_count - first));
    if (none(near)) continue;
    HWY_ALIGN float touches[kMostLanes];
    hn::Store(hn::IfThenElseZero(near, all(1.0F)), kD, touches);
    for (std::uint32_t lane = 0; lane < lane_count() && first + lane < chunk.block_count; ++lane) {
      const std::uint32_t begin = (first + lane) * kBlockPoints;
      if (touches[lane] > 0) test(begin, std::min(chunk.count, begin + kBlockPoints));
    }
  }
  out.count = 0;
  if (sphere_count == 0) return;
  hn::StoreU(hn::Zero(kDI), kDI, in_sphere + sphere_count);
  for (std::uint32_t i = 0; i < sphere_count; i += lane_count()) {
    const VI index = hn::LoadU(kDI, in_sphere + i);
    const V3 p{hn::GatherIndex(kD, chunk.x, index), hn::GatherIndex(kD, chunk.y, index),
               hn::GatherIndex(kD, chunk.z, index)};
    const V3 q = rotated_back(part.object_from_part, p - all(part.translation));
    M mask = hn::FirstN(kD, sphere_count - i);
    mask = hn::And(mask, hn::Le(hn::Abs(q.x) * all(part.inverse_axes.x), all(1.0F)));
    mask = hn::And(mask, hn::Le(hn::Abs(q.y) * all(part.inverse_axes.y), all(1.0F)));
    mask = hn::And(mask, hn::Le(hn::Abs(q.z) * all(part.inverse_axes.z), all(1.0F)));
    append(mask, q, index, out);
  }
}

/// Leaves the points in the superquadric, and pads them to whole vectors.
HWY_NOINLINE void first_layer(const PartRecord& part, PartPoints& points) {
  const std::uint32_t count = points.count;
  points.count = 0;
  for (std::uint32_t i = 0; i < count; i += lane_count()) {
    const V3 p = load3(points.x, points.y, points.z, i);
    const VI index = hn::LoadU(kDI, points.index + i);
    const V x = hn::Abs(p.x) * all(part.inverse_axes.x), y = hn::Abs(p.y) * all(part.inverse_axes.y),
            z = hn::Abs(p.z) * all(part.inverse_axes.z);
    const V across = power_of(x, part.power_2) + power_of(y, part.power_2);
    const V sum = power_of(across, part.power_ratio) + power_of(z, part.power_1);
    append(hn::And(hn::Le(sum, all(1.0F)), hn::FirstN(kD, count - i)), p, index, points);
  }
  if (points.count == 0) return;
  hn::StoreU(hn::Zero(kD), kD, points.x + points.count);
  hn::StoreU(hn::Zero(kD), kD, points.y + points.count);
  hn::StoreU(hn::Zero(kD), kD, points.z + points.count);
  hn::StoreU(all_int(kChunkPoints), kDI, points.index + points.count);  // a place nobody reads
}

/// The superquadric alone: inside any part is inside; the first that holds a point answers.
HWY_NOINLINE void answer_first(const PartRecord& part, std::uint32_t part_index, const PartPoints& points,
                               const Wants& wants, Findings& findings, Chunk& chunk) {
  for (std::uint32_t k = 0; k < points.count; ++k) {
    const std::int32_t i = points.index[k];
    findings.flags[i] = kFirstLayer | kInside | kSuspect;
    chunk.part[i] = static_cast<std::int32_t>(part_index);
    chunk.x[i] = std::numeric_limits<float>::infinity();  // in no ball: the point is answered
    if (!wants.normal) continue;
    const Vec3f n = part.object_from_part.apply(shape_normal(part, {points.x[k], points.y[k], points.z[k]}));
    for (int axis = 0; axis < 3; ++axis) chunk.normal[axis][i] = n[axis];
  }
}

HWY_INLINE void replace(M mask, V value, float* array, VI index) {
  hn::ScatterIndex(pick(mask, value, hn::GatherIndex(kD, array, index)), kD, array, index);
}

HWY_NOINLINE void answer_deeper(const Resident& resident, std::uint32_t part_index, const PartPoints& points,
                                bool third, const QueryOptions& options, const Wants& wants,
                                Findings& findings, Chunk& chunk) {
  const PartRecord& part = resident.part(part_index);
  const Chart chart(resident, part);
  const Looker looker(resident, part, chart, options.level);
  const float edge = resident.units_per_m() * options.edge_length_m;
  const VI this_part = all_int(part_index), nowhere = hn::Set(kDI, -1);
  for (std::uint32_t k = 0; k < points.count; k += lane_count()) {
    const V3 p = load3(points.x, points.y, points.z, k);
    const VI index = hn::LoadU(kDI, points.index + k);
    const Look look = looker.look(p, hn::FirstN(kD, points.count - k), third, wants);

    VI flags = hn::GatherIndex(kDI, findings.flags, index);
    VI answering = hn::GatherIndex(kDI, chunk.part, index);
    const V sharpest = hn::GatherIndex(kD, findings.sharpest, index);
    const V nearest = hn::GatherIndex(kD, findings.nearest, index);
    const VI inside = pick(look.inside, all_int(kInside), hn::Zero(kDI));
    const M sharper = hn::Gt(look.certainty, sharpest), nearer = hn::Lt(look.distance, nearest);
    flags = hn::Or(flags, all_int(third ? kThirdLayer : kSecondLayer));
    if (wants.suspects)
      flags = hn::Or(flags, pick(hn::Or(look.inside, look.within), all_int(kSuspect), hn::Zero(kDI)));
    flags = pick(sharper, hn::Or(hn::AndNot(all_int(kInside), flags), inside), flags);
    answering = pick(hn::And(sharper, as_float(hn::Eq(answering, nowhere))), this_part, answering);
    answering = pick(nearer, this_part, answering);
    const VI faces = pick(look.faces_patch, all_int(kNearestFaces), hn::Zero(kDI));
    const VI of_nearest = hn::Or(hn::ShiftLeft<1>(inside), faces);
    flags =
        pick(nearer, hn::Or(hn::AndNot(all_int(kNearestInside | kNearestFaces), flags), of_nearest), flags);
    hn::ScatterIndex(flags, kDI, findings.flags, index);
    hn::ScatterIndex(answering, kDI, chunk.part, index);
    hn::ScatterIndex(pick(sharper, look.certainty, sharpest), kD, findings.sharpest, index);
    if (none(nearer)) continue;
    hn::ScatterIndex(pick(nearer, look.distance, nearest), kD, findings.nearest, index);
    replace(nearer, look.certainty, findings.nearest_certainty, index);
    if (wants.normal) {
      const V3 n = rotated(part.object_from_part, look.normal);
      replace(nearer, n.x, chunk.normal[0], index);
      replace(nearer, n.y, chunk.normal[1], index);
      replace(nearer, n.z, chunk.normal[2], index);
    }
    if (wants.surface) {
      const V unit = all(resident.unit_m());
      const V3 s = unit * (rotated(part.object_from_part, look.surface) + all(part.translation));
      replace(nearer, s.x, chunk.surface_m[0], index);
      replace(nearer, s.y, chunk.surface_m[1], index);
      replace(nearer, s.z, chunk.surface_m[2], index);
    }
    if (!(edge > 0)) continue;
    HWY_ALIGN float rows[kMostLanes], cols[kMostLanes], changed[kMostLanes];
    hn::Store(look.row, kD, rows);
    hn::Store(look.col, kD, cols);
    hn::Store(hn::IfThenElseZero(nearer, all(1.0F)), kD, changed);
    for (std::uint32_t lane = 0; lane < lane_count() && k + lane < points.count; ++lane) {
      if (changed[lane] > 0) {
        findings.offset[points.index[k + lane]] = chart.offset(rows[lane], cols[lane], options.level, edge);
      }
    }
  }
}

/// Turns findings into answers.
HWY_NOINLINE void conclude(const Resident& resident, const Findings& findings, Chunk& chunk) {
  const V unit = all(resident.unit_m()), infinity = all(std::numeric_limits<float>::infinity());
  const auto has = [](VI flags, std::int32_t flag) HWY_ATTR {
    return as_float(hn::Ne(hn::And(flags, hn::Set(kDI, flag)), hn::Zero(kDI)));
  };
  for (std::uint32_t i = 0; i < chunk.count; i += lane_count()) {
    const VI flags = hn::Load(kDI, findings.flags + i);
    const V nearest = hn::Load(kD, findings.nearest + i);
    const M undisputed = hn::Lt(hn::Load(kD, findings.sharpest + i),
                                all(kOverrule) * hn::Load(kD, findings.nearest_certainty + i));
    const M by_nearest = hn::And(has(flags, kNearestFaces), undisputed);
    const M inside =
        hn::Or(hn::And(by_nearest, has(flags, kNearestInside)), hn::AndNot(by_nearest, has(flags, kInside)));
    const V distance = pick(inside, hn::Neg(nearest), nearest) - hn::Load(kD, findings.offset + i);
    hn::Store(pick(hn::Lt(nearest, infinity), unit * distance, all(std::numeric_limits<float>::quiet_NaN())),
              kD, chunk.signed_distance_m + i);
    hn::Store(pick(inside, all_int(1), hn::Zero(kDI)), kDI, chunk.inside + i);
    const VI second = pick(has(flags, kSecondLayer), all_int(2), hn::Zero(kDI));
    const VI first = pick(has(flags, kFirstLayer), all_int(1), second);
    hn::Store(hn::And(flags, all_int(kSuspect)), kDI, chunk.suspect + i);
    hn::Store(pick(has(flags, kThirdLayer), all_int(3), first), kDI, chunk.layer + i);
  }
}

void answer(const Resident& resident, const QueryOptions& options, const Wants& wants,
            Chunk& chunk) noexcept {
  Findings findings;
  for (std::uint32_t i = 0; i < chunk.count; i += lane_count()) {
    const M inside =
        in_ball(load3(chunk.x, chunk.y, chunk.z, i), resident.sphere_centre(), resident.sphere_square());
    const V infinity = all(std::numeric_limits<float>::infinity()), zero = hn::Zero(kD);
    hn::Store(pick(inside, hn::Load(kD, chunk.x + i), infinity), kD, chunk.x + i);
    hn::Store(infinity, kD, findings.nearest + i);
    hn::Store(all(-1.0F), kD, findings.sharpest + i);
    hn::Store(zero, kD, findings.nearest_certainty + i);
    hn::Store(zero, kD, findings.offset + i);
    hn::Store(hn::Zero(kDI), kDI, findings.flags + i);
    hn::Store(hn::Set(kDI, -1), kDI, chunk.part + i);
    for (int axis = 0; axis < 3; ++axis) {
      if (wants.normal) hn::Store(zero, kD, chunk.normal[axis] + i);
      if (wants.surface) hn::Store(zero, kD, chunk.surface_m[axis] + i);
    }
  }
  PartPoints points;
  for (std::uint32_t k = 0; k < resident.part_count(); ++k) {
    const PartRecord& part = resident.part(k);
    cull(part, chunk, points);
    if (points.count == 0) continue;
    first_layer(part, points);
    if (points.count == 0) continue;
    const Layer layer = layer_for(part, options);
    if (layer == Layer::kOne) {
      answer_first(part, k, points, wants, findings, chunk);
    } else {
      answer_deeper(resident, k, points, layer == Layer::kThree, options, wants, findings, chunk);
    }
  }
  conclude(resident, findings, chunk);
}

HWY_INLINE void store3(const float (&values)[3][kPadded], std::uint32_t count, Vec3f* out) {
  for (std::uint32_t i = 0; i < count; ++i) out[i] = {values[0][i], values[1][i], values[2][i]};
}

void query(const Resident& resident, std::span<const Vec3f> points_m, const Answers& answers,
           const QueryOptions& options) noexcept {
  Chunk chunk;
  Wants wants;
  wants.normal = !answers.normal.empty();
  wants.surface = !answers.surface_m.empty();
  const float scale = resident.units_per_m();
  for (std::size_t begin = 0; begin < points_m.size(); begin += kChunkPoints) {
    const auto count =
        static_cast<std::uint32_t>(std::min<std::size_t>(kChunkPoints, points_m.size() - begin));
    chunk.count = count;
    for (std::uint32_t i = 0; i < count; ++i) {
      const Vec3f p = scale * points_m[begin + i];
      chunk.x[i] = p.x;
      chunk.y[i] = p.y;
      chunk.z[i] = p.z;
    }
    for (std::uint32_t i = count; i < count + lane_count(); ++i) chunk.x[i] = chunk.y[i] = chunk.z[i] = 0;
    answer(resident, options, wants, chunk);
    if (!answers.signed_distance_m.empty()) {
      std::copy_n(chunk.signed_distance_m, count, answers.signed_distance_m.data() + begin);
    }
    if (wants.normal) store3(chunk.normal, count, answers.normal.data() + begin);
    if (wants.surface) store3(chunk.surface_m, count, answers.surface_m.data() + begin);
    const auto copy = [&](const std::int32_t* values, auto& out) {
      using T = typename std::remove_reference_t<decltype(out)>::value_type;
      for (std::uint32_t i = 0; i < count && !out.empty(); ++i) out[begin + i] = static_cast<T>(values[i]);
    };
    copy(chunk.part, answers.part);
    copy(chunk.layer, answers.layer);
    copy(chunk.inside, answers.inside);
  }
}
