// SPDX-License-Identifier: Apache-2.0
//
// Bodies against instances: the body is placed in the object's frame, where the batched engine answers, and
// the answers are brought back to the world.
#include <algorithm>
#include <array>
#include <cmath>

#include "sqmap/runtime/body.hpp"
#include "sqmap/runtime/budget.hpp"
#include "sqmap/runtime/contact.hpp"
#include "sqmap/runtime/instance.hpp"

#include "body_data.hpp"
#include "combine.hpp"
#include "quaternion_of.hpp"

namespace sqmap::runtime {
namespace {

/// p_object = scale * turn * p_body + t. Where one side is mirrored and the other is not, `turn` has the
/// determinant -1, and no quaternion.
struct Relation {
  Rotation<double> turn;
  double scale;
  Vec3d translation_m;
  bool mirrors;

  BodyPlacement placement() const noexcept { return {{quaternion_of(turn), translation_m}, scale}; }
  Vec3d apply(const Vec3d& p) const noexcept { return scale * turn.apply(p) + translation_m; }
};

Relation relation(const Instance& instance, const Placement& world_from_body) noexcept {
  Rotation<double> body = rotation(world_from_body.world_from_object.orientation);
  Rotation<double> object;
  for (unsigned k = 0; k < 3; ++k) {
    if (world_from_body.mirrored) body.row[k].x = -body.row[k].x;
    object.row[k] = cast<double>(instance.orientation().row[k]);
  }
  Relation result;
  for (unsigned k = 0; k < 3; ++k)  // the transposed of `object` times `body`
    result.turn.row[k] =
        object.row[0][k] * body.row[0] + object.row[1][k] * body.row[1] + object.row[2][k] * body.row[2];
  const double inverse_scale = 1 / static_cast<double>(instance.scale());
  result.scale = inverse_scale * world_from_body.scale;
  result.translation_m =
      inverse_scale *
      object.apply_inverse(world_from_body.world_from_object.translation_m - instance.translation_m());
  result.mirrors = instance.mirrored() != world_from_body.mirrored;
  return result;
}

/// Points of a body that is mirrored against the object, a few blocks at a time, in the object's frame.
class MirroredBlocks {
 public:
  MirroredBlocks(const Object& object, const PointBody::Data& body, const Relation& relation) noexcept
      : body_(body),
        relation_(relation),
        centre_m_(object.sphere().centre_m),
        // Wider than the object's own test by what float loses in it: the object decides.
        reach_m_(object.sphere().radius_m * 1.00001) {}

  /// Gathers the next blocks that reach into the object's sphere; false when there are no more.
  bool next() noexcept {
    count_ = 0;
    for (; block_ < body_.block_count() && count_ + kBlockPoints <= points_m_.size(); ++block_) {
      const Vec3d centre{body_.ball(0)[block_], body_.ball(1)[block_], body_.ball(2)[block_]};
      const double radius_m = relation_.scale * static_cast<double>(body_.ball(3)[block_]);
      if (!(norm(relation_.apply(centre) - centre_m_) <= reach_m_ + radius_m)) continue;  // NaN: none
      ++blocks_;
      const std::uint32_t first = block_ * kBlockPoints;
      const std::uint32_t end = std::min(first + kBlockPoints, body_.point_count);
      for (std::uint32_t i = first; i < end; ++i) {
        points_m_[count_] =
            cast<float>(relation_.apply({body_.axis(0)[i], body_.axis(1)[i], body_.axis(2)[i]}));
        index_[count_++] = body_.index[i];
      }
    }
    return count_ > 0;
  }

  std::span<const Vec3f> points_m() const noexcept { return std::span(points_m_).first(count_); }
  std::uint32_t index(std::size_t k) const noexcept { return index_[k]; }
  std::uint64_t blocks() const noexcept { return blocks_; }  ///< gathered so far

 private:
  const PointBody::Data& body_;
  const Relation& relation_;
  Vec3d centre_m_;
  double reach_m_;
  std::uint32_t block_ = 0;
  std::size_t count_ = 0;
  std::uint64_t blocks_ = 0;
  std::array<Vec3f, std::size_t{8} * kBlockPoints> points_m_;
  std::array<std::uint32_t, std::size_t{8} * kBlockPoints> index_;
};

/// Room for the answers to MirroredBlocks.
struct Room {
  static constexpr std::size_t kLength = std::size_t{8} * kBlockPoints;
  std::array<float, kLength> distance_m;
  std::array<Vec3f, kLength> normal, surface_m;
  std::array<std::uint32_t, kLength> part;
  std::array<std::uint8_t, kLength> layer, inside;

  void ask(const Object& object, std::span<const Vec3f> points_m, const QueryOptions& options) noexcept {
    const std::size_t count = points_m.size();
    object.query(points_m,
                 {std::span(distance_m).first(count), std::span(normal).first(count),
                  std::span(surface_m).first(count), std::span(part).first(count),
                  std::span(layer).first(count), std::span(inside).first(count)},
                 options);
  }
};

void query_mirrored(const Object& object, const PointBody& body, const Relation& relation,
                    const Answers& answers, const QueryOptions& options) noexcept {
  const Answer nothing;
  std::ranges::fill(answers.signed_distance_m, nothing.signed_distance_m);
  std::ranges::fill(answers.normal, nothing.normal);
  std::ranges::fill(answers.surface_m, nothing.surface_m);
  std::ranges::fill(answers.part, nothing.part);
  std::ranges::fill(answers.layer, std::uint8_t{0});
  std::ranges::fill(answers.inside, std::uint8_t{0});
  MirroredBlocks blocks(object, body.data(), relation);
  Room room;
  while (blocks.next()) {
    room.ask(object, blocks.points_m(), options);
    for (std::size_t k = 0; k < blocks.points_m().size(); ++k) {
      const std::uint32_t i = blocks.index(k);
      if (!answers.signed_distance_m.empty()) answers.signed_distance_m[i] = room.distance_m[k];
      if (!answers.normal.empty()) answers.normal[i] = room.normal[k];
      if (!answers.surface_m.empty()) answers.surface_m[i] = room.surface_m[k];
      if (!answers.part.empty()) answers.part[i] = room.part[k];
      if (!answers.layer.empty()) answers.layer[i] = room.layer[k];
      if (!answers.inside.empty()) answers.inside[i] = room.inside[k];
    }
  }
}

/// Object::contacts of MirroredBlocks.
std::size_t contacts_mirrored(const Object& object, const PointBody& body, const Relation& relation,
                              std::span<Contact> out, const ContactQuery& query) noexcept {
  MirroredBlocks blocks(object, body.data(), relation);
  Room room;
  std::size_t found = 0;
  Contact deepest;
  while (blocks.next()) {
    room.ask(object, blocks.points_m(), query.options);
    for (std::size_t k = 0; k < blocks.points_m().size(); ++k) {
      const float distance_m = room.distance_m[k];
      const bool is_unknown = std::isnan(distance_m);
      if (!(distance_m < query.within_m) && !(is_unknown && room.inside[k] != 0)) continue;
      const Contact contact{blocks.index(k), room.part[k],         is_unknown ? 0 : -distance_m,
                            room.normal[k],  blocks.points_m()[k], room.surface_m[k]};
      if (query.seek == Seek::kDeepest) {
        if (found == 0 || contact.depth_m > deepest.depth_m ||
            (contact.depth_m == deepest.depth_m && contact.point < deepest.point))
          deepest = contact;
        found = 1;
        continue;
      }
      if (found < out.size()) out[found] = contact;
      ++found;
      if (query.seek == Seek::kAny) return found;
    }
  }
  if (query.seek == Seek::kDeepest && found > 0 && !out.empty()) out[0] = deepest;
  return found;
}

/// Sets the deepest layer that the budget affords, as the engine does.
void afford_mirrored(const Object& object, const PointBody& body, const Relation& relation,
                     QueryOptions& options, WorkBudget& budget) noexcept {
  MirroredBlocks blocks(object, body.data(), relation);
  Room room;
  std::uint64_t held = 0;
  while (blocks.next()) {
    room.ask(object, blocks.points_m(), {Layer::kOne});
    held += static_cast<std::uint64_t>(std::count(
        room.inside.begin(), room.inside.begin() + static_cast<std::ptrdiff_t>(blocks.points_m().size()), 1));
  }
  const Layer asked = options.layer == Layer::kAuto ? Layer::kThree : options.layer;
  auto layer = static_cast<std::uint32_t>(asked);
  const auto cost = [&] { return blocks.blocks() + held * kWorkOfLayer[layer - 1]; };
  while (layer > 1 && cost() > budget.units) --layer;
  budget.spent = cost();
  budget.layer = static_cast<Layer>(layer);
  budget.level = options.level;
  if (budget.layer != asked) options.layer = budget.layer;
}

}  // namespace

void Instance::query(const PointBody& body, const Placement& world_from_body, const Answers& answers,
                     const QueryOptions& options) const noexcept {
  const QueryOptions object_options = options_in_object(options);
  const Relation where = relation(*this, world_from_body);
  if (where.mirrors) {
    query_mirrored(*object_, body, where, answers, object_options);
  } else {
    object_->query(body, where.placement(), answers, object_options);
  }
  for (Vec3f& normal : answers.normal) normal = to_world_direction(normal);
  // A surface point that is unknown is zero. That one is at the very origin of the object is as good as
  // never.
  for (Vec3f& p : answers.surface_m)
    if (!(p == Vec3f{})) p = to_world(p);
  for (float& d_m : answers.signed_distance_m) d_m *= scale_;
}

std::size_t Instance::contacts_of(const PointBody& body, const Placement& world_from_body,
                                  std::span<Contact> contacts, ContactQuery query,
                                  WorkBudget* budget) const noexcept {
  query.options = options_in_object(query.options);
  query.within_m *= inverse_scale_;
  const Relation where = relation(*this, world_from_body);
  std::size_t found = 0;
  if (where.mirrors) {
    if (budget != nullptr) afford_mirrored(*object_, body, where, query.options, *budget);
    found = contacts_mirrored(*object_, body, where, contacts, query);
  } else if (budget != nullptr) {
    found = object_->contacts(body, where.placement(), contacts, query, *budget);
  } else {
    found = object_->contacts(body, where.placement(), contacts, query);
  }
  for (Contact& contact : contacts.first(std::min(found, contacts.size()))) {
    contact.normal = to_world_direction(contact.normal);
    contact.position_m = to_world(contact.position_m);
    const bool has_surface = contact.depth_m != 0 || !(contact.surface_m == Vec3f{});
    contact.surface_m = has_surface ? to_world(contact.surface_m) : contact.position_m;
    contact.depth_m *= scale_;
  }
  return found;
}

std::size_t Instance::contacts(const PointBody& body, const Placement& world_from_body,
                               std::span<Contact> contacts, const ContactQuery& query) const noexcept {
  return contacts_of(body, world_from_body, contacts, query, nullptr);
}

std::size_t Instance::contacts(const PointBody& body, const Placement& world_from_body,
                               std::span<Contact> contacts, const ContactQuery& query,
                               WorkBudget& budget) const noexcept {
  return contacts_of(body, world_from_body, contacts, query, &budget);
}

}  // namespace sqmap::runtime
