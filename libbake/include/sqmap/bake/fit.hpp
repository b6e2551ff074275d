// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>

#include "sqmap/asset/result.hpp"
#include "sqmap/asset/superquadric.hpp"
#include "sqmap/asset/vec.hpp"

namespace sqmap::bake {

struct FitOptions {
  double min_exponent = 0.3;  ///< unbounded fits drift to boxes, whose maps are less accurate
  double max_exponent = 1.5;
  int max_iterations = 60;  ///< of each optimisation run; a fit makes some tens of them
  /// Semi-axes are kept above this share of the largest, so that flat and thin parts stay well-conditioned.
  double min_axis_ratio = 1e-3;
  /// One start and fewer points: several times faster, bounding all the same, a few percent larger. For
  /// comparing candidate cuts; the parts of an asset deserve the full fit.
  bool quick = false;
  bool taper = false;  ///< tapered superquadrics too, as far as they are convex: within 0.9 max_taper(e1)
  /// Bent ones too, where they are smaller; of the parts of an asset only: fit_superquadric, which sees
  /// points and no triangles between them, takes no notice.
  bool bend = false;

  /// kBadOption: exponents outside [kMinExponent, kMaxExponent] or out of order, max_iterations < 1,
  /// min_axis_ratio outside [1e-6, 1]. NaN is outside of everything.
  Outcome check() const;
};

/// Why the optimisation run that gave the shape ended.
enum class FitStop : std::uint8_t {
  kPoint,       ///< there was none: the points count as one
  kGain,        ///< a step no longer lowered the logarithm of the volume by 1e-6
  kNoDescent,   ///< no step, however short, lowered it
  kIterations,  ///< FitOptions::max_iterations
};

/// Stable, as in records: "point", "gain", "no-descent", "iterations".
const char* fit_stop_name(FitStop stop) noexcept;

struct Fit {
  Superquadric shape;  ///< of fits within 2 % of volume, the one whose longest semi-axis is a3
  Pose object_from_part;
  double volume_m3{};       ///< of the superquadric
  double hull_volume_m3{};  ///< of the convex hull of the points; 0 when degenerate
  double mean_residual{};   ///< mean |beta^2 - 1| over the hull vertices [-], how snug the bound is
  int iterations{};         ///< of all runs together
  FitStop stop{};
};

/// The smallest bounding superquadric found for the points: beta(p) <= 1 for every one of them, without
/// exception, in double as in float (a margin of kBoundMargin is kept). Deterministic, single-threaded; a
/// function of the set of points, not of their order.
///
/// From several frames and axis assignments, log V + 3 log |beta|_p over the hull vertices is minimised, p
/// from 16 up to 1024: the volume after inflation, as p grows. One exact inflation by max beta over all
/// points ends the fit. Points that lie on a superquadric give that superquadric, not the smaller one that
/// their gaps would allow: it is looked for by Levenberg-Marquardt on sqrt(a1 a2 a3) (beta^2 - 1), paper eq.
/// (3) with the root inside. As a first stage for all parts, which the paper makes it, it led to larger
/// bounds (2.190 times the hull, not 2.178; mean of 80 parts of five meshes) at twice the time.
///
/// Never fails for finite points: fewer than four points, collinear and coplanar sets get a shape with the
/// smallest allowed semi-axes; a set smaller than kMinHalfExtent gets a sphere of that size. Errors:
/// kBadOption; kInvalidMesh for no points, or a coordinate that is not finite or beyond 1e15 m.
Result<Fit> fit_superquadric(std::span<const Vec3d> points_m, const FitOptions& options = {});

/// Bounding superquadrics are inflated by this share beyond their farthest vertex, so that the guarantee also
/// holds where beta is evaluated in float (whose error is below 3e-7 of it).
inline constexpr double kBoundMargin = 1e-6;

/// Point sets with a smaller half-extent count as one point: this many metres, or this share of the largest
/// coordinate where that is more (a double resolves 1e-16 of it).
inline constexpr double kMinHalfExtent = 1e-12;

}  // namespace sqmap::bake
