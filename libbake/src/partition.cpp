// SPDX-License-Identifier: GPL-3.0-or-later
#include "partition.hpp"

#include <algorithm>
#include <array>
#include <cmath>
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

/// A triangle of a solid.
struct Facet {
  Vec3d centroid_m;
  double twice_area_m2;
  std::array<std::uint32_t, 3> corner;  ///< of Sliced::vertices_m
  bool is_cap;
};

/// A solid made ready to be cut in mind by many planes.
struct Sliced {
  std::vector<Vec3d> vertices_m;  ///< in the order of the set they come from
  std::vector<Facet> facets;

  Sliced(const SolidSet& set, const Solid& solid) {
    std::vector<std::uint32_t> ids;
    for (const auto& t : solid.triangles) ids.insert(ids.end(), t.begin(), t.end());
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
    for (const std::uint32_t id : ids) vertices_m.push_back(set.vertices_m[id]);
    for (std::size_t k = 0; k < solid.triangles.size(); ++k) {
      const auto& t = solid.triangles[k];
      const Vec3d &a = set.vertices_m[t[0]], &b = set.vertices_m[t[1]], &c = set.vertices_m[t[2]];
      Facet facet{set.centroid(t), norm(cross(b - a, c - a)), {}, solid.face[k] == kNewFace};
      for (std::size_t i = 0; i < 3; ++i)
        facet.corner[i] =
            static_cast<std::uint32_t>(std::lower_bound(ids.begin(), ids.end(), t[i]) - ids.begin());
      facets.push_back(facet);
    }
  }
};

/// Where the half-spaces overlap, and the triangles of the mesh with their centroids there.
struct Region {
  std::vector<HalfSpace> half_spaces;
  std::vector<std::uint32_t> mesh_facets;

  explicit Region(const Sliced& solid) {
    for (std::uint32_t k = 0; k < solid.facets.size(); ++k)
      if (!solid.facets[k].is_cap) mesh_facets.push_back(k);
  }
  Region(const Sliced& solid, const Region& whole, const HalfSpace& side) : half_spaces(whole.half_spaces) {
    half_spaces.push_back(side);
    for (const std::uint32_t k : whole.mesh_facets)
      if (side.above_m(solid.facets[k].centroid_m) < 0) mesh_facets.push_back(k);
  }
  bool holds(const Vec3d& p_m) const {
    return std::all_of(half_spaces.begin(), half_spaces.end(),
                       [&](const HalfSpace& h) { return h.above_m(p_m) < 0; });
  }
};

HalfSpace other_side(const HalfSpace& h) { return {-h.normal, -h.height_m}; }

/// Principal axes of the centroids, weighted by area.
std::array<Vec3d, 3> principal_axes(const std::vector<const Facet*>& facets) {
  Vec3d mean;
  double weight = 0;
  for (const Facet* facet : facets) {
    mean = mean + facet->twice_area_m2 * facet->centroid_m;
    weight += facet->twice_area_m2;
  }
  mean = (1 / weight) * mean;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const Facet* facet : facets) {
    const Vec3d d = facet->centroid_m - mean;
    const Eigen::Vector3d v(d.x, d.y, d.z);
    covariance += facet->twice_area_m2 / weight * v * v.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  std::array<Vec3d, 3> axes;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d v = solver.eigenvectors().col(k);
    axes[k] = {v.x(), v.y(), v.z()};
  }
  return axes;
}

/// What of the polygon lies in the half-space.
std::vector<Vec3d> clipped(const std::vector<Vec3d>& polygon_m, const HalfSpace& h) {
  std::vector<Vec3d> inside;
  for (std::size_t k = 0; k < polygon_m.size(); ++k) {
    const Vec3d &a = polygon_m[k], &b = polygon_m[(k + 1) % polygon_m.size()];
    const double from_m = h.above_m(a), to_m = h.above_m(b);
    if (from_m < 0) inside.push_back(a);
    if ((from_m < 0) != (to_m < 0)) inside.push_back(a + from_m / (from_m - to_m) * (b - a));
  }
  return inside;
}

/// Of what SolidSet::split would leave of the solid in the region.
double hull_volume_m3(const Sliced& solid, const Region& region) {
  std::vector<Vec3d> cut_m;
  for (const Facet& facet : solid.facets) {
    if (!facet.is_cap) continue;
    std::vector<Vec3d> polygon_m;
    for (const std::uint32_t corner : facet.corner) polygon_m.push_back(solid.vertices_m[corner]);
    for (const HalfSpace& h : region.half_spaces) polygon_m = clipped(polygon_m, h);
    cut_m.insert(cut_m.end(), polygon_m.begin(), polygon_m.end());
  }
  std::vector<std::uint8_t> is_corner(solid.vertices_m.size(), 0);
  for (const std::uint32_t k : region.mesh_facets)
    for (const std::uint32_t corner : solid.facets[k].corner) is_corner[corner] = 1;
  for (std::size_t k = 0; k < is_corner.size(); ++k)
    if (is_corner[k] != 0) cut_m.push_back(solid.vertices_m[k]);
  const std::size_t stride = std::max<std::size_t>(1, cut_m.size() / kHullPoints);
  std::vector<Vec3d> points_m;
  for (std::size_t k = 0; k < cut_m.size(); k += stride) points_m.push_back(cut_m[k]);
  return convex_hull(points_m).volume_m3;
}

struct Cut {
  HalfSpace plane;
  double volume_m3 =
      std::numeric_limits<double>::infinity();  ///< of the hulls of both sides; infinite: cuts nothing
};

/// Cuts of the solid's share of the region at each quantile along each principal axis, axis by axis.
std::vector<Cut> plane_cuts(const Sliced& solid, const Region& region, std::span<const double> quantiles) {
  if (region.mesh_facets.size() < 2) return {};
  std::vector<const Facet*> facets;
  for (const Facet& facet : solid.facets)
    if (region.holds(facet.centroid_m)) facets.push_back(&facet);
  const std::array<Vec3d, 3> axes = principal_axes(facets);
  std::vector<Cut> cuts(axes.size() * quantiles.size());
  tbb::parallel_for(std::size_t{0}, cuts.size(), [&](std::size_t c) {
    const Vec3d& axis = axes[c / quantiles.size()];
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const Facet* facet : facets) {
      low = std::min(low, dot(axis, facet->centroid_m));
      high = std::max(high, dot(axis, facet->centroid_m));
    }
    const HalfSpace plane{axis, low + quantiles[c % quantiles.size()] * (high - low)};
    const Region below(solid, region, plane);
    if (below.mesh_facets.empty() || below.mesh_facets.size() == region.mesh_facets.size()) return;
    cuts[c] = {plane, hull_volume_m3(solid, below) +
                          hull_volume_m3(solid, Region(solid, region, other_side(plane)))};
  });
  return cuts;
}

bool encloses_less(const Cut& a, const Cut& b) { return a.volume_m3 < b.volume_m3; }

/// Hull volume in the region, or of the halves where cutting it once more encloses less.
double volume_after_next_cut_m3(const Sliced& solid, const Region& region) {
  double least = hull_volume_m3(solid, region);
  for (const Cut& cut : plane_cuts(solid, region, kNextQuantiles)) least = std::min(least, cut.volume_m3);
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

double area_m2(const Mesh& mesh, std::uint32_t face) {
  const auto& t = mesh.faces[face];
  const Vec3d& a = mesh.vertices_m[t[0]];
  return 0.5 * norm(cross(mesh.vertices_m[t[1]] - a, mesh.vertices_m[t[2]] - a));
}

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

std::vector<HalfSpace> plane_cuts_by_merit(const SolidSet& set, const Solid& solid) {
  const Sliced sliced(set, solid);
  const Region whole(sliced);
  std::vector<Cut> cuts = plane_cuts(sliced, whole, kQuantiles);
  // The best of each axis is judged by what one more cut of both sides leaves. Halving a ring across gains
  // nothing at once and much at the next cut; slicing it flat gains nothing at either.
  std::vector<Cut> best_of_axis;
  for (std::size_t begin = 0; begin < cuts.size(); begin += kQuantiles.size()) {
    const auto first = cuts.begin() + static_cast<std::ptrdiff_t>(begin);
    Cut cut = *std::min_element(first, first + kQuantiles.size(), encloses_less);
    if (std::isinf(cut.volume_m3)) continue;
    cut.volume_m3 = volume_after_next_cut_m3(sliced, Region(sliced, whole, cut.plane)) +
                    volume_after_next_cut_m3(sliced, Region(sliced, whole, other_side(cut.plane)));
    best_of_axis.push_back(cut);
  }
  std::stable_sort(best_of_axis.begin(), best_of_axis.end(), encloses_less);
  std::vector<HalfSpace> planes;
  for (const Cut& cut : best_of_axis) planes.push_back(cut.plane);
  return planes;
}

}  // namespace sqmap::bake
