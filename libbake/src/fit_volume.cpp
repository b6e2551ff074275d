// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Cholesky>

#include "fit_solve.hpp"

namespace sqmap::bake::fit {
namespace {

/// Value of log V + 3 log |beta|_p with a local model of it.
struct Objective {
  double value;
  Vector gradient;
  Matrix hessian;  ///< without the curvature of log beta itself: positive semi-definite, dominant for large p
};

class InflatedVolume {
 public:
  InflatedVolume(std::span<const Vec3d> points, const Eigen::Matrix3d& part_axes, double p)
      : points_(points), part_axes_(part_axes), p_(p), log_betas_(points.size()) {}

  double value(const Vector& x) {
    const LogBetaModel model(x, part_axes_);
    for (std::size_t i = 0; i < points_.size(); ++i) log_betas_[i] = model.value(points_[i]);
    log_norm_ = log_p_norm();
    if (x[kBend] != 0 || x[kBend + 1] != 0) {
      Superquadric shape = placed(x, part_axes_).shape;
      shape.semi_axes_m = std::exp(log_norm_) * shape.semi_axes_m;
      if (!may_bend(shape)) return std::numeric_limits<double>::infinity();
    }
    return log_volume(x) + 3 * log_norm_;
  }

  /// At the x that value() was last asked for.
  Objective with_derivatives(const Vector& x) const {
    const LogBetaModel model(x, part_axes_);
    Vector mean = Vector::Zero();
    Matrix square = Matrix::Zero();
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const double log_weight = p_ * (log_betas_[i] - log_norm_);
      if (log_weight < kNegligible) continue;
      const double weight = std::exp(log_weight);  // they sum to 1
      const Vector gradient = model.value_and_gradient(points_[i]).gradient;
      mean += weight * gradient;
      square.selfadjointView<Eigen::Lower>().rankUpdate(gradient, weight);
    }
    square.triangularView<Eigen::StrictlyUpper>() = square.transpose();
    return {log_volume(x) + 3 * log_norm_, log_volume_gradient(x) + 3 * mean,
            3 * p_ * (square - mean * mean.transpose())};
  }

 private:
  static constexpr double kNegligible = -20.7;  ///< log of a weight's share in their sum
  static constexpr double kLost = -45;          ///< log of what, added to 1 a thousand times, leaves it 1

  double log_p_norm() const {
    const double farthest = *std::max_element(log_betas_.begin(), log_betas_.end());
    double sum = 0;
    for (const double log_beta : log_betas_) {
      const double log_term = p_ * (log_beta - farthest);
      if (!(log_term < kLost)) sum += std::exp(log_term);  // NaN: keep
    }
    return farthest + std::log(sum) / p_;
  }

  std::span<const Vec3d> points_;
  Eigen::Matrix3d part_axes_;
  double p_;
  std::vector<double> log_betas_;  ///< and their norm, at the last x
  double log_norm_ = 0;
};

/// The Newton step of `model` with Marquardt's damping; parameters that would leave their bounds do not move.
Vector damped_step(const Objective& model, const Vector& x, const Bounds& bounds, double damping) {
  Matrix hessian = model.hessian;
  Vector descent = -model.gradient;
  // Directions without curvature (the scale; a turn about an axis of symmetry) must not give an endless step.
  constexpr double kFloor = 1e-3;
  hessian.diagonal() += damping * (hessian.diagonal().array() + kFloor).matrix();
  for (int i = 0; i < kParameterCount; ++i) {
    const bool blocked =
        (descent[i] < 0 && x[i] <= bounds.lower[i]) || (descent[i] > 0 && x[i] >= bounds.upper[i]);
    if (!blocked) continue;
    hessian.row(i).setZero();
    hessian.col(i).setZero();
    hessian(i, i) = 1;
    descent[i] = 0;
  }
  if (!bounds.is_straight()) return hessian.ldlt().solve(descent);
  Vector step = Vector::Zero();
  if (!bounds.is_rigid()) {
    step.head<kStraightCount>() =
        hessian.topLeftCorner<kStraightCount, kStraightCount>().ldlt().solve(descent.head<kStraightCount>());
    return step;
  }
  step.head<kRigidCount>() =
      hessian.topLeftCorner<kRigidCount, kRigidCount>().ldlt().solve(descent.head<kRigidCount>());
  return step;
}

/// Adds to `iterations`.
FitStop minimise(Vector& x, InflatedVolume& objective, const Bounds& bounds, int max_iterations,
                 int& iterations) {
  constexpr double kGain = 1e-6;  // of the log-volume: further steps would not show in a part
  constexpr double kMaxDamping = 1e8;
  double damping = 1e-2;
  const double first = objective.value(x);
  Objective model = objective.with_derivatives(x);
  model.value = first;
  for (int k = 0; k < max_iterations; ++k) {
    if (damping >= kMaxDamping) return FitStop::kNoDescent;
    ++iterations;
    const Vector next =
        (x + damped_step(model, x, bounds, damping)).cwiseMax(bounds.lower).cwiseMin(bounds.upper);
    const double gain = next.allFinite() ? model.value - objective.value(next) : -1;
    if (!(gain > 0)) {  // NaN: refuse
      damping *= 8;
      continue;
    }
    x = next;
    damping = std::max(damping / 5, 1e-6);
    if (gain < kGain) return FitStop::kGain;
    model = objective.with_derivatives(x);
  }
  return damping < kMaxDamping ? FitStop::kIterations : FitStop::kNoDescent;
}

}  // namespace

void solve_volume(Candidate& candidate, std::span<const Vec3d> points, const Bounds& bounds,
                  int max_iterations, double first_p, double last_p) {
  for (double p = first_p; p <= last_p; p *= 4) {
    Vector x = parameters(candidate.at).cwiseMax(bounds.lower).cwiseMin(bounds.upper);
    InflatedVolume objective(points, candidate.at.part_axes, p);
    candidate.stop = minimise(x, objective, bounds, max_iterations, candidate.iterations);
    candidate.at = placed(x, candidate.at.part_axes);
  }
}

}  // namespace sqmap::bake::fit
