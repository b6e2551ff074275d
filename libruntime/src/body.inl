// SPDX-License-Identifier: Apache-2.0
//
// Bodies of blocks: walks the blocks that touch the object, a chunk at a time.

/// The placement in float, into the units of the resident. For scale 1 the result is exactly units_per_m
/// times what row . p + t gives in metres.
inline AffineF placement_in_units(const Resident& resident, const BodyPlacement& placement) noexcept {
  const Rotation<double> r = rotation<double>(placement.object_from_body.orientation);
  const double units_per_m = resident.units_per_m();
  AffineF map;
  for (int k = 0; k < 3; ++k)
    map.row[k] = cast<float>((units_per_m * placement.scale) * r.row[static_cast<unsigned>(k)]);
  map.translation = cast<float>(units_per_m * placement.object_from_body.translation_m);
  return map;
}
HWY_INLINE V3 placed(const AffineF& map, const V3& p) {
  return {dot3(all(map.row[0]), p) + all(map.translation.x),
          dot3(all(map.row[1]), p) + all(map.translation.y),
          dot3(all(map.row[2]), p) + all(map.translation.z)};
}

class BlockWalker {
 public:
  BlockWalker(const Resident& resident, const PointBody::Data& body, const BodyPlacement& placement) noexcept
      : resident_(resident),
        body_(body),
        map_(placement_in_units(resident, placement)),
        stretch_(static_cast<float>(placement.scale) * resident.units_per_m()) {
    float reach = 0;
    const Vec3f centre{dot(map_.row[0], body.centre_m) + map_.translation.x,
                       dot(map_.row[1], body.centre_m) + map_.translation.y,
                       dot(map_.row[2], body.centre_m) + map_.translation.z};
    reach = resident.sphere_radius() + enlarged(body.radius_m, centre);
    const Vec3f d = centre - resident.sphere_centre();
    end_ = dot(d, d) <= reach * reach ? body.block_count() : 0;
  }

  /// Fills the chunk with the next blocks that touch the object. False: there are none.
  HWY_NOINLINE bool next(Chunk& chunk) noexcept {
    chunk.block_count = chunk.count = 0;
    for (; next_ < end_; next_ += lane_count()) {
      const V3 centre = placed(map_, load3(body_.ball(0), body_.ball(1), body_.ball(2), next_));
      const V span = hn::Abs(centre.x) + hn::Abs(centre.y) + hn::Abs(centre.z) + all(travel());
      const V radius =
          all(stretch_) * hn::LoadU(kD, body_.ball(3) + next_) * all(1 + kSlack) + span * all(kSlack);
      const V3 d = centre - all(resident_.sphere_centre());
      const V reach = all(resident_.sphere_radius()) + radius;
      const M near = hn::And(hn::Le(dot3(d, d), reach * reach), hn::FirstN(kD, end_ - next_));
      const auto count = static_cast<std::uint32_t>(hn::CountTrue(kD, near));
      if (count == 0) continue;
      if (chunk.block_count + count > kChunkBlocks) return true;
      HWY_ALIGN float values[4][kMostLanes];
      HWY_ALIGN std::int32_t firsts[kMostLanes];
      hn::Store(hn::Compress(centre.x, near), kD, values[0]);
      hn::Store(hn::Compress(centre.y, near), kD, values[1]);
      hn::Store(hn::Compress(centre.z, near), kD, values[2]);
      hn::Store(hn::Compress(radius, near), kD, values[3]);
      const VI block = hn::Iota(kDI, static_cast<std::int32_t>(next_));
      hn::Store(hn::Compress(block, hn::RebindMask(kDI, near)), kDI, firsts);
      for (std::uint32_t k = 0; k < count; ++k) {
        const std::uint32_t slot = chunk.block_count++;
        for (int axis = 0; axis < 3; ++axis) chunk.block_centre[axis][slot] = values[axis][k];
        chunk.block_radius[slot] = values[3][k];
        chunk.block_first[slot] = static_cast<std::uint32_t>(firsts[k]) * kBlockPoints;
        place(chunk, slot);
      }
    }
    return chunk.block_count > 0;
  }

  /// A point of the body in the object's frame, as place() has it.
  Vec3f position(std::uint32_t at) const noexcept {
    const Vec3f p{body_.axis(0)[at], body_.axis(1)[at], body_.axis(2)[at]};
    return {dot(map_.row[0], p) + map_.translation.x, dot(map_.row[1], p) + map_.translation.y,
            dot(map_.row[2], p) + map_.translation.z};
  }

 private:
  static constexpr float kSlack =
      4e-6F;  // of all lengths that take part: rounding moves no point out of its ball

  float travel() const noexcept {
    return std::abs(map_.translation.x) + std::abs(map_.translation.y) + std::abs(map_.translation.z);
  }
  float enlarged(float radius_m, const Vec3f& centre) const noexcept {
    const float span = std::abs(centre.x) + std::abs(centre.y) + std::abs(centre.z) + travel();
    return stretch_ * radius_m * (1 + kSlack) + span * kSlack;
  }
  /// Moves the points of the block into the object's frame.
  HWY_INLINE void place(Chunk& chunk, std::uint32_t slot) noexcept {
    const std::uint32_t first = chunk.block_first[slot], to = slot * kBlockPoints;
    for (std::uint32_t i = 0; i < kBlockPoints; i += lane_count()) {
      const V3 p = placed(map_, load3(body_.axis(0), body_.axis(1), body_.axis(2), first + i));
      hn::Store(p.x, kD, chunk.x + to + i);
      hn::Store(p.y, kD, chunk.y + to + i);
      hn::Store(p.z, kD, chunk.z + to + i);
    }
    chunk.count = to + std::min(kBlockPoints, body_.point_count - first);
  }

  const Resident& resident_;
  const PointBody::Data& body_;
  AffineF map_;
  float stretch_;
  std::uint32_t next_ = 0, end_ = 0;
};

/// Place in the body of point i of the chunk.
inline std::uint32_t body_place(const Chunk& chunk, std::uint32_t i) noexcept {
  return chunk.block_first[i / kBlockPoints] + i % kBlockPoints;
}

void query_body(const Resident& resident, const PointBody::Data& body, const BodyPlacement& placement,
                const Answers& answers, const QueryOptions& options) noexcept {
  const Answer nothing;
  std::fill(answers.signed_distance_m.begin(), answers.signed_distance_m.end(), nothing.signed_distance_m);
  std::fill(answers.normal.begin(), answers.normal.end(), nothing.normal);
  std::fill(answers.surface_m.begin(), answers.surface_m.end(), nothing.surface_m);
  std::fill(answers.part.begin(), answers.part.end(), nothing.part);
  std::fill(answers.layer.begin(), answers.layer.end(), std::uint8_t{0});
  std::fill(answers.inside.begin(), answers.inside.end(), std::uint8_t{0});
  Wants wants;
  wants.normal = !answers.normal.empty();
  wants.surface = !answers.surface_m.empty();
  BlockWalker walker(resident, body, placement);
  Chunk chunk;
  while (walker.next(chunk)) {
    answer(resident, options, wants, chunk);
    for (std::uint32_t i = 0; i < chunk.count; ++i) {
      if (chunk.part[i] < 0) continue;
      const std::uint32_t to = body.index[body_place(chunk, i)];
      if (!answers.signed_distance_m.empty()) answers.signed_distance_m[to] = chunk.signed_distance_m[i];
      if (wants.normal) answers.normal[to] = {chunk.normal[0][i], chunk.normal[1][i], chunk.normal[2][i]};
      if (wants.surface)
        answers.surface_m[to] = {chunk.surface_m[0][i], chunk.surface_m[1][i], chunk.surface_m[2][i]};
      if (!answers.part.empty()) answers.part[to] = static_cast<std::uint32_t>(chunk.part[i]);
      if (!answers.layer.empty()) answers.layer[to] = static_cast<std::uint8_t>(chunk.layer[i]);
      if (!answers.inside.empty()) answers.inside[to] = static_cast<std::uint8_t>(chunk.inside[i]);
    }
  }
}

/// The contacts of one question as they are found.
class ContactCollector {
 public:
  ContactCollector(const Resident& resident, std::span<Contact> out, const ContactQuery& query) noexcept
      : resident_(resident), out_(out), query_(query) {}

  /// False: no more are wanted. `index` is the caller's, one for each point of the chunk.
  bool add(const Chunk& chunk, const std::uint32_t* index) noexcept {
    for (std::uint32_t i = 0; i < chunk.count; ++i) {
      const float distance_m = chunk.signed_distance_m[i];
      const bool unknown = std::isnan(distance_m);
      if (!(distance_m < query_.within_m) && !(unknown && chunk.inside[i] != 0)) continue;
      Contact contact;
      contact.point = index[i];
      contact.part = static_cast<std::uint32_t>(chunk.part[i]);
      contact.depth_m = unknown ? 0.0F : -distance_m;
      contact.normal = {chunk.normal[0][i], chunk.normal[1][i], chunk.normal[2][i]};
      contact.position_m = resident_.unit_m() * Vec3f{chunk.x[i], chunk.y[i], chunk.z[i]};
      contact.surface_m = {chunk.surface_m[0][i], chunk.surface_m[1][i], chunk.surface_m[2][i]};
      if (query_.seek == Seek::kDeepest) {
        const bool better = found_ == 0 || contact.depth_m > deepest_.depth_m ||
                            (contact.depth_m == deepest_.depth_m && contact.point < deepest_.point);
        if (better) deepest_ = contact;
        found_ = 1;
        continue;
      }
      if (found_ < out_.size()) out_[found_] = contact;
      ++found_;
      if (query_.seek == Seek::kAny) return false;
    }
    return true;
  }
  std::size_t finish() noexcept {
    if (query_.seek == Seek::kDeepest && found_ > 0 && !out_.empty()) out_[0] = deepest_;
    return found_;
  }

 private:
  const Resident& resident_;
  std::span<Contact> out_;
  const ContactQuery& query_;
  std::size_t found_ = 0;
  Contact deepest_;
};

std::size_t contacts(const Resident& resident, const PointBody::Data& body, const BodyPlacement& placement,
                     std::span<Contact> out, const ContactQuery& query) noexcept {
  ContactCollector collector(resident, out, query);
  BlockWalker walker(resident, body, placement);
  Wants wants;
  wants.normal = wants.surface = true;
  // First layer 2 alone, to find the points that can be contacts; then those, as they were asked for.
  Wants first_look;
  first_look.suspects = true;
  first_look.reach = resident.units_per_m() * (query.within_m + most_offset(query.options.edge_length_m));
  QueryOptions coarse = query.options;
  if (coarse.layer != Layer::kOne) coarse.layer = Layer::kTwo;
  coarse.edge_length_m = 0;

  Chunk chunk, closer;
  std::uint32_t index[kPadded];
  const auto look_closer = [&]() HWY_ATTR {
    float x[kChunkPoints];
    const std::uint32_t count = closer.count;
    for (std::uint32_t i = count; i < count + lane_count(); ++i) closer.x[i] = closer.y[i] = closer.z[i] = 0;
    std::copy_n(closer.x, count, x);
    answer(resident, query.options, wants, closer);
    std::copy_n(x, count, closer.x);  // answer() strikes off what it need not look at
    const bool more = collector.add(closer, index);
    closer.count = 0;
    return more;
  };
  while (walker.next(chunk)) {
    answer(resident, coarse, first_look, chunk);
    for (std::uint32_t i = 0; i < chunk.count; ++i) {
      if (chunk.suspect[i] == 0) continue;
      const std::uint32_t k = closer.count++;
      // The chunk's x may have been struck off; the body knows it.
      const std::uint32_t at = body_place(chunk, i);
      const Vec3f p = walker.position(at);
      closer.x[k] = p.x;
      closer.y[k] = p.y;
      closer.z[k] = p.z;
      index[k] = body.index[at];
      if (closer.count == kChunkPoints && !look_closer()) return collector.finish();
    }
    if (query.seek == Seek::kAny && closer.count > 0 && !look_closer()) return collector.finish();
  }
  if (closer.count > 0) look_closer();
  return collector.finish();
}

const Kernels kKernels{answer, query, query_body, contacts};
