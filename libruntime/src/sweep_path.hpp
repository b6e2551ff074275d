// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "sqmap/runtime/instance.hpp"
#include "sqmap/runtime/sweep.hpp"

#include "quaternion_of.hpp"

namespace sqmap::runtime {

/// Path of a point in the frame of an object that moves, over the time 0 to 1 [object metres]:
///
///     q(t) = M^T exp(-t [w]) u(t) / s,   u(t) = u0 + t u',
///
/// u from the object's origin to the point in the world, w the angular velocity, M and s orientation and
/// scale of the start.
class SweepPath {
 public:
  SweepPath(const Instance& start, const Instance& end, const PointMotion& motion) noexcept
      : orientation_(in_double(start.orientation())),
        inverse_scale_(1 / static_cast<double>(start.scale())),
        from_m_(cast<double>(motion.from_m)),
        to_m_(cast<double>(motion.to_m)),
        u_m_(from_m_ - start.translation_m()),
        u_end_m_(to_m_ - end.translation_m()) {
    slope_m_ = u_end_m_ - u_m_;
    if (!(start.orientation().row == end.orientation().row)) turn_from(in_double(end.orientation()));
  }

  bool is_finite() const noexcept {
    const double all = dot(u_m_, u_m_) + dot(slope_m_, slope_m_) + angle_rad_;
    return std::isfinite(all);
  }

  /// The point, its velocity, and a bound on its acceleration from t to 1; object frame.
  struct State {
    Vec3d p_m, velocity_m;
    double acceleration_m;
  };
  State at(double t) const noexcept {
    const Vec3d u_m = u_m_ + t * slope_m_;
    const Vec3d rate_m = slope_m_ - angle_rad_ * cross(axis_, u_m);
    // |u| is convex in t.
    const double farthest_m = std::max(norm(u_m), norm(u_end_m_));
    return {into_object(t, u_m), into_object(t, rate_m),
            inverse_scale_ * angle_rad_ * (2 * norm(slope_m_) + angle_rad_ * farthest_m)};
  }

  /// A direction of the object at time t in the world; of unit length if d is.
  Vec3d to_world_direction(double t, const Vec3d& d) const noexcept {
    return turned(orientation_.apply(d), t * angle_rad_);
  }
  /// The point in the world.
  Vec3d in_world(double t) const noexcept { return (1 - t) * from_m_ + t * to_m_; }

 private:
  static Rotation<double> in_double(const Rotation<float>& r) noexcept {
    return {{cast<double>(r.row[0]), cast<double>(r.row[1]), cast<double>(r.row[2])}};
  }
  Vec3d turned(const Vec3d& v, double angle_rad) const noexcept {
    if (angle_rad == 0) return v;
    const double c = std::cos(angle_rad), s = std::sin(angle_rad);
    return c * v + s * cross(axis_, v) + (1 - c) * dot(axis_, v) * axis_;
  }
  Vec3d into_object(double t, const Vec3d& v) const noexcept {
    return inverse_scale_ * orientation_.apply_inverse(turned(v, -t * angle_rad_));
  }
  /// Axis and angle, at most half a turn, of end * start^T.
  void turn_from(const Rotation<double>& end) noexcept {
    Rotation<double> turn;
    for (int i = 0; i < 3; ++i) turn.row[i] = orientation_.apply(end.row[i]);
    const Quaternion q = quaternion_of(turn);
    const Vec3d v = q.w < 0 ? Vec3d{-q.x, -q.y, -q.z} : Vec3d{q.x, q.y, q.z};
    angle_rad_ = 2 * std::atan2(norm(v), std::abs(q.w));
    axis_ = normalized(v);
  }

  Rotation<double> orientation_;
  double inverse_scale_;
  Vec3d from_m_, to_m_, u_m_, u_end_m_, slope_m_, axis_;
  double angle_rad_{};
};

/// Time in which a point at distance h_m > 0 from a plane, its velocity along the plane's normal given,
/// cannot reach it; infinite where it never can.
inline double time_to_plane(double h_m, double along_normal_m, double acceleration_m) noexcept {
  const double root = std::sqrt(along_normal_m * along_normal_m + 2 * acceleration_m * h_m);
  const double sum = root - along_normal_m;
  return sum > 0 ? 2 * h_m / sum : std::numeric_limits<double>::infinity();
}

/// Time in which the point cannot leave a ball of radius d_m around where it is.
inline double time_in_ball(double d_m, const SweepPath::State& state) noexcept {
  return time_to_plane(d_m, -norm(state.velocity_m), state.acceleration_m);
}

}  // namespace sqmap::runtime
