// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>

#include "sqmap/asset/result.hpp"
#include "sqmap/asset/superquadric.hpp"
#include "sqmap/asset/vec.hpp"

namespace sqmap::bake {

struct FitOptions {
  double min_exponent = 0.3;  ///< unbounded fits drift to boxes, whose maps are less accurate
  double max_exponent = 1.5;
  int max_iterations = 60;    ///< of each Levenberg-Marquardt run
  /// Semi-axes are kept above this share of the largest, so that flat and thin parts stay well-conditioned.
  double min_axis_ratio = 1e-3;

  Outcome check() const;
};

struct Fit {
  Superquadric shape;        ///< a3 is the longest semi-axis's direction where exponents allow the choice
  Pose object_from_part;
  double volume_m3{};        ///< of the superquadric
  double hull_volume_m3{};   ///< of the convex hull of the points; 0 when degenerate
  double mean_residual{};    ///< mean |beta^2 - 1| over the hull vertices [-], how snug the bound is
  int iterations{};          ///< of all runs together
};

/// The smallest bounding superquadric found for the points: beta(p) <= 1 for every one of them, without exception,
/// in double as in float (a margin of kBoundMargin is kept). Deterministic, single-threaded.
///
/// Residual sqrt(a1 a2 a3) (beta^2 - 1) (paper eq. (3) with the root inside), one-sided penalty on beta > 1, then a
/// minimum-volume refinement, then one exact inflation by max beta. Several axis assignments are tried.
///
/// Never fails for finite points: fewer than four points, collinear and coplanar sets get a shape with the smallest
/// allowed semi-axes. Errors: kBadOption; kInvalidMesh for no points or a coordinate that is not finite.
Result<Fit> fit_superquadric(std::span<const Vec3d> points_m, const FitOptions& options = {});

/// Bounding superquadrics are inflated by this share beyond their farthest vertex, so that the guarantee also holds
/// where beta is evaluated in float (whose error is below 3e-7 of it).
inline constexpr double kBoundMargin = 1e-6;

/// Volume of a superquadric [m^3]: 2 a1 a2 a3 e1 e2 B(e1/2 + 1, e1) B(e2/2, e2/2) (Jaklic et al. 2000).
double volume_m3(const Superquadric& shape);

}  // namespace sqmap::bake
