// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit_starts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

namespace sqmap::bake::fit {
namespace {

Eigen::Vector3d eigen(const Vec3d& v) { return {v.x, v.y, v.z}; }

/// Mean and second moments: of the solid, which unlike those of its vertices do not depend on how it is
/// sampled; of the vertices where there is no solid.
struct Moments {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
};

Moments moments(const Hull& hull) {
  Moments result;
  const auto origin = eigen(hull.vertices.front());
  double total = 0;
  for (const auto& face : hull.faces) {
    const Eigen::Vector3d a = eigen(hull.vertices[face[0]]) - origin,
                          b = eigen(hull.vertices[face[1]]) - origin,
                          c = eigen(hull.vertices[face[2]]) - origin, sum = a + b + c;
    const double volume = a.dot(b.cross(c)) / 6;
    total += volume;
    result.mean += volume / 4 * sum;
    result.second +=
        volume / 20 * (a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose());
  }
  if (!(total > 0)) {
    result = {};
    total = static_cast<double>(hull.vertices.size());
    for (const Vec3d& v : hull.vertices) {
      const Eigen::Vector3d d = eigen(v) - origin;
      result.mean += d;
      result.second += d * d.transpose();
    }
  }
  result.mean /= total;
  result.second = result.second / total - result.mean * result.mean.transpose();
  result.mean += origin;
  return result;
}

/// Right-handed axes from the first two columns.
Eigen::Matrix3d completed(const Eigen::Vector3d& x, const Eigen::Vector3d& y) {
  Eigen::Matrix3d axes;
  axes << x, y, x.cross(y);
  return axes;
}

double extent(const Hull& hull, const Eigen::Vector3d& direction) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Vec3d& v : hull.vertices) {
    const double d = direction.dot(eigen(v));
    low = std::min(low, d);
    high = std::max(high, d);
  }
  return high - low;
}

/// Frame of the hull face across which the hull is thinnest, and of the smallest rectangle along it. Finds
/// the axes of boxes, whose moments may be equal in all directions.
Eigen::Matrix3d box_axes(const Hull& hull) {
  struct Side {
    double twice_area;
    Eigen::Vector3d normal;
  };
  std::vector<Side> sides;
  for (const auto& face : hull.faces) {
    const Eigen::Vector3d a = eigen(hull.vertices[face[0]]);
    const Eigen::Vector3d n = (eigen(hull.vertices[face[1]]) - a).cross(eigen(hull.vertices[face[2]]) - a);
    if (n.norm() > 0) sides.push_back({n.norm(), n.normalized()});
  }
  constexpr std::size_t kLargestSides = 64;  // a side of a box is among its largest triangles
  std::stable_sort(sides.begin(), sides.end(),
                   [](const Side& a, const Side& b) { return a.twice_area > b.twice_area; });
  if (sides.size() > kLargestSides) sides.resize(kLargestSides);

  Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  double thinnest = std::numeric_limits<double>::infinity();
  for (const Side& side : sides)
    if (const double width = extent(hull, side.normal); width < thinnest) {
      thinnest = width;
      z = side.normal;
    }
  const Eigen::Vector3d reference = z.unitOrthogonal();
  Eigen::Matrix3d best = completed(reference, z.cross(reference));
  double smallest = std::numeric_limits<double>::infinity();
  constexpr int kTurns = 30;  // 3 degrees apart; the optimisation does the rest
  for (int i = 0; i < kTurns; ++i) {
    const double angle = std::numbers::pi / 2 * i / kTurns;
    const Eigen::Vector3d x = Eigen::AngleAxisd(angle, z) * reference, y = z.cross(x);
    if (const double area = extent(hull, x) * extent(hull, y); area < smallest) {
      smallest = area;
      best = completed(x, y);
    }
  }
  return best;
}

/// Centre and semi-axes of the box of the points along the axes.
Placed boxed(const Eigen::Matrix3d& axes, std::span<const Vec3d> points, const Bounds& bounds) {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (const Vec3d& p : points) {
    const Eigen::Vector3d q = axes.transpose() * eigen(p);
    low = low.cwiseMin(q);
    high = high.cwiseMax(q);
  }
  const Eigen::Vector3d centre = axes * ((low + high) / 2);
  Placed result{{}, axes, {centre.x(), centre.y(), centre.z()}};
  for (int i = 0; i < 3; ++i)
    result.shape.semi_axes_m[i] = std::max((high[i] - low[i]) / 2, std::exp(bounds.lower[kLogAxes + i]));
  return result;
}

struct Scored {
  double log_volume;
  Placed start;
};

Scored with_best_exponents(const Placed& start, std::span<const Vec3d> points, const Bounds& bounds,
                           int grid) {
  Scored best{std::numeric_limits<double>::infinity(), start};
  Vector x = parameters(start);
  const auto node = [&](int parameter, int i) {
    return bounds.lower[parameter] + (bounds.upper[parameter] - bounds.lower[parameter]) * (i + 0.5) / grid;
  };
  for (int i = 0; i < grid; ++i)
    for (int j = 0; j < grid; ++j) {
      x[kE1] = node(kE1, i);
      x[kE2] = node(kE2, j);
      const double score = inflated_log_volume(x, start.part_axes, points);
      if (score < best.log_volume) best = {score, placed(x, start.part_axes)};
    }
  return best;
}

}  // namespace

std::vector<Placed> starts(const Hull& hull, std::span<const Vec3d> points, const Bounds& bounds, int grid) {
  std::vector<Eigen::Matrix3d> frames;
  const Eigen::Matrix3d principal =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(moments(hull).second).eigenvectors();
  frames.push_back(completed(principal.col(0), principal.col(1)));
  if (!hull.faces.empty()) frames.push_back(box_axes(hull));

  std::vector<Scored> scored;
  for (const Eigen::Matrix3d& frame : frames)
    for (const int z : {2, 1, 0})
      for (const double turn : {0.0, std::numbers::pi / 4}) {
        const Eigen::Vector3d axis = frame.col(z);
        const Eigen::Vector3d x = Eigen::AngleAxisd(turn, axis) * frame.col((z + 1) % 3);
        scored.push_back(
            with_best_exponents(boxed(completed(x, axis.cross(x)), points, bounds), points, bounds, grid));
      }
  std::stable_sort(scored.begin(), scored.end(),
                   [](const Scored& a, const Scored& b) { return a.log_volume < b.log_volume; });
  std::vector<Placed> result;
  for (const Scored& s : scored) result.push_back(s.start);
  return result;
}

Placed twin(const Placed& at, const Bounds& bounds) {
  Placed result = at;
  const double to_diamond = std::exp2((1 - at.shape.e2) / 2);  // radius of the superellipse at 45 degrees
  result.shape.semi_axes_m.x *= to_diamond;
  result.shape.semi_axes_m.y *= to_diamond;
  result.shape.e2 = std::clamp(2 - at.shape.e2, bounds.lower[kE2], bounds.upper[kE2]);
  result.part_axes =
      at.part_axes * Eigen::AngleAxisd(std::numbers::pi / 4, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return result;
}

std::vector<Vec3d> spread_subset(const Hull& hull, std::size_t count) {
  if (hull.vertices.size() <= count) return hull.vertices;
  const Moments spread = moments(hull);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread.second);
  const Eigen::Vector3d sizes = solver.eigenvalues().cwiseMax(1e-12).cwiseSqrt();
  const Eigen::Matrix3d to_ball = sizes.cwiseInverse().asDiagonal() * solver.eigenvectors().transpose();
  std::vector<Eigen::Vector3d> ball;
  for (const Vec3d& v : hull.vertices) ball.push_back(to_ball * (eigen(v) - spread.mean));

  std::vector<bool> chosen(ball.size(), false);
  const double golden_angle = std::numbers::pi * (3 - std::sqrt(5.0));
  for (std::size_t i = 0; i < count; ++i) {  // Fibonacci directions
    const double z = 1 - (2 * static_cast<double>(i) + 1) / static_cast<double>(count);
    const double r = std::sqrt(1 - z * z), turn = golden_angle * static_cast<double>(i);
    const Eigen::Vector3d direction(r * std::cos(turn), r * std::sin(turn), z);
    std::size_t farthest = 0;
    for (std::size_t k = 1; k < ball.size(); ++k)
      if (direction.dot(ball[k]) > direction.dot(ball[farthest])) farthest = k;
    chosen[farthest] = true;
  }
  std::vector<Vec3d> result;
  for (std::size_t k = 0; k < ball.size(); ++k)
    if (chosen[k]) result.push_back(hull.vertices[k]);
  return result;
}

}  // namespace sqmap::bake::fit
