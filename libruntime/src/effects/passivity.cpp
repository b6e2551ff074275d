// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/effects/passivity.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sqmap::runtime {
namespace {

/// Of the stored energy, what may be missing before force is taken away: maps err by a few percent without
/// gaining anything in the long run, and the account bounds what they do gain.
constexpr double kMissing = 0.1;
/// Change of the share for a way of one depth: slow enough to be no jump, fast enough to be done before the
/// contact ends.
constexpr double kSharePerDepth = 4;

Vec3f unknown() noexcept {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  return {kNan, kNan, kNan};
}

double finite_or(double value, double other) noexcept { return std::isfinite(value) ? value : other; }

}  // namespace

/// Both places of a rigid body, to take a point of one to the other.
struct Passivity::Motion {
  bool is_known;
  Rotation<double> turn, last_turn;
  Placement at, last;

  Motion(const BodyState& body, const Placement& before, bool has_before) noexcept
      : is_known(body.body != nullptr && has_before),
        turn(rotation(body.at.world_from_object.orientation)),
        last_turn(rotation(before.world_from_object.orientation)),
        at(body.at),
        last(before) {}
  /// How far the point at p came in this step.
  Vec3d came(const Vec3d& p_m) const noexcept {
    const Vec3d in_body = turn.apply_inverse(p_m - at.world_from_object.translation_m);
    return p_m - ((last.scale / at.scale) * last_turn.apply(in_body) + last.world_from_object.translation_m);
  }
  /// How far the point that was at p went.
  Vec3d went(const Vec3d& p_m) const noexcept {
    const Vec3d in_body = last_turn.apply_inverse(p_m - last.world_from_object.translation_m);
    return (at.scale / last.scale) * turn.apply(in_body) + at.world_from_object.translation_m - p_m;
  }
};

std::span<const Parameter<Passivity>> Passivity::parameters() noexcept {
  static constexpr Parameter<Passivity> kTable[] = {{"reserve", &Passivity::reserve, 0, 1000}};
  return kTable;
}

void Passivity::prepare(std::size_t point_count) {
  pushes_.assign(point_count, {});
  last_m_.assign(point_count, unknown());
}

Passivity::Sums Passivity::sums(const Touches& touches, const Motion& motion) const noexcept {
  Sums now;
  for (std::size_t i = 0; i < touches.contacts.size(); ++i) {
    const Contact& contact = touches.contacts[i];
    const Vec3d force_n = cast<double>(touches.force_n[i]), p_m = cast<double>(contact.position_m);
    const Vec3d way_m = motion.is_known ? motion.came(p_m) : p_m - cast<double>(last_m_[contact.point]);
    const double stored_j = 0.5 * std::max(dot(force_n, cast<double>(contact.normal)), 0.0) * contact.depth_m;
    now.stored_j += stored_j;
    if (const double work_j = dot(force_n, way_m); std::isfinite(work_j))
      now.work_j += work_j;
    else
      now.found_j += stored_j;
  }
  return now;
}

double Passivity::work_of_last_j(const BodyState& body, const Motion& motion) const noexcept {
  double work_j = 0;
  for (const Push& push : std::span(pushes_).first(push_count_)) {
    const Vec3d p_m = cast<double>(push.position_m);
    Vec3d way_m;
    if (motion.is_known)
      way_m = motion.went(p_m);
    else if (push.point < body.points_m.size())
      way_m = cast<double>(body.points_m[push.point]) - p_m;
    work_j += dot(cast<double>(push.force_n), way_m);
  }
  return work_j;
}

double Passivity::share_for(const Sums& now) const noexcept {
  if (!(now.stored_j > 0)) return share_;
  const bool is_leaving = now.work_j > 0;
  const double left_j = std::max(energy_j_, 0.0);
  const double goal =
      is_leaving ? std::min(1.0, left_j / ((1 - kMissing) * (now.stored_j + 0.5 * now.work_j))) : 1;
  // Work over energy is twice the way over the depth.
  const double most_change = 0.5 * kSharePerDepth * std::abs(now.work_j) / now.stored_j;
  const double share = share_ + std::clamp(goal - share_, -most_change, most_change);
  if (!is_leaving) return share;
  // Half of a step like the last is done; of the other half a spring has no more to give than it holds.
  return std::min(share, left_j / (0.5 * now.work_j + std::min(0.5 * now.work_j, now.stored_j)));
}

void Passivity::touch(Touches& touches) noexcept {
  const Motion motion(touches.body, last_at_, has_last_at_);
  const Sums now = sums(touches, motion);
  energy_j_ = finite_or(energy_j_ - 0.5 * work_of_last_j(touches.body, motion) + now.found_j, 0);
  share_ = finite_or(share_for(now), 1);
  energy_j_ = finite_or(energy_j_ - 0.5 * share_ * now.work_j, 0);
  if (share_ < 1)
    for (Vec3f& force_n : touches.force_n) force_n = static_cast<float>(share_) * force_n;
  if (now.stored_j > 0) {
    most_j_ = std::max(most_j_, finite_or(now.stored_j, 0));
  } else if (most_j_ > 0) {
    most_before_j_ = most_j_;
    most_j_ = 0;
    share_ = 1;
  }
  const double most_j = std::max(most_j_, most_before_j_);
  energy_j_ = std::clamp(energy_j_, -most_j, finite_or(now.stored_j, 0) + reserve * most_j);
  remember(touches);
}

void Passivity::remember(const Touches& touches) noexcept {
  has_last_at_ = touches.body.body != nullptr;
  if (has_last_at_) {
    last_at_ = touches.body.at;
  } else {
    for (const Push& push : std::span(pushes_).first(push_count_)) last_m_[push.point] = unknown();
    const auto points_m = touches.body.points_m.first(std::min(touches.body.points_m.size(), last_m_.size()));
    std::copy(points_m.begin(), points_m.end(), last_m_.begin());
  }
  push_count_ = std::min(touches.contacts.size(), pushes_.size());
  for (std::size_t i = 0; i < push_count_; ++i) {
    const Contact& contact = touches.contacts[i];
    pushes_[i] = {touches.force_n[i], contact.position_m, contact.point};
    if (!has_last_at_) last_m_[contact.point] = contact.position_m;
  }
}

}  // namespace sqmap::runtime
