// SPDX-License-Identifier: GPL-3.0-or-later
//
// The model that fit.cpp optimises: a superquadric, its 14 parameters, and the derivatives of log beta
// and of the log-volume. Lengths are those of the normalised frame of fit.cpp (the set's half-extent is about
// 1).
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "sqmap/asset/superquadric.hpp"
#include "sqmap/asset/vec.hpp"
#include "sqmap/bake/fit.hpp"

namespace sqmap::bake::fit {

/// Layout of a parameter vector: centre, rotation vector, logarithms of the semi-axes, exponents, taper as a
/// share of max_taper(e1), bend. The first kRigidCount make a rigid superquadric, the first kStraightCount a
/// straight one.
enum Parameter : int {
  kCentre = 0,
  kTurn = 3,
  kLogAxes = 6,
  kE1 = 9,
  kE2 = 10,
  kRigidCount = 11,
  kTaper = 11,
  kStraightCount = 12,
  kBend = 12,
  kParameterCount = 14
};
using Vector = Eigen::Matrix<double, kParameterCount, 1>;
using Matrix = Eigen::Matrix<double, kParameterCount, kParameterCount>;

/// A superquadric in space.
struct Placed {
  Superquadric shape;
  Eigen::Matrix3d part_axes = Eigen::Matrix3d::Identity();  ///< columns: x, y, z of the part
  Vec3d centre;
};

struct Bounds {
  Vector lower, upper;
  bool is_straight() const noexcept { return !(lower[kBend] < upper[kBend]); }
  bool is_rigid() const noexcept { return is_straight() && !(lower[kTaper] < upper[kTaper]); }
};

/// What the parameters may be in the normalised frame; those of the bend only 0.
Bounds make_bounds(const FitOptions& options);

/// The parameter vector of `at`; its rotation vector, which counts from at.part_axes, is zero.
Vector parameters(const Placed& at);

/// The superquadric at `x`, whose rotation vector counts from `part_axes` in the part's own frame. A local
/// vector has no singularity within a turn of 180 degrees, where Euler angles lock.
Placed placed(const Vector& x, const Eigen::Matrix3d& part_axes);

/// log beta of one point and its derivatives by the parameters.
struct LogBeta {
  double value;
  Vector gradient;
};

/// Evaluates log beta at many points for one parameter vector.
class LogBetaModel {
 public:
  LogBetaModel(const Vector& x, const Eigen::Matrix3d& part_axes);
  double value(const Vec3d& point) const noexcept;
  LogBeta value_and_gradient(const Vec3d& point) const noexcept;

 private:
  /// log beta by log u, log |w| (u across the axis, w along it, both over the semi-axes), by w where it
  /// stands for itself, by e1 and by the taper.
  struct Meridian {
    double value, by_u, by_v, by_w, by_e, by_taper;
  };
  Eigen::Vector3d local(const Vec3d& point) const noexcept;
  Eigen::Vector3d straight(const Eigen::Vector3d& local) const noexcept;
  /// `by_straight`, the gradient at a place q of the straight frame, becomes that in the part frame; the
  /// result is that by the bend.
  Eigen::Vector2d bend_gradient(const Eigen::Vector3d& q, Eigen::Vector3d& by_straight) const noexcept;
  Meridian meridian(double log_u, double log_w, double sign) const noexcept;

  Eigen::Vector3d centre_, log_axes_;
  double e1_, e2_, share_, taper_;
  Bend<double> bend_;
  Eigen::Matrix3d axes_;           // columns: the part's axes
  Eigen::Matrix3d turn_jacobian_;  // of the rotation by its vector, in the part's frame
};

/// Whether the bend keeps well within what a bundle may hold (kMostBendTurn, kMostBendReach).
bool may_bend(const Superquadric& shape) noexcept;

/// Logarithm of the volume and its gradient.
double log_volume(const Vector& x);
Vector log_volume_gradient(const Vector& x);

/// log of volume(x) * (max beta)^3: the volume once `placed` is inflated to bound the points.
double inflated_log_volume(const Vector& x, const Eigen::Matrix3d& part_axes, std::span<const Vec3d> points);

}  // namespace sqmap::bake::fit
