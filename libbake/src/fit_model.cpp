// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Geometry>

namespace sqmap::bake::fit {
namespace {

/// Coordinates below this share of the unit frame count as this: log stays finite, and no bound is affected.
constexpr double kTiny = 1e-300;

/// log |(exp u, exp v)|_{2/e} with its derivatives by u, v and e. The first two sum to 1, but neither is
/// computed from the other: divided by a tiny coordinate, the rounding of 1 - share would be a large slope.
struct LogNorm {
  double value, by_u, by_v, by_e;
};

LogNorm log_norm(double u, double v, double e) noexcept {
  const double gap = -std::abs(u - v);         // log(n / m), m the larger
  const double power = std::exp(2 / e * gap);  // (n / m)^(2/e), in [0, 1]
  const double log_sum = std::log1p(power);
  const double by_m = 1 / (1 + power), by_n = power / (1 + power);
  return {std::max(u, v) + e / 2 * log_sum, u < v ? by_n : by_m, u < v ? by_m : by_n,
          log_sum / 2 - by_n * gap / e};
}

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& w) {
  Eigen::Matrix3d k;
  k << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
  return k;
}

/// J with exp(w + dw) = exp(w) exp(J dw) to first order: the right Jacobian of SO(3).
Eigen::Matrix3d right_jacobian(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  const Eigen::Matrix3d k = cross_matrix(w);
  constexpr double kSeriesBelow_rad =
      1e-4;  // there the next terms are below 1e-9, the quotients would cancel
  if (angle < kSeriesBelow_rad) return Eigen::Matrix3d::Identity() - k / 2 + k * k / 6;
  return Eigen::Matrix3d::Identity() - (1 - std::cos(angle)) / (angle * angle) * k +
         (angle - std::sin(angle)) / (angle * angle * angle) * k * k;
}

Eigen::Matrix3d turned(const Vector& x, const Eigen::Matrix3d& part_axes) {
  const Eigen::Vector3d w = x.segment<3>(kTurn);
  const double angle = w.norm();
  if (!(angle > 0)) return part_axes;
  return part_axes * Eigen::AngleAxisd(angle, w / angle).toRotationMatrix();
}

/// Tapers are kept below this share of max_taper: at all of it the surface has a crease of no curvature.
constexpr double kMostTaper = 0.9;

/// Derivative of max_taper.
double max_taper_slope(double e1) noexcept {
  return (std::numbers::ln2 / 2 * (1 - e1 / 2) - 0.5) * std::exp2(e1 / 2);
}

Superquadric shape_of(const Vector& x) {
  return {{std::exp(x[kLogAxes]), std::exp(x[kLogAxes + 1]), std::exp(x[kLogAxes + 2])},
          x[kE1],
          x[kE2],
          x[kTaper] * max_taper(x[kE1]),
          {x[kBend], x[kBend + 1]}};
}

}  // namespace

Bounds make_bounds(const FitOptions& options) {
  Bounds bounds;
  bounds.lower.setConstant(-4);  // the points lie in the unit ball; a turn stays below 180 degrees
  bounds.upper.setConstant(4);
  bounds.lower.segment<3>(kTurn).setConstant(-3);
  bounds.upper.segment<3>(kTurn).setConstant(3);
  bounds.lower.segment<3>(kLogAxes).setConstant(std::log(options.min_axis_ratio));
  bounds.upper.segment<3>(kLogAxes).setConstant(std::log(8.0));
  bounds.lower.segment<2>(kE1).setConstant(options.min_exponent);
  bounds.upper.segment<2>(kE1).setConstant(options.max_exponent);
  bounds.upper[kTaper] = options.taper ? kMostTaper : 0;
  bounds.lower[kTaper] = -bounds.upper[kTaper];
  bounds.lower.segment<2>(kBend).setZero();
  bounds.upper.segment<2>(kBend).setZero();
  return bounds;
}

Vector parameters(const Placed& at) {
  Vector x = Vector::Zero();
  for (int i = 0; i < 3; ++i) {
    x[kCentre + i] = at.centre[i];
    x[kLogAxes + i] = std::log(at.shape.semi_axes_m[i]);
  }
  x[kE1] = at.shape.e1;
  x[kE2] = at.shape.e2;
  x[kBend] = at.shape.bend.x;
  x[kBend + 1] = at.shape.bend.y;
  if (at.shape.taper != 0) x[kTaper] = at.shape.taper / max_taper(at.shape.e1);
  return x;
}

Placed placed(const Vector& x, const Eigen::Matrix3d& part_axes) {
  return {shape_of(x), turned(x, part_axes), {x[kCentre], x[kCentre + 1], x[kCentre + 2]}};
}

LogBetaModel::LogBetaModel(const Vector& x, const Eigen::Matrix3d& part_axes)
    : centre_(x.segment<3>(kCentre)),
      log_axes_(x.segment<3>(kLogAxes)),
      e1_(x[kE1]),
      e2_(x[kE2]),
      share_(x[kTaper]),
      taper_(share_ * max_taper(e1_)),
      bend_{x[kBend], x[kBend + 1]},
      axes_(turned(x, part_axes)),
      turn_jacobian_(right_jacobian(x.segment<3>(kTurn))) {}

Eigen::Vector3d LogBetaModel::local(const Vec3d& point) const noexcept {
  return axes_.transpose() * (Eigen::Vector3d(point.x, point.y, point.z) - centre_);
}

Eigen::Vector3d LogBetaModel::straight(const Eigen::Vector3d& local) const noexcept {
  if (bend_.is_none()) return local;
  const Vec3d q = straightened(bend_, {local.x(), local.y(), local.z()});
  return {q.x, q.y, q.z};
}

/// With p(q; k) of bent(), dp = B dq + dp/dk dk: at a fixed p, dq/dk = -B^-1 dp/dk.
Eigen::Vector2d LogBetaModel::bend_gradient(const Eigen::Vector3d& q,
                                            Eigen::Vector3d& by_straight) const noexcept {
  const Eigen::Vector2d bend(bend_.x, bend_.y);
  const double z = q.z(), lambda = 1 - bend.dot(q.head<2>()), angle = bend.norm() * z, square = angle * angle;
  // (1 - cos a) / a^2 and sin a / a, and their derivatives over a.
  constexpr double kSeriesBelow_rad =
      1e-2;  // there the next terms are below 1e-9, the quotients would cancel
  const bool series = std::abs(angle) < kSeriesBelow_rad;
  const double sine = std::sin(angle), cosine = std::cos(angle);
  const double versine_2 = series ? 0.5 - square / 24 : (1 - cosine) / square;
  const double sine_1 = series ? 1 - square / 6 : sine / angle;
  const double versine_slope = series ? -1.0 / 12 + square / 180 : (sine_1 - 2 * versine_2) / square;
  const double sine_slope = series ? -1.0 / 3 + square / 30 : (cosine - sine_1) / square;

  const Vec3d g = turned(bend_, {q.x(), q.y(), z}, {by_straight.x(), by_straight.y(), by_straight.z()});
  by_straight = {g.x, g.y, g.z};
  // p = (q_xy + bend z^2 versine_2 lambda, z sine_1 lambda)
  const double lean = bend.dot(by_straight.head<2>());
  Eigen::Vector2d gradient = by_straight.head<2>() * (z * z * versine_2 * lambda);
  gradient += bend * (z * z * lambda * (z * z * versine_slope * lean + z * sine_slope * by_straight.z()));
  gradient -= q.head<2>() * (z * z * versine_2 * lean + z * sine_1 * by_straight.z());
  return -gradient;
}

double LogBetaModel::value(const Vec3d& point) const noexcept {
  const Eigen::Vector3d p = straight(local(point));
  const Eigen::Vector3d log_p = p.cwiseAbs().cwiseMax(kTiny).array().log().matrix() - log_axes_;
  const double log_u = log_norm(log_p.x(), log_p.y(), e2_).value;
  if (taper_ == 0) return log_norm(log_u, log_p.z(), e1_).value;
  const double w = std::copysign(std::exp(log_p.z()), p.z());
  return std::log(tapered_radial<double>(std::exp(log_u), w, taper_, e1_));
}

LogBetaModel::Meridian LogBetaModel::meridian(double log_u, double log_w, double sign) const noexcept {
  if (taper_ == 0) {
    const LogNorm rigid = log_norm(log_u, log_w, e1_);
    const double height = std::copysign(std::exp(log_w - rigid.value), sign);
    return {rigid.value, rigid.by_u, rigid.by_v, 0, rigid.by_e, -rigid.by_u * height};
  }
  const double w = std::copysign(std::exp(log_w), sign);
  const double t = tapered_radial<double>(std::exp(log_u), w, taper_, e1_);
  const double width = t + taper_ * w, log_t = std::log(t);
  const LogNorm here = log_norm(log_u - std::log(width), log_w - log_t, e1_);  // value 0
  const double scale = 1 / (here.by_u * t / width + here.by_v);
  return {log_t,
          scale * here.by_u,
          scale * here.by_v,
          -scale * here.by_u * taper_ / width,
          scale * here.by_e,
          -scale * here.by_u * w / width};
}

LogBeta LogBetaModel::value_and_gradient(const Vec3d& point) const noexcept {
  const Eigen::Vector3d in_part = local(point), p = straight(in_part);
  const Eigen::Vector3d log_p = p.cwiseAbs().cwiseMax(kTiny).array().log().matrix() - log_axes_;
  const LogNorm parallel = log_norm(log_p.x(), log_p.y(), e2_);
  const Meridian meridian = this->meridian(parallel.value, log_p.z(), p.z());

  Eigen::Vector3d by_log_p(meridian.by_u * parallel.by_u, meridian.by_u * parallel.by_v, meridian.by_v);
  Eigen::Vector3d by_p;
  // Exponents up to 2 keep share / p finite as p -> 0; on the plane of symmetry 0 is the subgradient in its
  // middle.
  for (int i = 0; i < 3; ++i) by_p[i] = std::abs(p[i]) > kTiny ? by_log_p[i] / p[i] : 0;
  const double by_z = meridian.by_w * std::exp(-log_axes_.z());
  by_p.z() += by_z;
  by_log_p.z() += by_z * p.z();

  LogBeta result{meridian.value, {}};
  result.gradient.segment<2>(kBend).setZero();
  if (!bend_.is_none()) result.gradient.segment<2>(kBend) = bend_gradient(p, by_p);
  result.gradient.segment<3>(kCentre) = -(axes_ * by_p);
  result.gradient.segment<3>(kTurn) = turn_jacobian_.transpose() * by_p.cross(in_part);
  result.gradient.segment<3>(kLogAxes) = -by_log_p;
  result.gradient[kE1] = meridian.by_e + meridian.by_taper * share_ * max_taper_slope(e1_);
  result.gradient[kE2] = meridian.by_u * parallel.by_e;
  result.gradient[kTaper] = meridian.by_taper * max_taper(e1_);
  return result;
}

bool may_bend(const Superquadric& shape) noexcept {
  constexpr double kShare = 0.95;  // what bounding whole triangles may add
  return shape.bend.curvature() * shape.semi_axes_m.z <= kShare * kMostBendTurn &&
         bend_reach(shape) <= kShare * kMostBendReach;
}

double log_volume(const Vector& x) {
  // Of the unit shape, so that no axis can under- or overflow it.
  const Superquadric unit{{1, 1, 1}, x[kE1], x[kE2], x[kTaper] * max_taper(x[kE1])};
  return std::log(volume_m3(unit)) + x.segment<3>(kLogAxes).sum();
}

Vector log_volume_gradient(const Vector& x) {
  constexpr double kStep = 1e-5;  // central: truncation and rounding both stay below 1e-9
  Vector gradient = Vector::Zero();
  gradient.segment<3>(kLogAxes).setOnes();
  for (const int i : {kE1, kE2, kTaper}) {
    Vector above = x, below = x;
    above[i] += kStep;
    below[i] -= kStep;
    gradient[i] = (log_volume(above) - log_volume(below)) / (2 * kStep);
  }
  return gradient;
}

double inflated_log_volume(const Vector& x, const Eigen::Matrix3d& part_axes, std::span<const Vec3d> points) {
  const LogBetaModel model(x, part_axes);
  double farthest = -std::numeric_limits<double>::infinity();
  for (const Vec3d& point : points) farthest = std::max(farthest, model.value(point));
  return log_volume(x) + 3 * farthest;
}

}  // namespace sqmap::bake::fit
