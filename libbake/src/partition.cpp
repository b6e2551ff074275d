// SPDX-License-Identifier: GPL-3.0-or-later
#include "partition.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <unordered_map>

#include <Eigen/Eigenvalues>
#include <tbb/parallel_for.h>

#include "hull.hpp"

namespace sqmap::bake {

namespace {

// Hulls are only compared here: this many points a side tell them apart.
constexpr std::size_t kHullPoints = 400;
// Planes tried along each axis, at these shares of the cell's surface.
constexpr std::array<double, 7> kQuantiles{0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8};
constexpr std::array<double, 3> kNextQuantiles{0.3, 0.5, 0.7};

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

double hull_volume_m3(const SolidSet& set, const Solid& solid) {
  std::vector<std::uint32_t> ids;
  for (const auto& t : solid.triangles) ids.insert(ids.end(), t.begin(), t.end());
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  const std::size_t stride = std::max<std::size_t>(1, ids.size() / kHullPoints);
  std::vector<Vec3d> points;
  for (std::size_t k = 0; k < ids.size(); k += stride) points.push_back(set.vertices_m[ids[k]]);
  return convex_hull(points).volume_m3;
}

struct Cut {
  std::vector<bool> first_side;                                ///< empty: the plane does not cut
  double volume_m3 = std::numeric_limits<double>::infinity();  ///< of the hulls of both sides
};

/// The triangles on one side of a cut, its caps left open: enough for a hull.
Solid side_of(const Solid& solid, const Cut& cut, bool first) {
  Solid side;
  for (std::size_t k = 0; k < solid.triangles.size(); ++k) {
    if (cut.first_side[k] != first) continue;
    side.triangles.push_back(solid.triangles[k]);
    side.face.push_back(solid.face[k]);
  }
  return side;
}

/// Cuts at each quantile along each principal axis, axis by axis.
std::vector<Cut> plane_cuts(const SolidSet& set, const Solid& solid, std::span<const double> quantiles) {
  std::size_t mesh_triangles = 0;
  for (const std::uint32_t face : solid.face) mesh_triangles += face != kNewFace;
  if (mesh_triangles < 2) return {};
  const std::array<Vec3d, 3> axes = principal_axes(set, solid);
  std::vector<Cut> cuts(axes.size() * quantiles.size());
  tbb::parallel_for(std::size_t{0}, cuts.size(), [&](std::size_t c) {
    const Vec3d& axis = axes[c / quantiles.size()];
    std::vector<double> height(solid.triangles.size());
    for (std::size_t k = 0; k < height.size(); ++k) height[k] = dot(axis, centroid(set, solid.triangles[k]));
    const auto [low, high] = std::minmax_element(height.begin(), height.end());
    const double at = *low + quantiles[c % quantiles.size()] * (*high - *low);
    Cut cut;
    cut.first_side.resize(height.size());
    std::size_t below = 0;
    for (std::size_t k = 0; k < height.size(); ++k) {
      cut.first_side[k] = height[k] < at;
      below += cut.first_side[k] && solid.face[k] != kNewFace;
    }
    if (below == 0 || below == mesh_triangles) return;
    cut.volume_m3 =
        hull_volume_m3(set, side_of(solid, cut, true)) + hull_volume_m3(set, side_of(solid, cut, false));
    cuts[c] = std::move(cut);
  });
  return cuts;
}

bool encloses_less(const Cut& a, const Cut& b) { return a.volume_m3 < b.volume_m3; }

/// Hull volume of a side, or of its halves where cutting it once more encloses less.
double volume_after_next_cut_m3(const SolidSet& set, const Solid& side) {
  double least = hull_volume_m3(set, side);
  for (const Cut& cut : plane_cuts(set, side, kNextQuantiles)) least = std::min(least, cut.volume_m3);
  return least;
}

/// Gives triangles of caps that have none (kNewFace) the label of the triangle across their base, so that a
/// cap stays with what it closes and widens no other segment.
void label_caps(const Solid& solid, std::vector<std::uint32_t>& label) {
  const auto key = [](std::uint32_t from, std::uint32_t to) { return std::uint64_t{from} << 32 | to; };
  std::unordered_map<std::uint64_t, std::vector<std::size_t>> caps;  // by the edge that a neighbour has
  for (std::size_t k = 0; k < label.size(); ++k)
    if (label[k] == kNewFace) caps[key(solid.triangles[k][1], solid.triangles[k][0])].push_back(k);
  if (caps.empty()) return;
  for (std::size_t k = 0; k < label.size() && !caps.empty(); ++k) {
    if (label[k] == kNewFace) continue;
    const auto& t = solid.triangles[k];
    for (std::size_t side = 0; side < 3; ++side) {
      const auto found = caps.find(key(t[side], t[(side + 1) % 3]));
      if (found == caps.end()) continue;
      for (const std::size_t cap : found->second) label[cap] = label[k];
      caps.erase(found);
    }
  }
}

}  // namespace

std::vector<Cell> close_segments(SolidSet& set, const Solid& whole, const Decomposition& segments) {
  std::vector<Cell> cells;
  Solid rest = whole;
  std::vector<std::uint32_t> label(rest.triangles.size(), kNewFace);  // segment of each triangle of the rest
  for (std::size_t k = 0; k < label.size(); ++k)
    if (rest.face[k] != kNewFace) label[k] = segments.label[rest.face[k]];
  label_caps(rest, label);
  const auto count = static_cast<std::uint32_t>(segments.reasons.size());
  for (std::uint32_t segment = 0; segment < count; ++segment) {
    Cell cell;
    cell.segment = segment;
    cell.reason = segments.reasons[segment];
    if (segment + 1 < count) {
      auto [first, second] = set.split(rest, [&](std::size_t k) { return label[k] == segment; });
      cell.solid = std::move(first);
      rest = std::move(second);
      std::erase(label, segment);
      label.resize(rest.triangles.size(), kNewFace);
      label_caps(rest, label);
    } else {
      cell.solid = rest;
    }
    cells.push_back(std::move(cell));
  }
  return cells;
}

std::vector<std::vector<bool>> plane_cuts_by_merit(const SolidSet& set, const Solid& solid) {
  std::vector<Cut> cuts = plane_cuts(set, solid, kQuantiles);
  // The best of each axis is judged by what one more cut of both sides leaves. Halving a ring across gains
  // nothing at once and much at the next cut; slicing it flat gains nothing at either.
  std::vector<Cut> best_of_axis;
  for (std::size_t begin = 0; begin < cuts.size(); begin += kQuantiles.size()) {
    const auto first = cuts.begin() + static_cast<std::ptrdiff_t>(begin);
    Cut& cut = *std::min_element(first, first + kQuantiles.size(), encloses_less);
    if (cut.first_side.empty()) continue;
    cut.volume_m3 = volume_after_next_cut_m3(set, side_of(solid, cut, true)) +
                    volume_after_next_cut_m3(set, side_of(solid, cut, false));
    best_of_axis.push_back(std::move(cut));
  }
  std::stable_sort(best_of_axis.begin(), best_of_axis.end(), encloses_less);
  std::vector<std::vector<bool>> sides;
  for (Cut& cut : best_of_axis) sides.push_back(std::move(cut.first_side));
  return sides;
}

}  // namespace sqmap::bake
