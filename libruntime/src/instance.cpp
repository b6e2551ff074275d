// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/instance.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "quaternion_of.hpp"

namespace sqmap::runtime {
namespace {

Error refused(std::string finding, std::string remedy) {
  return {Status::kBadOption, "placement: " + std::move(finding), std::move(remedy)};
}

bool is_finite(const Vec3d& v) noexcept {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

double largest(const Vec3d& v) noexcept { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

/// Points of a batch that are moved to the object frame together: 3 KB of stack.
constexpr std::size_t kChunk = 256;

template <class T>
std::span<T> part_of(std::span<T> whole, std::size_t first, std::size_t count) noexcept {
  return whole.empty() ? whole : whole.subspan(first, count);
}

}  // namespace

Instance::Instance(const Object& object, const Rotation<float>& orientation, const Vec3d& translation_m,
                   double scale) noexcept
    : object_(&object),
      translation_m_(translation_m),
      orientation_(orientation),
      scale_(static_cast<float>(scale)),
      inverse_scale_(static_cast<float>(1 / scale)) {}

Result<Instance> Instance::place(const Object& object, const Placement& placement) {
  const Quaternion& q = placement.world_from_object.orientation;
  const Vec3d& t_m = placement.world_from_object.translation_m;
  const double scale = placement.scale;
  if (!(scale >= kLeastScale && scale <= kMostScale)) {  // NaN: refused
    return refused("scale is " + std::to_string(scale) + ", must be from 1e-9 to 1e9",
                   "scale the points instead, or bake the mesh in another unit");
  }
  // Divided by the largest first: squares of tiny or huge components would vanish or overflow.
  const double most = std::max({std::abs(q.w), std::abs(q.x), std::abs(q.y), std::abs(q.z)});
  if (!(most > 0) || !std::isfinite(q.w + q.x + q.y + q.z)) {
    return refused("orientation is (" + std::to_string(q.w) + ", " + std::to_string(q.x) + ", " +
                       std::to_string(q.y) + ", " + std::to_string(q.z) + "), must be finite and not zero",
                   "give a unit quaternion (w, x, y, z)");
  }
  const BoundingSphere& ball = object.sphere();
  const double reach_m = largest(t_m) + scale * (norm(ball.centre_m) + ball.radius_m);
  if (!is_finite(t_m) || !(reach_m <= kWorldReach_m)) {
    return refused("the object would reach " + std::to_string(reach_m) +
                       " m from the world's origin, must be at most 1e18 m",
                   "place it nearer to the origin");
  }
  Rotation<float> orientation = rotation<float>({q.w / most, q.x / most, q.y / most, q.z / most});
  if (placement.mirrored) {
    for (Vec3f& row : orientation.row) row.x = -row.x;
  }
  return Instance(object, orientation, t_m, scale);
}

Result<Instance> Instance::place(const Object& object, const Affine& world_from_object) {
  const auto& rows = world_from_object.linear;
  if (!is_finite(rows[0]) || !is_finite(rows[1]) || !is_finite(rows[2])) {
    return refused("the matrix has an element that is not finite", "give finite numbers");
  }
  std::array<Vec3d, 3> column;
  std::array<double, 3> length{};
  for (int k = 0; k < 3; ++k) {
    column[k] = {rows[0][k], rows[1][k], rows[2][k]};
    const double most = largest(column[k]);  // before squaring, as above
    length[k] = most > 0 ? most * norm((1 / most) * column[k]) : 0;
    if (length[k] > 0) column[k] = (1 / length[k]) * column[k];
  }
  const auto [least, most] = std::minmax_element(length.begin(), length.end());
  if (!(*least > 0)) return refused("the matrix has a column of zeros", "give each axis the same scale > 0");
  if (*most - *least > kSimilarityTolerance * *most) {
    return refused("the axes are scaled by " + std::to_string(length[0]) + ", " + std::to_string(length[1]) +
                       " and " + std::to_string(length[2]) + ", must be one scale",
                   "apply the scale to the mesh and bake that");
  }
  const double shear = std::max({std::abs(dot(column[0], column[1])), std::abs(dot(column[1], column[2])),
                                 std::abs(dot(column[2], column[0]))});
  if (shear > kSimilarityTolerance) {
    return refused(
        "the matrix shears: the cosine of two axes is " + std::to_string(shear) + ", must be 0 within 1e-4",
        "apply the shear to the mesh and bake that");
  }
  Placement placement;
  placement.mirrored = dot(cross(column[0], column[1]), column[2]) < 0;
  if (placement.mirrored) column[0] = -column[0];
  placement.scale = std::cbrt(length[0] * length[1] * length[2]);
  placement.world_from_object.translation_m = world_from_object.translation_m;

  Rotation<double> turn;
  for (int k = 0; k < 3; ++k) turn.row[k] = {column[0][k], column[1][k], column[2][k]};
  placement.world_from_object.orientation = quaternion_of(turn);
  return place(object, placement);
}

bool Instance::mirrored() const noexcept {
  return dot(cross(orientation_.row[0], orientation_.row[1]), orientation_.row[2]) < 0;
}

BoundingSphere Instance::sphere() const noexcept {
  const BoundingSphere& ball = object_->sphere();
  const double scale = scale_;
  // Float orientation and scale turn the ball's centre by up to a few 1e-7 of its distance.
  const double slack_m = 1e-6 * scale * (norm(ball.centre_m) + ball.radius_m);
  const Rotation<double> turn{cast<double>(orientation_.row[0]), cast<double>(orientation_.row[1]),
                              cast<double>(orientation_.row[2])};
  return {scale * turn.apply(ball.centre_m) + translation_m_, scale * ball.radius_m + slack_m};
}

Vec3f Instance::to_object(const Vec3f& p_m) const noexcept {
  const Vec3d from_origin_m = cast<double>(p_m) - translation_m_;
  return inverse_scale_ * orientation_.apply_inverse(cast<float>(from_origin_m));
}

Vec3f Instance::to_world(const Vec3f& p_object_m) const noexcept {
  return cast<float>(cast<double>(scale_ * orientation_.apply(p_object_m)) + translation_m_);
}

QueryOptions Instance::options_in_object(QueryOptions options) const noexcept {
  options.edge_length_m *= inverse_scale_;
  return options;
}

Answer Instance::answer_in_world(Answer answer) const noexcept {
  answer.normal = to_world_direction(answer.normal);
  if (std::isnan(answer.signed_distance_m)) return answer;  // surface_m is zero: unknown
  answer.signed_distance_m *= scale_;
  answer.surface_m = to_world(answer.surface_m);
  return answer;
}

Answer Instance::query(const Vec3f& p_m, const QueryOptions& options) const noexcept {
  return answer_in_world(object_->query(to_object(p_m), options_in_object(options)));
}

void Instance::query(std::span<const Vec3f> points_m, const Answers& answers,
                     const QueryOptions& options) const noexcept {
  const QueryOptions object_options = options_in_object(options);
  std::array<Vec3f, kChunk> chunk_m;
  std::array<float, kChunk> distance_m;
  for (std::size_t first = 0; first < points_m.size(); first += kChunk) {
    const std::size_t count = std::min(kChunk, points_m.size() - first);
    for (std::size_t i = 0; i < count; ++i) chunk_m[i] = to_object(points_m[first + i]);
    Answers here{.signed_distance_m = part_of(answers.signed_distance_m, first, count),
                 .normal = part_of(answers.normal, first, count),
                 .surface_m = part_of(answers.surface_m, first, count),
                 .part = part_of(answers.part, first, count),
                 .layer = part_of(answers.layer, first, count),
                 .inside = part_of(answers.inside, first, count)};
    // Only the distance tells whether a surface point is one.
    if (!here.surface_m.empty() && here.signed_distance_m.empty())
      here.signed_distance_m = std::span(distance_m).first(count);
    object_->query(std::span(chunk_m).first(count), here, object_options);
    for (Vec3f& normal : here.normal) normal = to_world_direction(normal);
    for (std::size_t i = 0; i < here.surface_m.size(); ++i) {
      if (!std::isnan(here.signed_distance_m[i])) here.surface_m[i] = to_world(here.surface_m[i]);
    }
    for (float& d_m : here.signed_distance_m) d_m *= scale_;
  }
}

void Instance::certainty(std::span<const Vec3f> points_m, std::span<Certainty> told) const noexcept {
  for (std::size_t i = 0; i < points_m.size(); ++i) told[i] = object_->certainty(to_object(points_m[i]));
}

}  // namespace sqmap::runtime
