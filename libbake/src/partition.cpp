// SPDX-License-Identifier: GPL-3.0-or-later
#include "partition.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <span>

#include <Eigen/Eigenvalues>
#include <tbb/parallel_for.h>

#include "hull.hpp"

namespace sqmap::bake {

namespace {

// Hulls are only compared here: this many points a side tell them apart.
constexpr std::size_t kHullPoints = 400;
// Planes tried along each axis, at these shares of the cell's surface.
constexpr std::array<double, 7> kQuantiles{0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8};

Vec3d centroid(const SolidSet& set, const std::array<std::uint32_t, 3>& t) {
  return (1.0 / 3) * (set.vertices_m[t[0]] + set.vertices_m[t[1]] + set.vertices_m[t[2]]);
}

/// Principal axes of the triangles' centroids, weighted by area.
std::array<Vec3d, 3> principal_axes(const SolidSet& set, const Solid& solid) {
  Vec3d mean;
  double weight = 0;
  std::vector<double> area;
  area.reserve(solid.triangles.size());
  for (const auto& t : solid.triangles) {
    const Vec3d &a = set.vertices_m[t[0]], &b = set.vertices_m[t[1]], &c = set.vertices_m[t[2]];
    area.push_back(norm(cross(b - a, c - a)));
    mean = mean + area.back() * centroid(set, t);
    weight += area.back();
  }
  mean = (1 / weight) * mean;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (std::size_t k = 0; k < solid.triangles.size(); ++k) {
    const Vec3d d = centroid(set, solid.triangles[k]) - mean;
    const Eigen::Vector3d v(d.x, d.y, d.z);
    covariance += area[k] / weight * v * v.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  std::array<Vec3d, 3> axes;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d v = solver.eigenvectors().col(k);
    axes[k] = {v.x(), v.y(), v.z()};
  }
  return axes;
}

double hull_volume_m3(const SolidSet& set, const Solid& solid, const std::vector<bool>& first_side,
                      bool side) {
  std::vector<std::uint32_t> ids;
  for (std::size_t k = 0; k < solid.triangles.size(); ++k) {
    if (first_side[k] == side) ids.insert(ids.end(), solid.triangles[k].begin(), solid.triangles[k].end());
  }
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  const std::size_t stride = std::max<std::size_t>(1, ids.size() / kHullPoints);
  std::vector<Vec3d> points;
  for (std::size_t k = 0; k < ids.size(); k += stride) points.push_back(set.vertices_m[ids[k]]);
  return convex_hull(points).volume_m3;
}

}  // namespace

std::vector<Cell> close_segments(SolidSet& set, const Solid& whole, const Decomposition& segments) {
  std::vector<Cell> cells;
  Solid rest = whole;
  const auto count = static_cast<std::uint32_t>(segments.reasons.size());
  for (std::uint32_t segment = 0; segment < count; ++segment) {
    Cell cell;
    cell.segment = segment;
    cell.reason = segments.reasons[segment];
    if (segment + 1 < count) {
      // Caps of earlier cuts go to whichever side holds most of their base's neighbours; any side is valid,
      // the nearer one keeps hulls small.
      std::vector<std::uint32_t> vertex_segment(set.vertices_m.size(), kNewFace);
      for (std::size_t k = 0; k < rest.triangles.size(); ++k) {
        if (rest.face[k] == kNewFace) continue;
        for (const std::uint32_t id : rest.triangles[k]) {
          vertex_segment[id] = std::min(vertex_segment[id], segments.label[rest.face[k]]);
        }
      }
      auto [first, second] = set.split(rest, [&](std::size_t k) {
        if (rest.face[k] != kNewFace) return segments.label[rest.face[k]] == segment;
        return vertex_segment[rest.triangles[k][0]] == segment &&
               vertex_segment[rest.triangles[k][1]] == segment;
      });
      cell.solid = std::move(first);
      rest = std::move(second);
    } else {
      cell.solid = std::move(rest);
    }
    cells.push_back(std::move(cell));
  }
  return cells;
}

std::optional<std::vector<bool>> best_plane_cut(const SolidSet& set, const Solid& solid) {
  std::size_t mesh_triangles = 0;
  for (const std::uint32_t face : solid.face) mesh_triangles += face != kNewFace;
  if (mesh_triangles < 2) return std::nullopt;

  const std::array<Vec3d, 3> axes = principal_axes(set, solid);
  struct Candidate {
    std::vector<bool> first_side;
    double volume_m3 = std::numeric_limits<double>::infinity();
  };
  std::vector<Candidate> candidates(axes.size() * kQuantiles.size());
  tbb::parallel_for(std::size_t{0}, candidates.size(), [&](std::size_t c) {
    const Vec3d& axis = axes[c / kQuantiles.size()];
    std::vector<double> height(solid.triangles.size());
    for (std::size_t k = 0; k < height.size(); ++k) height[k] = dot(axis, centroid(set, solid.triangles[k]));
    const auto [low, high] = std::minmax_element(height.begin(), height.end());
    const double cut = *low + kQuantiles[c % kQuantiles.size()] * (*high - *low);
    std::vector<bool> side(height.size());
    std::size_t below = 0;
    for (std::size_t k = 0; k < height.size(); ++k) {
      side[k] = height[k] < cut;
      below += side[k] && solid.face[k] != kNewFace;
    }
    if (below == 0 || below == mesh_triangles) return;
    candidates[c].volume_m3 =
        hull_volume_m3(set, solid, side, true) + hull_volume_m3(set, solid, side, false);
    candidates[c].first_side = std::move(side);
  });
  const auto best = std::min_element(candidates.begin(), candidates.end(),
                                     [](const auto& a, const auto& b) { return a.volume_m3 < b.volume_m3; });
  if (best->first_side.empty()) return std::nullopt;
  return best->first_side;
}

}  // namespace sqmap::bake
