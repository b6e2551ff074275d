// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit_bend.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "fit_model.hpp"
#include "fit_solve.hpp"
#include "fit_starts.hpp"
#include "hull.hpp"
#include "long_edges.hpp"

namespace sqmap::bake {
namespace {

using fit::Bounds;
using fit::Candidate;
using fit::Placed;

using Triangle = std::array<std::uint32_t, 3>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kWorthBending = 0.97;
// Of the longest semi-axis: shorter ones are not bent.
constexpr double kLongAxis = 0.6;
// A parabola that turns by less, to either side [rad], is no start.
constexpr double kLeastStart = 0.15, kMostStart = 1.6;
// Points of the surface are no farther apart than this share of its half-extent where they are fitted to.
constexpr double kSpacing = 0.1;
constexpr std::size_t kMostTriangles = 20000;
constexpr std::size_t kPoints = 192;
constexpr int kRounds = 3;
constexpr double kFirstP = 16, kLastP = 1024;
constexpr double kOtherExponent = 0.7;

/// largest_beta() of one triangle after another.
class BetaBound {
 public:
  BetaBound(const Superquadric& shape, const Pose& object_from_part)
      : shape_(shape),
        straight_(straight(shape)),
        k_(shape.bend.curvature()),
        translation_m_(object_from_part.translation_m),
        turn_(rotation(object_from_part.orientation)) {
    // beta of a small step is at most that in the octahedron of the semi-axes, which the superquadric holds.
    const Vec3d& a = shape.semi_axes_m;
    per_r_ = k_ > 0 ? (std::abs(shape.bend.x) / a.x + std::abs(shape.bend.y) / a.y) / k_ : 0;
    per_z_ = 1 / a.z;
  }

  struct Corner {
    Vec3d p_m;      ///< part frame
    double radius;  ///< from the middle of the arc, over that of the arc: lambda
    double beta;
  };
  Corner corner(const Vec3d& point_m) const { return at(turn_.apply_inverse(point_m - translation_m_)); }

  void add(const Corner& a, const Corner& b, const Corner& c, int depth) {
    largest_ = std::max({largest_, a.beta, b.beta, c.beta});
    if (k_ == 0 || !(largest_ < kInfinity)) return;
    const double ab_m = norm(b.p_m - a.p_m), bc_m = norm(c.p_m - b.p_m), ca_m = norm(a.p_m - c.p_m);
    const double longest_m = std::max({ab_m, bc_m, ca_m});
    // No point of the triangle is farther from all corners than this.
    const double lambda = std::min({a.radius, b.radius, c.radius}) - k_ * longest_m / std::numbers::sqrt3;
    // Along a line r changes by at most k / lambda to the second order, z by k / lambda^2, what lies across
    // not at all; the flat triangle is off by a sixth of that times the square of its longest edge. beta is
    // sublinear.
    double beyond = kInfinity;
    if (lambda > 0) {
      const double off_r_m = k_ / lambda * longest_m * longest_m / 6, off_z_m = off_r_m / lambda;
      beyond = std::max({a.beta, b.beta, c.beta}) + off_r_m * per_r_ + off_z_m * per_z_;
    }
    if (beyond <= largest_ * (1 + kSlack)) return;
    if (depth == kDeepest || ++pieces_ > kMostPieces) {
      largest_ = kInfinity;
      return;
    }
    const Corner ab = at(0.5 * (a.p_m + b.p_m)), bc = at(0.5 * (b.p_m + c.p_m)),
                 ca = at(0.5 * (c.p_m + a.p_m));
    add(a, ab, ca, depth + 1);
    add(ab, b, bc, depth + 1);
    add(ca, bc, c, depth + 1);
    add(ab, bc, ca, depth + 1);
  }

  double bound() const { return largest_ * (1 + kSlack); }

 private:
  static constexpr double kSlack = 1e-4;
  static constexpr int kDeepest = 14;
  static constexpr std::size_t kMostPieces = 1000000;

  Corner at(const Vec3d& p_m) const {
    const Vec3d q_m = straightened(shape_.bend, p_m);
    const double radius = std::hypot(shape_.bend.stretch(p_m), k_ * p_m.z);
    return {p_m, radius, inside_outside_radial(straight_, q_m)};
  }

  Superquadric shape_, straight_;
  double k_;
  Vec3d translation_m_;
  Rotation<double> turn_;
  double per_r_, per_z_;  ///< beta of a metre in the plane of the bend, across and along the axis
  double largest_ = 0;
  std::size_t pieces_ = 0;
};

/// The surface in the frame of the optimisation, where it lies about the unit ball.
struct Frame {
  Vec3d centre_m;
  double radius_m;
  Vec3d to_unit(const Vec3d& p_m) const { return (1 / radius_m) * (p_m - centre_m); }
};

Vec3d vec(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Eigen::Vector3d eigen(const Vec3d& v) { return {v.x, v.y, v.z}; }

/// Whether the superquadric, once it is as large as the points need, still may be bent as it is.
bool may_hold(const Placed& at, const std::vector<Vec3d>& points) {
  const fit::LogBetaModel model(fit::parameters(at), at.part_axes);
  double farthest = -kInfinity;
  for (const Vec3d& p : points) farthest = std::max(farthest, model.value(p));
  Superquadric shape = at.shape;
  shape.semi_axes_m = std::exp(farthest) * shape.semi_axes_m;
  return fit::may_bend(shape);
}

/// Where the z axis of `axes` would lie, were it bent as the surface is: coordinates across it fitted by
/// parabolas along it, weighted by area.
std::optional<Placed> bent_start(const Triangles& surface, const Eigen::Matrix3d& axes, const Placed& at) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, 2> right = Eigen::Matrix<double, 3, 2>::Zero();
  const auto local = [&](const Vec3d& p) -> Eigen::Vector3d {
    return axes.transpose() * (eigen(p) - eigen(at.centre));
  };
  for (const Triangle& t : surface.faces) {
    const Vec3d &a = surface.points[t[0]], &b = surface.points[t[1]], &c = surface.points[t[2]];
    const double area = norm(cross(b - a, c - a));
    const Eigen::Vector3d p = local((1.0 / 3) * (a + b + c));
    const Eigen::Vector3d row(1, p.z(), p.z() * p.z());
    normal += area * row * row.transpose();
    right += area * row * p.head<2>().transpose();
  }
  const Eigen::Matrix<double, 3, 2> parabola = normal.ldlt().solve(right);
  if (!parabola.allFinite()) return std::nullopt;
  // The frame that touches the parabola where it begins.
  const Eigen::Vector3d z = (axes * Eigen::Vector3d(parabola(1, 0), parabola(1, 1), 1)).normalized();
  Placed start = at;
  start.part_axes = Eigen::Quaterniond::FromTwoVectors(axes.col(2), z).toRotationMatrix() * axes;
  start.centre = vec(eigen(at.centre) + axes * Eigen::Vector3d(parabola(0, 0), parabola(0, 1), 0));
  Eigen::Vector2d bend = 2 * parabola.row(2).transpose();
  double length = 0;
  for (const Vec3d& p : surface.points)
    length = std::max(length, std::abs((start.part_axes.transpose() * (eigen(p) - eigen(start.centre))).z()));
  if (!(bend.norm() * length > kLeastStart)) return std::nullopt;
  bend *= std::min(1.0, kMostStart / (bend.norm() * length));
  start.shape.bend = {bend.x(), bend.y()};
  start.shape.taper = 0;
  Eigen::Vector3d extent = Eigen::Vector3d::Constant(1e-6);
  for (const Vec3d& p : surface.points) {
    const Vec3d q =
        straightened(start.shape.bend, vec(start.part_axes.transpose() * (eigen(p) - eigen(start.centre))));
    extent = extent.cwiseMax(eigen(q).cwiseAbs());
  }
  start.shape.semi_axes_m = vec(extent);
  // Too thick for its bend, once it holds the surface: less of it.
  constexpr int kMostTries = 8;
  for (int i = 0; i < kMostTries && !may_hold(start, surface.points); ++i)
    start.shape.bend = {0.8 * start.shape.bend.x, 0.8 * start.shape.bend.y};
  return start;
}

/// The points that matter to a bent superquadric: those on the hull of all in its straight frame.
std::vector<Vec3d> outer_points(const Placed& at, const std::vector<Vec3d>& points, std::size_t most) {
  std::vector<Vec3d> straight_points;
  straight_points.reserve(points.size());
  for (const Vec3d& p : points)
    straight_points.push_back(
        straightened(at.shape.bend, vec(at.part_axes.transpose() * (eigen(p) - eigen(at.centre)))));
  const Hull hull = convex_hull(straight_points);
  std::vector<Vec3d> outer;
  for (const Vec3d& q : fit::spread_subset(hull, most))
    outer.push_back(vec(at.part_axes * eigen(bent(at.shape.bend, q)) + eigen(at.centre)));
  return outer;
}

}  // namespace

double largest_beta(const Superquadric& shape, const Pose& object_from_part, std::span<const Vec3d> points_m,
                    std::span<const Triangle> triangles) {
  BetaBound bound(shape, object_from_part);
  for (const Triangle& t : triangles)
    bound.add(bound.corner(points_m[t[0]]), bound.corner(points_m[t[1]]), bound.corner(points_m[t[2]]), 0);
  return bound.bound();
}

std::optional<Fit> fit_bent(std::span<const Vec3d> points_m, std::span<const Triangle> triangles,
                            const Fit& start, const FitOptions& options) {
  const Frame frame{start.object_from_part.translation_m, bounding_radius_m(start.shape)};
  Triangles coarse;
  std::vector<std::uint32_t> index(points_m.size(), std::numeric_limits<std::uint32_t>::max());
  for (const Triangle& t : triangles) {
    Triangle& here = coarse.faces.emplace_back();
    for (std::size_t i = 0; i < 3; ++i) {
      std::uint32_t& vertex = index[t[i]];
      if (vertex == std::numeric_limits<std::uint32_t>::max()) {
        vertex = static_cast<std::uint32_t>(coarse.points.size());
        coarse.points.push_back(frame.to_unit(points_m[t[i]]));
      }
      here[i] = vertex;
    }
  }
  const Triangles surface = split_long_edges(coarse, kSpacing, triangles.size() + kMostTriangles).triangles;

  Placed at;
  at.shape = start.shape;
  at.shape.semi_axes_m = (1 / frame.radius_m) * start.shape.semi_axes_m;
  const Quaternion& q = start.object_from_part.orientation;
  at.part_axes = Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized().toRotationMatrix();
  const Vec3d& a = at.shape.semi_axes_m;
  const double long_axis = kLongAxis * std::max({a.x, a.y, a.z});

  Bounds bounds = fit::make_bounds(options);
  bounds.lower.segment<2>(fit::kBend).setConstant(-4);
  bounds.upper.segment<2>(fit::kBend).setConstant(4);
  std::optional<Candidate> best;
  double smallest = kInfinity;
  for (int z = 0; z < 3; ++z) {
    if (!(a[z] >= long_axis)) continue;
    Eigen::Matrix3d axes;
    axes << at.part_axes.col((z + 1) % 3), at.part_axes.col((z + 2) % 3), at.part_axes.col(z);
    Placed from = at;
    if (z != 2) from.shape.e1 = from.shape.e2 = kOtherExponent;  // the straight fit's are of its own axes
    const auto bent_at = bent_start(surface, axes, from);
    if (!bent_at) continue;
    Candidate candidate{*bent_at};
    std::vector<Vec3d> points = outer_points(candidate.at, surface.points, kPoints);
    fit::solve_volume(candidate, points, bounds, options.max_iterations, kFirstP, kLastP);
    for (int round = 0; round < kRounds; ++round) {
      // Where the bend changed, others have come to the outside.
      const std::vector<Vec3d> more = outer_points(candidate.at, surface.points, kPoints);
      points.insert(points.end(), more.begin(), more.end());
      fit::solve_volume(candidate, points, bounds, options.max_iterations, kLastP, kLastP);
    }
    const double volume =
        fit::inflated_log_volume(fit::parameters(candidate.at), candidate.at.part_axes, surface.points);
    if (!(volume < smallest) || !may_hold(candidate.at, surface.points)) continue;
    smallest = volume;
    best = candidate;
  }
  if (!best) return std::nullopt;

  Fit result = start;
  result.iterations += best->iterations;
  result.stop = best->stop;
  result.shape = best->at.shape;
  result.shape.bend = {best->at.shape.bend.x / frame.radius_m, best->at.shape.bend.y / frame.radius_m};
  const Vec3d& axes = best->at.shape.semi_axes_m;
  const double smallest_axis = options.min_axis_ratio * std::max({axes.x, axes.y, axes.z});
  for (int i = 0; i < 3; ++i) result.shape.semi_axes_m[i] = frame.radius_m * std::max(axes[i], smallest_axis);
  const Eigen::Quaterniond turn = Eigen::Quaterniond(best->at.part_axes).normalized();
  result.object_from_part.orientation = {turn.w(), turn.x(), turn.y(), turn.z()};
  result.object_from_part.translation_m = frame.centre_m + frame.radius_m * best->at.centre;
  const double farthest = largest_beta(result.shape, result.object_from_part, points_m, triangles);
  if (!(farthest > 0 && farthest < kInfinity)) return std::nullopt;
  result.shape.semi_axes_m = farthest * (1 + kBoundMargin) * result.shape.semi_axes_m;
  result.volume_m3 = volume_m3(result.shape);
  const double turn_rad = result.shape.bend.curvature() * result.shape.semi_axes_m.z;
  const bool is_valid =
      turn_rad >= kLeastBendTurn && turn_rad <= kMostBendTurn && bend_reach(result.shape) <= kMostBendReach;
  if (!is_valid || !(result.volume_m3 < kWorthBending * start.volume_m3)) return std::nullopt;
  return result;
}

}  // namespace sqmap::bake
