// SPDX-License-Identifier: Apache-2.0
//
// Bodies of blocks: walks the blocks that touch the object, a chunk at a time.

/// The placement in float, into the frame of the resident. For scale 1 and an object close to its own origin
/// the result is exactly units_per_m times what row . p + t gives in metres.
inline AffineF placement_in_units(const Resident& resident, const BodyPlacement& placement) noexcept {
  const Rotation<double> r = rotation<double>(placement.object_from_body.orientation);
  const double units_per_m = resident.units_per_m();
  AffineF map;
  for (int k = 0; k < 3; ++k)
    map.row[k] = cast<float>((units_per_m * placement.scale) * r.row[static_cast<unsigned>(k)]);
  map.translation = cast<float>(
      units_per_m * (placement.object_from_body.translation_m - cast<double>(resident.origin_m())));
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

  /// Fills the chunk with the next blocks that touch a part. False: there are none.
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
      if (none(near)) continue;
      M open = near, touching = hn::Xor(near, near);  // not known to touch a part; known to
      for (std::uint32_t k = 0; k < resident_.part_count() && !none(open); ++k) {
        const M touches = reaching(resident_.part(k), centre, radius, open);
        touching = hn::Or(touching, touches);
        open = hn::AndNot(touches, open);
      }
      if (none(touching)) continue;
      const Packing packed(touching);
      const std::uint32_t count = packed.count();
      if (chunk.block_count + count > kChunkBlocks) return true;
      HWY_ALIGN float values[4][kMostLanes];
      HWY_ALIGN std::int32_t firsts[kMostLanes];
      hn::Store(packed(centre.x), kD, values[0]);
      hn::Store(packed(centre.y), kD, values[1]);
      hn::Store(packed(centre.z), kD, values[2]);
      hn::Store(packed(radius), kD, values[3]);
      const VI block = hn::Iota(kDI, static_cast<std::int32_t>(next_));
      hn::Store(packed(block), kDI, firsts);
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
  clear(answers, 0, body.point_count);
  Wants wants;
  wants.normal = !answers.normal.empty();
  wants.surface = !answers.surface_m.empty();
  BlockWalker walker(resident, body, placement);
  Chunk chunk;
  Findings findings;
  Answerer answerer(resident, options, wants);
  while (walker.next(chunk)) {
    answerer.answer(chunk, findings);
    for (std::uint32_t k = 0; k < findings.count; ++k) {
      const std::uint32_t i = findings.points[k];
      put(resident, findings.of[i], answers, body.index[body_place(chunk, i)]);
    }
  }
}

/// The contacts of one question as they are found.
class ContactCollector {
 public:
  ContactCollector(const Resident& resident, std::span<Contact> out, const ContactQuery& query) noexcept
      : resident_(resident), out_(out), query_(query) {}

  /// False: no more are wanted.
  bool add(const Chunk& chunk, const Findings& findings, const PointBody::Data& body) noexcept {
    for (std::uint32_t k = 0; k < findings.count; ++k) {
      const std::uint32_t i = findings.points[k];
      const Finding& finding = findings.of[i];
      const float distance_m = finding.signed_distance_m(resident_.unit_m());
      const bool unknown = std::isnan(distance_m);
      if (!(distance_m < query_.within_m) && !(unknown && finding.is_inside())) continue;
      Contact contact;
      contact.point = body.index[body_place(chunk, i)];
      contact.part = finding.part;
      contact.depth_m = unknown ? 0.0F : -distance_m;
      contact.normal = finding.normal_vector();
      contact.position_m = resident_.to_metres({chunk.x[i], chunk.y[i], chunk.z[i]});
      contact.surface_m = resident_.to_metres(finding.surface_point());
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

/// Sets the deepest layer that the budget affords, and what it will cost.
HWY_NOINLINE void afford(const Resident& resident, const PointBody::Data& body,
                         const BodyPlacement& placement, Chunk& chunk, QueryOptions& options,
                         WorkBudget& budget) noexcept {
  std::uint64_t blocks = 0, pairs = 0;
  Answerer answerer(resident, options, {});
  BlockWalker walker(resident, body, placement);
  while (walker.next(chunk)) {
    blocks += chunk.block_count;
    pairs += answerer.pairs(chunk);
  }
  const auto asked = options.layer == Layer::kAuto ? Layer::kThree : options.layer;
  auto layer = static_cast<std::uint32_t>(asked);
  while (layer > 1 && blocks + pairs * kWorkOfLayer[layer - 1] > budget.units) --layer;
  budget.spent = blocks + pairs * kWorkOfLayer[layer - 1];
  budget.layer = static_cast<Layer>(layer);
  budget.level = options.level;
  if (budget.layer != asked) options.layer = budget.layer;
}

std::size_t contacts(const Resident& resident, const PointBody::Data& body, const BodyPlacement& placement,
                     std::span<Contact> out, const ContactQuery& query, WorkBudget* budget) noexcept {
  ContactCollector collector(resident, out, query);
  Wants wants;
  wants.normal = wants.surface = wants.contacts = true;
  wants.within_m = query.within_m;
  wants.reach = resident.units_per_m() * (query.within_m + most_offset(query.options.edge_length_m));
  QueryOptions options = query.options;
  Chunk chunk;
  if (budget != nullptr) afford(resident, body, placement, chunk, options, *budget);
  BlockWalker walker(resident, body, placement);
  Findings findings;
  Answerer answerer(resident, options, wants);
  while (walker.next(chunk)) {
    answerer.answer(chunk, findings);
    if (!collector.add(chunk, findings, body)) break;
  }
  return collector.finish();
}

const Kernels kKernels{query, query_body, contacts};
