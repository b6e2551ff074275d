// SPDX-License-Identifier: Apache-2.0
#include "motion.hpp"

#include <algorithm>
#include <cmath>

namespace sqmap::apps {
namespace {

Quaternion product(const Quaternion& a, const Quaternion& b) {
  return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
          a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}

Quaternion conjugate(const Quaternion& q) { return {q.w, -q.x, -q.y, -q.z}; }

/// The turn by the length of v about it.
Quaternion turn_by(const Vec3d& v) {
  const double angle = norm(v);
  const double s = angle > 0 ? std::sin(angle / 2) / angle : 0.5;
  return {std::cos(angle / 2), s * v.x, s * v.y, s * v.z};
}

/// Axis times angle, in (-pi, pi].
Vec3d turn_of(Quaternion q) {
  if (q.w < 0) q = {-q.w, -q.x, -q.y, -q.z};
  const Vec3d v{q.x, q.y, q.z};
  const double s = norm(v);
  return s > 0 ? (2 * std::atan2(s, q.w) / s) * v : Vec3d{};
}

}  // namespace

Pose pose_at(std::span<const Keyframe> keyframes, double time_s) {
  const auto next = std::ranges::upper_bound(keyframes, time_s, {}, &Keyframe::time_s);
  if (next == keyframes.begin()) return keyframes.front().pose;
  if (next == keyframes.end()) return keyframes.back().pose;
  const Keyframe& a = *(next - 1);
  const double share = (time_s - a.time_s) / (next->time_s - a.time_s);
  const Vec3d turn = turn_of(product(next->pose.orientation, conjugate(a.pose.orientation)));
  return {product(turn_by(share * turn), a.pose.orientation),
          a.pose.translation_m + share * (next->pose.translation_m - a.pose.translation_m)};
}

void CoupledProbe::step(const Pose& handle, const Vec3d& force_n, const Vec3d& torque_nm,
                        double step_s) noexcept {
  const Coupling& c = coupling_;
  const Vec3d pull_n = c.stiffness_n_per_m * (handle.translation_m - pose_.translation_m);
  velocity_m_per_s_ = (1 / (1 + step_s * c.damping_n_s_per_m / c.mass_kg)) *
                      (velocity_m_per_s_ + (step_s / c.mass_kg) * (pull_n + force_n));
  pose_.translation_m = pose_.translation_m + step_s * velocity_m_per_s_;

  const Vec3d twist_nm =
      c.stiffness_nm_per_rad * turn_of(product(handle.orientation, conjugate(pose_.orientation)));
  turn_rad_per_s_ = (1 / (1 + step_s * c.damping_nm_s_per_rad / c.inertia_kg_m2)) *
                    (turn_rad_per_s_ + (step_s / c.inertia_kg_m2) * (twist_nm + torque_nm));
  const Quaternion q = product(turn_by(step_s * turn_rad_per_s_), pose_.orientation);
  const double length = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  pose_.orientation = {q.w / length, q.x / length, q.y / length, q.z / length};
}

}  // namespace sqmap::apps
