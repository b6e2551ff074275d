// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <vector>

#include <ceres/ceres.h>

#include "fit_solve.hpp"

namespace sqmap::bake::fit {
namespace {

/// Weight of the residual of a point outside: the surface then leans outwards, as a bound must.
constexpr double kOutsideWeight = 3;

class SurfaceResiduals final : public ceres::CostFunction {
 public:
  SurfaceResiduals(std::span<const Vec3d> points, const Eigen::Matrix3d& part_axes)
      : points_(points), part_axes_(part_axes) {
    set_num_residuals(static_cast<int>(points.size()));
    mutable_parameter_block_sizes()->push_back(kParameterCount);
  }

  bool Evaluate(double const* const* blocks, double* residuals, double** jacobians) const override {
    const Vector x = Eigen::Map<const Vector>(blocks[0]);
    const LogBetaModel model(x, part_axes_);
    const double scale = std::exp(x.segment<3>(kLogAxes).sum() / 2);  // sqrt(a1 a2 a3)
    const bool with_gradient = jacobians != nullptr && jacobians[0] != nullptr;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      LogBeta log_beta{};
      if (with_gradient)
        log_beta = model.value_and_gradient(points_[i]);
      else
        log_beta.value = model.value(points_[i]);
      const double weight = log_beta.value > 0 ? scale * kOutsideWeight : scale;
      residuals[i] = weight * std::expm1(2 * log_beta.value);
      if (!with_gradient) continue;
      Vector gradient = 2 * weight * std::exp(2 * log_beta.value) * log_beta.gradient;
      gradient.segment<3>(kLogAxes).array() += residuals[i] / 2;
      Eigen::Map<Vector>(jacobians[0] + i * kParameterCount) = gradient;
    }
    return true;
  }

 private:
  std::span<const Vec3d> points_;
  Eigen::Matrix3d part_axes_;
};

}  // namespace

void solve_surface(Candidate& candidate, std::span<const Vec3d> points, const Bounds& bounds,
                   int max_iterations) {
  Vector x = parameters(candidate.at).cwiseMax(bounds.lower).cwiseMin(bounds.upper);

  ceres::Problem::Options ownership;
  ownership.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  SurfaceResiduals residuals(points, candidate.at.part_axes);
  ceres::Problem problem(ownership);
  problem.AddResidualBlock(&residuals, nullptr, x.data());
  std::vector<int> fixed;  // Ceres takes no parameter whose bounds are equal
  for (int i = 0; i < kParameterCount; ++i) {
    if (!(bounds.lower[i] < bounds.upper[i])) {
      fixed.push_back(i);
      continue;
    }
    problem.SetParameterLowerBound(x.data(), i, bounds.lower[i]);
    problem.SetParameterUpperBound(x.data(), i, bounds.upper[i]);
  }
  if (!fixed.empty()) problem.SetManifold(x.data(), new ceres::SubsetManifold(kParameterCount, fixed));

  ceres::Solver::Options options;
  options.max_num_iterations = max_iterations;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  options.function_tolerance = 1e-8;
  options.num_threads = 1;  // more would sum in an order of chance
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  candidate.iterations += static_cast<int>(summary.iterations.size());
  candidate.stop = summary.termination_type == ceres::CONVERGENCE      ? FitStop::kGain
                   : summary.termination_type == ceres::NO_CONVERGENCE ? FitStop::kIterations
                                                                       : FitStop::kNoDescent;
  if (x.allFinite()) candidate.at = placed(x, candidate.at.part_axes);
}

}  // namespace sqmap::bake::fit
