// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/contacts.hpp"

#include <array>
#include <cmath>

namespace sqmap::runtime {
namespace {

/// Points that reach the object together. Later chunks are not looked at once the answer is certain, so
/// `any` and `first` lose at most this many queries.
constexpr std::size_t kChunk = 128;

/// Those points of a batch that the object's sphere does not reject, in the object's frame, in order.
class NearPoints {
 public:
  NearPoints(const Instance& instance, std::span<const Vec3f> points_m) noexcept
      : instance_(instance),
        points_m_(points_m),
        centre_m_(cast<float>(instance.object().sphere().centre_m)),
        // Wider than the object's own test by what float loses in it: the object decides.
        reach_m_(static_cast<float>(1.00001 * instance.object().sphere().radius_m +
                                    1e-6 * norm(instance.object().sphere().centre_m))) {}

  /// Gathers the next points; false when there are no more.
  bool next() noexcept {
    count_ = 0;
    while (at_ < points_m_.size() && count_ < kChunk) {
      const Vec3f p_m = instance_.to_object(points_m_[at_]);
      const Vec3f from_centre_m = p_m - centre_m_;
      if (dot(from_centre_m, from_centre_m) <= reach_m_ * reach_m_) {  // NaN: rejected
        p_object_m_[count_] = p_m;
        index_[count_++] = at_;
      }
      ++at_;
    }
    return count_ > 0;
  }

  std::span<const Vec3f> object_points_m() const noexcept { return std::span(p_object_m_).first(count_); }
  std::size_t index(std::size_t k) const noexcept { return index_[k]; }

 private:
  const Instance& instance_;
  std::span<const Vec3f> points_m_;
  Vec3f centre_m_;
  float reach_m_;
  std::size_t at_{}, count_{};
  std::array<Vec3f, kChunk> p_object_m_;
  std::array<std::size_t, kChunk> index_;
};

bool touches(float signed_distance_m, bool inside) noexcept {
  return signed_distance_m < 0 || (inside && std::isnan(signed_distance_m));
}

/// Distances and sides of a chunk: all that tells contacts from other points.
struct Sides {
  std::array<float, kChunk> distance_m;
  std::array<std::uint8_t, kChunk> inside;

  void ask(const Object& object, std::span<const Vec3f> points_m, const QueryOptions& options) noexcept {
    object.query(points_m,
                 {.signed_distance_m = std::span(distance_m).first(points_m.size()),
                  .inside = std::span(inside).first(points_m.size())},
                 options);
  }
  bool touch(std::size_t k) const noexcept { return touches(distance_m[k], inside[k] != 0); }
  float depth_m(std::size_t k) const noexcept { return distance_m[k] < 0 ? -distance_m[k] : 0; }
};

/// The whole contact of a point that is known to be one.
std::optional<Contact> look_again(const Instance& instance, std::span<const Vec3f> points_m,
                                  std::size_t index, const QueryOptions& options) noexcept {
  return contact_of(static_cast<std::uint32_t>(index), points_m[index],
                    instance.query(points_m[index], options));
}

/// Index of the first point in contact.
std::optional<std::size_t> first_touching(const Instance& instance, std::span<const Vec3f> points_m,
                                          const QueryOptions& options) noexcept {
  const QueryOptions object_options = instance.options_in_object(options);
  NearPoints near(instance, points_m);
  Sides sides;
  while (near.next()) {
    const auto chunk_m = near.object_points_m();
    sides.ask(instance.object(), chunk_m, object_options);
    for (std::size_t k = 0; k < chunk_m.size(); ++k)
      if (sides.touch(k)) return near.index(k);
  }
  return std::nullopt;
}

}  // namespace

std::optional<Contact> contact_of(std::uint32_t point, const Vec3f& p_m, const Answer& answer) noexcept {
  if (!touches(answer.signed_distance_m, answer.inside)) return std::nullopt;
  const bool has_depth = answer.signed_distance_m < 0;
  return Contact{.point = point,
                 .part = answer.part,
                 .depth_m = has_depth ? -answer.signed_distance_m : 0,
                 .normal = answer.normal,
                 .position_m = p_m,
                 .surface_m = has_depth ? answer.surface_m : p_m};
}

bool any_contact(const Instance& instance, std::span<const Vec3f> points_m,
                 const QueryOptions& options) noexcept {
  return first_touching(instance, points_m, options).has_value();
}

std::optional<Contact> first_contact(const Instance& instance, std::span<const Vec3f> points_m,
                                     const QueryOptions& options) noexcept {
  const auto first = first_touching(instance, points_m, options);
  if (!first) return std::nullopt;
  return look_again(instance, points_m, *first, options);
}

std::optional<Contact> deepest_contact(const Instance& instance, std::span<const Vec3f> points_m,
                                       const QueryOptions& options) noexcept {
  const QueryOptions object_options = instance.options_in_object(options);
  NearPoints near(instance, points_m);
  Sides sides;
  float deepest_m = -1;
  std::size_t deepest = 0;
  while (near.next()) {
    const auto chunk_m = near.object_points_m();
    sides.ask(instance.object(), chunk_m, object_options);
    for (std::size_t k = 0; k < chunk_m.size(); ++k) {
      if (!sides.touch(k) || sides.depth_m(k) <= deepest_m) continue;
      deepest_m = sides.depth_m(k);
      deepest = near.index(k);
    }
  }
  if (deepest_m < 0) return std::nullopt;
  return look_again(instance, points_m, deepest, options);
}

ContactCount all_contacts(const Instance& instance, std::span<const Vec3f> points_m,
                          std::span<Contact> contacts, const QueryOptions& options) noexcept {
  const QueryOptions object_options = instance.options_in_object(options);
  NearPoints near(instance, points_m);
  Sides sides;
  std::array<Vec3f, kChunk> normal, surface_m;
  std::array<std::uint32_t, kChunk> part;
  ContactCount count;
  while (near.next()) {
    const auto chunk_m = near.object_points_m();
    const std::size_t size = chunk_m.size();
    instance.object().query(chunk_m,
                            {.signed_distance_m = std::span(sides.distance_m).first(size),
                             .normal = std::span(normal).first(size),
                             .surface_m = std::span(surface_m).first(size),
                             .part = std::span(part).first(size),
                             .inside = std::span(sides.inside).first(size)},
                            object_options);
    for (std::size_t k = 0; k < size; ++k) {
      if (!sides.touch(k)) continue;
      ++count.found;
      if (count.written == contacts.size()) continue;
      const std::size_t index = near.index(k);
      const Answer answer = instance.answer_in_world({.signed_distance_m = sides.distance_m[k],
                                                      .normal = normal[k],
                                                      .surface_m = surface_m[k],
                                                      .part = part[k],
                                                      .inside = sides.inside[k] != 0});
      contacts[count.written++] = *contact_of(static_cast<std::uint32_t>(index), points_m[index], answer);
    }
  }
  return count;
}

}  // namespace sqmap::runtime
