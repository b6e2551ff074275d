// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Geometry>

#include "sqmap/bake/fit.hpp"

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

/// Derivative of max_taper.
double max_taper_slope(double e1) noexcept {
  return (std::numbers::ln2 / 2 * (1 - e1 / 2) - 0.5) * std::exp2(e1 / 2);
}

Superquadric shape_of(const Vector& x) {
  return {{std::exp(x[kLogAxes]), std::exp(x[kLogAxes + 1]), std::exp(x[kLogAxes + 2])},
          x[kE1],
          x[kE2],
          x[kTaper] * max_taper(x[kE1])};
}

}  // namespace

Vector parameters(const Placed& at) {
  Vector x = Vector::Zero();
  for (int i = 0; i < 3; ++i) {
    x[kCentre + i] = at.centre[i];
    x[kLogAxes + i] = std::log(at.shape.semi_axes_m[i]);
  }
  x[kE1] = at.shape.e1;
  x[kE2] = at.shape.e2;
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
      axes_(turned(x, part_axes)),
      turn_jacobian_(right_jacobian(x.segment<3>(kTurn))) {}

Eigen::Vector3d LogBetaModel::local(const Vec3d& point) const noexcept {
  return axes_.transpose() * (Eigen::Vector3d(point.x, point.y, point.z) - centre_);
}

double LogBetaModel::value(const Vec3d& point) const noexcept {
  const Eigen::Vector3d p = local(point);
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
  const Eigen::Vector3d p = local(point);
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
  result.gradient.segment<3>(kCentre) = -(axes_ * by_p);
  result.gradient.segment<3>(kTurn) = turn_jacobian_.transpose() * by_p.cross(p);
  result.gradient.segment<3>(kLogAxes) = -by_log_p;
  result.gradient[kE1] = meridian.by_e + meridian.by_taper * share_ * max_taper_slope(e1_);
  result.gradient[kE2] = meridian.by_u * parallel.by_e;
  result.gradient[kTaper] = meridian.by_taper * max_taper(e1_);
  return result;
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
