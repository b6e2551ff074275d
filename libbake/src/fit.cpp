// SPDX-License-Identifier: GPL-3.0-or-later
#include "sqmap/bake/fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <sstream>
#include <vector>

#include <Eigen/Geometry>

#include "fit_model.hpp"
#include "fit_solve.hpp"
#include "fit_starts.hpp"
#include "hull.hpp"

namespace sqmap::bake {
namespace {

using fit::Bounds;
using fit::Candidate;
using fit::Placed;

constexpr double kMaxCoordinate_m = 1e15;  ///< as read_mesh; volumes then stay far from overflow

/// How much work a fit is worth.
struct Effort {
  std::size_t points;  ///< hull vertices that take part in the optimisation at first
  std::size_t starts, finalists;
  int grid;         ///< nodes along each exponent in the choice of starts
  double screen_p;  ///< of the p-norm that decides which starts become finalists
  double last_p;    ///< of the p-norm that stands for the largest beta
  int rounds;       ///< of adding hull vertices that were left out and stick out
};
constexpr Effort kFull{192, 6, 3, 4, 64, 1024, 3};
constexpr Effort kQuick{64, 1, 1, 3, 64, 256, 0};
constexpr double kFirstP = 16;

/// Rows of a map run along z: of fits this close in log-volume, the one with its long axis on z is sampled
/// best.
constexpr double kAsGood = 0.02;

/// Points whose log beta is this much below the largest, on average, lie on the superquadric. Below
/// kNearSurface it is worth looking for such a one: 500 sampled superquadrics had at most 0.009, 96 parts of
/// meshes at least 0.04.
constexpr double kOnSurface = 1e-4;
constexpr double kNearSurface = 0.02;
/// Through fewer points than this pass superquadrics that say nothing about the part (any 11 have one).
constexpr std::size_t kDetermined = std::size_t{3} * fit::kRigidCount;
/// What the corners that no point samples may add to the log-volume of the smallest bound.
constexpr double kUnsampled = 0.2;

double mean_gap(const Placed& at, const std::vector<Vec3d>& points) {
  const fit::LogBetaModel model(fit::parameters(at), at.part_axes);
  double farthest = -std::numeric_limits<double>::infinity(), sum = 0;
  for (const Vec3d& p : points) {
    const double log_beta = model.value(p);
    farthest = std::max(farthest, log_beta);
    sum += log_beta;
  }
  return farthest - sum / static_cast<double>(points.size());
}

double inflated(const Placed& at, const std::vector<Vec3d>& points) {
  return fit::inflated_log_volume(fit::parameters(at), at.part_axes, points);
}

bool z_is_longest(const Superquadric& shape) {
  return shape.semi_axes_m.z >= std::max(shape.semi_axes_m.x, shape.semi_axes_m.y);
}

/// Adds to `subset` the hull vertices that stick out of the superquadric that was optimised over it.
bool add_outliers(const Placed& at, const std::vector<Vec3d>& hull, std::vector<Vec3d>& subset) {
  constexpr double kNoticeable = 1e-4;
  constexpr std::size_t kAtOnce = 16;
  const fit::LogBetaModel model(fit::parameters(at), at.part_axes);
  double bounded = -std::numeric_limits<double>::infinity();
  for (const Vec3d& p : subset) bounded = std::max(bounded, model.value(p));
  std::vector<std::pair<double, std::size_t>> outside;
  for (std::size_t i = 0; i < hull.size(); ++i)
    if (const double u = model.value(hull[i]); u > bounded + kNoticeable) outside.emplace_back(-u, i);
  std::sort(outside.begin(), outside.end());
  if (outside.size() > kAtOnce) outside.resize(kAtOnce);
  for (const auto& [u, i] : outside) subset.push_back(hull[i]);
  return !outside.empty();
}

/// Ascending by inflated volume over the points.
void sort_by_volume(std::vector<Candidate>& candidates, const std::vector<Vec3d>& points) {
  std::vector<std::pair<double, Candidate>> keyed;
  for (const Candidate& c : candidates) keyed.emplace_back(inflated(c.at, points), c);
  std::stable_sort(keyed.begin(), keyed.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  for (std::size_t i = 0; i < keyed.size(); ++i) candidates[i] = keyed[i].second;
}

/// Keeps the first `count`; of those that are nearly as good as the first, one with z along its longest axis.
void keep_finalists(std::vector<Candidate>& candidates, std::size_t count) {
  if (candidates.size() <= count) return;
  const auto along_z = std::find_if(candidates.begin(), candidates.end(),
                                    [](const Candidate& c) { return z_is_longest(c.at.shape); });
  if (along_z != candidates.end() && along_z >= candidates.begin() + static_cast<std::ptrdiff_t>(count))
    std::iter_swap(along_z, candidates.begin() + static_cast<std::ptrdiff_t>(count) - 1);
  candidates.resize(count);
}

Candidate optimise(const Hull& hull, const FitOptions& options) {
  const Effort& effort = options.quick ? kQuick : kFull;
  const Bounds bounds = fit::make_bounds(options);
  std::vector<Vec3d> points = fit::spread_subset(hull, effort.points);

  std::vector<Placed> starts = fit::starts(hull, points, bounds, effort.grid);
  std::vector<Candidate> candidates;
  for (const Placed& start : starts) {
    if (candidates.size() == effort.starts) break;
    candidates.push_back({start});
    fit::solve_volume(candidates.back(), points, bounds, options.max_iterations, kFirstP, effort.screen_p);
  }
  int iterations = 0;
  for (const Candidate& c : candidates) iterations += c.iterations;
  sort_by_volume(candidates, points);
  keep_finalists(candidates, effort.finalists);

  for (Candidate& c : candidates) {
    c.iterations = 0;
    fit::solve_volume(c, points, bounds, options.max_iterations, 4 * effort.screen_p, effort.last_p);
    for (int round = 0; round < effort.rounds && add_outliers(c.at, hull.vertices, points); ++round)
      fit::solve_volume(c, points, bounds, options.max_iterations, effort.last_p, effort.last_p);
    iterations += c.iterations;
  }
  sort_by_volume(candidates, hull.vertices);
  Candidate best = candidates.front();
  const double smallest = inflated(best.at, hull.vertices);
  for (const Candidate& c : candidates)
    if (z_is_longest(c.at.shape) && inflated(c.at, hull.vertices) < smallest + kAsGood) {
      best = c;
      break;
    }

  if (hull.vertices.size() >= kDetermined && mean_gap(best.at, points) < kNearSurface) {
    starts.insert(starts.begin(), {best.at, fit::twin(best.at, bounds)});
    for (const Placed& start : starts) {
      Candidate exact{start};
      fit::solve_surface(exact, points, bounds, options.max_iterations);
      iterations += exact.iterations;
      if (mean_gap(exact.at, hull.vertices) < kOnSurface &&
          inflated(exact.at, hull.vertices) < smallest + kUnsampled)
        return {exact.at, iterations, exact.stop};
    }
  }
  return {best.at, iterations, best.stop};
}

double max_abs(const Vec3d& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

/// The middle and half-extent of the points; the optimisation sees them in the unit ball around it.
struct Frame {
  Vec3d centre_m;
  double radius_m;
  double magnitude_m;  ///< largest coordinate
};

Frame frame_of(std::span<const Vec3d> points_m) {
  Vec3d low = points_m.front(), high = low;
  Frame frame{{}, 0, 0};
  for (const Vec3d& p : points_m) {
    for (int i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], p[i]);
      high[i] = std::max(high[i], p[i]);
    }
    frame.magnitude_m = std::max(frame.magnitude_m, max_abs(p));
  }
  frame.centre_m = 0.5 * low + 0.5 * high;
  for (const Vec3d& p : points_m) frame.radius_m = std::max(frame.radius_m, norm(p - frame.centre_m));
  return frame;
}

/// Scales the shape so that its farthest point has beta 1 - kBoundMargin: the one step that makes the bound,
/// exact because beta is homogeneous, and evaluated with the very pose that is returned.
void inflate(Fit& result, std::span<const Vec3d> points_m, bool may_shrink) {
  const Rotation<double> turn = rotation(result.object_from_part.orientation);
  double farthest = may_shrink ? 0 : 1;
  for (const Vec3d& p : points_m)
    farthest = std::max(
        farthest,
        inside_outside_radial(result.shape, turn.apply_inverse(p - result.object_from_part.translation_m)));
  if (!(farthest > 0)) farthest = 1;
  result.shape.semi_axes_m = farthest * (1 + kBoundMargin) * result.shape.semi_axes_m;
}

Error bad_option(const char* name, double value, const std::string& required) {
  std::ostringstream finding;
  finding << "fit." << name << " = " << value << ", must be " << required;
  return {Status::kBadOption, finding.str(), ""};
}

std::optional<Error> check_points(std::span<const Vec3d> points_m) {
  if (points_m.empty())
    return Error{Status::kInvalidMesh, "0 points to fit a superquadric to, need at least 1", ""};
  for (std::size_t i = 0; i < points_m.size(); ++i)
    if (const Vec3d& p = points_m[i]; !(std::isfinite(p.x + p.y + p.z) && max_abs(p) <= kMaxCoordinate_m)) {
      std::ostringstream finding;
      finding << "point " << i << " of a part is (" << p.x << ", " << p.y << ", " << p.z
              << "), coordinates must be finite and at most " << kMaxCoordinate_m << " m";
      return Error{Status::kInvalidMesh, finding.str(), "repair the mesh, or choose a larger unit"};
    }
  return std::nullopt;
}

}  // namespace

Outcome FitOptions::check() const {
  std::ostringstream range;
  range << "in [" << kMinExponent << ", " << kMaxExponent << "]";
  if (!(min_exponent >= kMinExponent && min_exponent <= kMaxExponent))
    return bad_option("min_exponent", min_exponent, range.str());
  if (!(max_exponent >= kMinExponent && max_exponent <= kMaxExponent))
    return bad_option("max_exponent", max_exponent, range.str());
  if (!(min_exponent <= max_exponent))
    return bad_option("min_exponent", min_exponent, "at most max_exponent");
  if (max_iterations < 1) return bad_option("max_iterations", max_iterations, "at least 1");
  if (!(min_axis_ratio >= 1e-6 && min_axis_ratio <= 1))
    return bad_option("min_axis_ratio", min_axis_ratio, "in [1e-6, 1]");
  return Done{};
}

const char* fit_stop_name(FitStop stop) noexcept {
  switch (stop) {
    case FitStop::kPoint:
      return "point";
    case FitStop::kGain:
      return "gain";
    case FitStop::kNoDescent:
      return "no-descent";
    case FitStop::kIterations:
      return "iterations";
  }
  return "unknown";
}

Result<Fit> fit_superquadric(std::span<const Vec3d> points_m, const FitOptions& options) {
  if (const Outcome outcome = options.check(); !outcome) return outcome.error();
  if (const std::optional<Error> error = check_points(points_m)) return *error;

  Fit result;
  const Frame frame = frame_of(points_m);
  result.object_from_part.translation_m = frame.centre_m;
  const double smallest_m = kMinHalfExtent * std::max(1.0, frame.magnitude_m);
  if (!(frame.radius_m > smallest_m)) {
    result.shape.semi_axes_m = {smallest_m, smallest_m, smallest_m};
    result.shape.e1 = result.shape.e2 = std::clamp(1.0, options.min_exponent, options.max_exponent);
    inflate(result, points_m, false);
    result.volume_m3 = volume_m3(result.shape);
    result.mean_residual = 1;
    return result;
  }

  std::vector<Vec3d> unit_points;
  unit_points.reserve(points_m.size());
  for (const Vec3d& p : points_m) unit_points.push_back((1 / frame.radius_m) * (p - frame.centre_m));
  const Hull hull = convex_hull(unit_points);
  const Candidate found = optimise(hull, options);

  result.iterations = found.iterations;
  result.stop = found.stop;
  result.shape = found.at.shape;
  Vec3d& axes = result.shape.semi_axes_m;
  const double smallest_axis = options.min_axis_ratio * std::max({axes.x, axes.y, axes.z});
  for (int i = 0; i < 3; ++i) axes[i] = frame.radius_m * std::max(axes[i], smallest_axis);
  const Eigen::Quaterniond q = Eigen::Quaterniond(found.at.part_axes).normalized();
  result.object_from_part.orientation = {q.w(), q.x(), q.y(), q.z()};
  result.object_from_part.translation_m = frame.centre_m + frame.radius_m * found.at.centre;
  inflate(result, points_m, true);

  result.volume_m3 = volume_m3(result.shape);
  result.hull_volume_m3 = hull.volume_m3 * std::pow(frame.radius_m, 3);
  const Rotation<double> turn = rotation(result.object_from_part.orientation);
  for (const Vec3d& v : hull.vertices) {
    const Vec3d p_m = frame.centre_m + frame.radius_m * v - result.object_from_part.translation_m;
    result.mean_residual += std::abs(inside_outside(result.shape, turn.apply_inverse(p_m)) - 1);
  }
  result.mean_residual /= static_cast<double>(hull.vertices.size());
  return result;
}

}  // namespace sqmap::bake
