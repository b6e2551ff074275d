// SPDX-License-Identifier: GPL-3.0-or-later
//
// Points that a wrong bound would betray itself at, and what becomes of them.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "sqmap/bake/mesh.hpp"
#include "sqmap/bake/oracle.hpp"
#include "sqmap/runtime/object.hpp"

namespace sqmap::test {

using bake::Mesh;

class SurfacePicker {
 public:
  explicit SurfacePicker(const Mesh& mesh) : mesh_(mesh) {
    double sum_m2 = 0;
    for (std::size_t f = 0; f < mesh.faces.size(); ++f) area_sum_m2_.push_back(sum_m2 += norm(cross_m2(f)));
  }
  /// Of the surface, evenly by area, moved by offset_m along the face's normal.
  Vec3d near_m(std::mt19937_64& random, double offset_m) const {
    std::uniform_real_distribution<double> unit(0, 1);
    const double wanted = unit(random) * area_sum_m2_.back();
    const auto f = std::min<std::size_t>(
        static_cast<std::size_t>(std::upper_bound(area_sum_m2_.begin(), area_sum_m2_.end(), wanted) -
                                 area_sum_m2_.begin()),
        mesh_.faces.size() - 1);
    const double root = std::sqrt(unit(random)), along = unit(random);
    return (1 - root) * corner_m(f, 0) + (root * (1 - along)) * corner_m(f, 1) +
           (root * along) * corner_m(f, 2) + offset_m * normalized(cross_m2(f));
  }

 private:
  const Vec3d& corner_m(std::size_t face, int k) const { return mesh_.vertices_m[mesh_.faces[face][k]]; }
  Vec3d cross_m2(std::size_t f) const {
    return cross(corner_m(f, 1) - corner_m(f, 0), corner_m(f, 2) - corner_m(f, 0));
  }
  const Mesh& mesh_;
  std::vector<double> area_sum_m2_;
};

/// Evenly in the mesh's box.
inline std::vector<Vec3f> points_in_box(const Mesh& mesh, std::size_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Vec3d low = mesh.vertices_m.front(), high = low;
  for (const Vec3d& v : mesh.vertices_m)
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], v[axis]);
      high[axis] = std::max(high[axis], v[axis]);
    }
  std::vector<Vec3f> points;
  for (std::size_t i = 0; i < count; ++i) {
    Vec3d p;
    for (int axis = 0; axis < 3; ++axis)
      p[axis] = std::uniform_real_distribution<double>(low[axis], high[axis])(random);
    points.push_back(cast<float>(p));
  }
  return points;
}

/// Evenly in a shell of +-half_width_m around the surface.
inline std::vector<Vec3f> points_in_shell(const Mesh& mesh, double half_width_m, std::size_t count,
                                          std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> offset_m(-half_width_m, half_width_m);
  const SurfacePicker surface(mesh);
  std::vector<Vec3f> points;
  for (std::size_t i = 0; i < count; ++i)
    points.push_back(cast<float>(surface.near_m(random, offset_m(random))));
  return points;
}

/// Where bounds are most easily wrong: on both sides of faces at distances of 1e-4 to 1e-2 r_max_m, and
/// around vertices, tips of needles among them, at 1e-6 to 1e-2.
inline std::vector<Vec3f> adverse_points(const Mesh& mesh, double r_max_m, std::size_t count,
                                         std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  const SurfacePicker surface(mesh);
  std::vector<Vec3f> points;
  for (std::size_t i = 0; i < count; ++i) {
    Vec3d p;
    if (i % 3 == 0) {
      const double reach_m = r_max_m * std::pow(10, -4 + 2 * unit(random));
      p = mesh.vertices_m[random() % mesh.vertices_m.size()] +
          reach_m * Vec3d{unit(random), unit(random), unit(random)};
    } else {
      const double reach_m = r_max_m * std::pow(10, -3 + unit(random));
      p = surface.near_m(random, unit(random) < 0 ? -reach_m : reach_m);
    }
    points.push_back(cast<float>(p));
  }
  return points;
}

struct CertaintyCount {
  std::size_t points{}, outside{}, inside{};  ///< of the points, those told so
  std::size_t wrong{};                        ///< told one side and deeper in the other than the tolerance
  double worst_m{};                           ///< deepest of what was told the wrong side
  std::size_t contradicted{};                 ///< told surely, and otherwise by query() in layer 2 or 3
  double sure_share() const { return static_cast<double>(outside + inside) / static_cast<double>(points); }
};

/// What the object tells of the points, against winding numbers and closest points of the mesh.
inline CertaintyCount count_certainty(const runtime::Object& object, const bake::Oracle& oracle,
                                      const std::vector<Vec3f>& points) {
  using runtime::Certainty;
  std::vector<Certainty> told(points.size());
  std::vector<double> wrong_by_m(points.size(), -1);
  std::vector<std::uint8_t> is_contradicted(points.size()), is_inside(points.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points.size(), 1024), [&](const auto& range) {
    const auto first = range.begin(), size = range.size();
    const auto asked = std::span(points).subspan(first, size);
    object.certainty(asked, std::span(told).subspan(first, size));
    for (const auto layer : {runtime::Layer::kTwo, runtime::Layer::kThree}) {
      object.query(asked, {.inside = std::span(is_inside).subspan(first, size)}, {layer});
      for (std::size_t i = first; i < first + size; ++i) {
        const auto wrong_side = is_inside[i] != 0 ? Certainty::kOutside : Certainty::kInside;
        if (told[i] == wrong_side) is_contradicted[i] = 1;
      }
    }
    for (std::size_t i = first; i < first + size; ++i) {
      if (told[i] == Certainty::kUnsure) continue;
      const Vec3d p_m = cast<double>(points[i]);
      if (oracle.inside(p_m) != (told[i] == Certainty::kInside))
        wrong_by_m[i] = oracle.nearest(p_m).distance_m;
    }
  });
  CertaintyCount count;
  count.points = points.size();
  for (std::size_t i = 0; i < points.size(); ++i) {
    count.outside += told[i] == Certainty::kOutside;
    count.inside += told[i] == Certainty::kInside;
    count.contradicted += is_contradicted[i];
    if (wrong_by_m[i] < 0) continue;
    count.worst_m = std::max(count.worst_m, wrong_by_m[i]);
    if (!(wrong_by_m[i] <= object.certainty_tolerance_m())) ++count.wrong;  // NaN: wrong
  }
  return count;
}

}  // namespace sqmap::test
