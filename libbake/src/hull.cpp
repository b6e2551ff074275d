// SPDX-License-Identifier: GPL-3.0-or-later
//
// CGAL::convex_hull_3 is not used: it orders vertices by their addresses, so the same points gave another
// order of vertices, and another triangulation of flat faces, from call to call (CGAL 5.5.1). CGAL gives the
// exact predicates.
#include "hull.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <utility>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Projection_traits_xy_3.h>
#include <CGAL/Projection_traits_xz_3.h>
#include <CGAL/Projection_traits_yz_3.h>
#include <CGAL/convex_hull_2.h>

namespace sqmap::bake {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Points = std::vector<Point>;
using Index = std::uint32_t;

/// Corners of coplanar, not collinear points, in cyclic order. The points are projected along an axis, found
/// by an exact test, along which they do not collapse.
Points polygon(const Points& points, const Point& a, const Point& b, const Point& c) {
  Points corners;
  const auto out = std::back_inserter(corners);
  const CGAL::Projection_traits_xy_3<Kernel> xy;
  const CGAL::Projection_traits_xz_3<Kernel> xz;
  const CGAL::Projection_traits_yz_3<Kernel> yz;
  if (xy.orientation_2_object()(a, b, c) != CGAL::COLLINEAR)
    CGAL::convex_hull_2(points.begin(), points.end(), out, xy);
  else if (xz.orientation_2_object()(a, b, c) != CGAL::COLLINEAR)
    CGAL::convex_hull_2(points.begin(), points.end(), out, xz);
  else
    CGAL::convex_hull_2(points.begin(), points.end(), out, yz);
  return corners;
}

Vec3d vec(const Point& p) { return {p.x(), p.y(), p.z()}; }

/// Quickhull (Barber et al. 1996): each face keeps the points that it sees; the farthest of them replaces all
/// the faces that see it by the cone from it to their outline. Points seen by a face that went are kept by a
/// new face or lie inside: on its way out of the hull from the old face, such a point crosses only new faces.
/// Sidedness is exact: where rounding could decide, exact arithmetic does. Distances only choose the order.
class Quickhull {
 public:
  struct Face {
    std::array<Index, 3> corner;  ///< counter-clockwise from outside
    std::array<Index, 3> across;  ///< face beyond the edge corner[i], corner[i + 1]
    std::vector<Index> outside;
    Vec3d normal;  ///< cross product of the edges from corner[0]
    bool is_alive{true};
  };

  /// @param seed  four points that span a volume
  Quickhull(const Points& points, std::array<Index, 4> seed)
      : points_(points), surely_(height_error(points)), face_from_(points.size()) {
    auto& [a, b, c, d] = seed;
    if (CGAL::orientation(points[a], points[b], points[c], points[d]) == CGAL::POSITIVE) std::swap(a, b);
    faces_ = {new_face({a, b, c}, {1, 2, 3}), new_face({b, a, d}, {0, 3, 2}), new_face({c, b, d}, {0, 1, 3}),
              new_face({a, c, d}, {0, 2, 1})};
    std::vector<Index> all(points.size());
    for (Index i = 0; i < all.size(); ++i) all[i] = i;
    assign(all, 0);
    for (Index f = 0; f < faces_.size(); ++f)
      if (faces_[f].is_alive && !faces_[f].outside.empty()) add_point(farthest(f), f);
    std::erase_if(faces_, [](const Face& f) { return !f.is_alive; });  // `across` is of no use any more
  }

  const std::vector<Face>& faces() const { return faces_; }

 private:
  /// Bound of the rounding error of height(): with differences of coordinates up to x, y and z it sums 6
  /// products of at most xyz, each with at most 8 roundings of 1.2e-16. Infinite where products could
  /// underflow.
  static double height_error(const Points& points) {
    Vec3d low = vec(points[0]), high = low;
    for (const Point& point : points) {
      const Vec3d p = vec(point);
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
    const Vec3d size = high - low;
    const double least = std::min({size.x, size.y, size.z}), most = std::max({size.x, size.y, size.z});
    constexpr double kSafe = 1e-90;
    return least > kSafe && most < 1 / kSafe ? 1e-14 * size.x * size.y * size.z
                                             : std::numeric_limits<double>::infinity();
  }

  Face new_face(const std::array<Index, 3>& corner, const std::array<Index, 3>& across) const {
    const Vec3d a = vec(points_[corner[0]]);
    return {corner, across, {}, cross(vec(points_[corner[1]]) - a, vec(points_[corner[2]]) - a)};
  }

  /// Of a point above the plane of a face, times twice the face's area.
  double height(const Face& f, Index p) const {
    return dot(f.normal, vec(points_[p]) - vec(points_[f.corner[0]]));
  }

  bool sees(Index face, Index p) const {
    const double rounded = height(faces_[face], p);
    if (std::abs(rounded) > surely_) return rounded > 0;
    const auto& c = faces_[face].corner;
    return CGAL::orientation(points_[c[0]], points_[c[1]], points_[c[2]], points_[p]) == CGAL::POSITIVE;
  }

  /// Gives each point to the first of the faces from `first_face` on that sees it.
  void assign(const std::vector<Index>& candidates, Index first_face) {
    for (const Index p : candidates)
      for (Index f = first_face; f < faces_.size(); ++f)
        if (sees(f, p)) {
          faces_[f].outside.push_back(p);
          break;
        }
  }

  Index farthest(Index face) const {
    const Face& f = faces_[face];
    const std::vector<Index>& outside = f.outside;
    return *std::max_element(outside.begin(), outside.end(),
                             [&](Index p, Index q) { return height(f, p) < height(f, q); });
  }

  void add_point(Index p, Index start) {
    const Index first_new = static_cast<Index>(faces_.size());
    std::vector<Index> visible{start}, orphans;
    faces_[start].is_alive = false;
    for (std::size_t i = 0; i < visible.size(); ++i) {
      const auto [corner, across] = std::pair(faces_[visible[i]].corner, faces_[visible[i]].across);
      for (std::size_t side = 0; side < 3; ++side) {
        const Index beyond = across.at(side);
        if (!faces_[beyond].is_alive) continue;
        if (sees(beyond, p)) {
          faces_[beyond].is_alive = false;
          visible.push_back(beyond);
        } else {
          add_face(corner.at(side), corner.at((side + 1) % 3), p, beyond);
        }
      }
      // Not p: it lies in the planes of all new faces, which takes exact arithmetic to see.
      std::ranges::remove_copy(faces_[visible[i]].outside, std::back_inserter(orphans), p);
      faces_[visible[i]].outside.clear();
    }
    for (Index f = first_new; f < faces_.size(); ++f) {  // around p: the face from b follows that from a to b
      const Index follower = face_from_[faces_[f].corner[1]];
      faces_[f].across[1] = follower;
      faces_[follower].across[2] = f;
    }
    assign(orphans, first_new);
  }

  void add_face(Index a, Index b, Index p, Index beyond) {
    const Index added = static_cast<Index>(faces_.size());
    Face& neighbour = faces_[beyond];
    for (std::size_t side = 0; side < 3; ++side)
      if (neighbour.corner.at(side) == b) neighbour.across.at(side) = added;
    face_from_[a] = added;
    faces_.push_back(new_face({a, b, p}, {beyond, added, added}));
  }

  const Points& points_;
  std::vector<Face> faces_;
  double surely_;                 ///< greater heights have the right sign
  std::vector<Index> face_from_;  ///< of the newest faces, the one whose outer edge starts at a vertex
};

/// Points inside an edge or a face of the hull can become vertices of a flat surrounding; a corner has faces
/// in three planes.
std::vector<bool> corners(const Points& points, const std::vector<Quickhull::Face>& faces) {
  std::vector<std::array<const Quickhull::Face*, 2>> planes(points.size(), {nullptr, nullptr});
  std::vector<bool> is_corner(points.size(), false);
  const auto same_plane = [&](const Quickhull::Face& f, const Quickhull::Face& g) {
    return std::all_of(g.corner.begin(), g.corner.end(), [&](Index i) {
      return std::ranges::count(f.corner, i) > 0 ||
             CGAL::coplanar(points[f.corner[0]], points[f.corner[1]], points[f.corner[2]], points[i]);
    });
  };
  for (const Quickhull::Face& face : faces) {
    for (const Index i : face.corner) {
      auto& known = planes[i];
      if (is_corner[i] || (known[0] && same_plane(*known[0], face)) ||
          (known[1] && same_plane(*known[1], face)))
        continue;
      if (!known[0])
        known[0] = &face;
      else if (!known[1])
        known[1] = &face;
      else
        is_corner[i] = true;
    }
  }
  return is_corner;
}

Hull flat_hull(Points outline) {
  Hull hull;
  const Vec3d origin = outline.empty() ? Vec3d{} : vec(outline[0]);
  Vec3d twice_area{};
  for (std::size_t i = 1; i + 1 < outline.size(); ++i)
    twice_area = twice_area + cross(vec(outline[i]) - origin, vec(outline[i + 1]) - origin);
  hull.area = norm(twice_area);
  std::sort(outline.begin(), outline.end());
  for (const Point& p : outline) hull.vertices.push_back(vec(p));
  return hull;
}

Hull solid_hull(const Points& points, const std::vector<Quickhull::Face>& faces,
                const std::vector<bool>& is_corner) {
  Hull hull;
  std::vector<Index> rank(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    if (is_corner[i]) {
      rank[i] = static_cast<Index>(hull.vertices.size());
      hull.vertices.push_back(vec(points[i]));
    }
  for (const Quickhull::Face& face : faces) {
    auto& c = hull.faces.emplace_back(face.corner);
    for (Index& i : c) i = rank[i];
    std::rotate(c.begin(), std::min_element(c.begin(), c.end()), c.end());
  }
  std::sort(hull.faces.begin(), hull.faces.end());  // sums over them then do not depend on points inside

  const Vec3d origin = hull.vertices.front();  // far from the coordinate origin the volume would cancel
  for (const auto& c : hull.faces) {
    const Vec3d a = hull.vertices[c[0]], normal = cross(hull.vertices[c[1]] - a, hull.vertices[c[2]] - a);
    hull.area += norm(normal) / 2;
    hull.volume_m3 += dot(a - origin, normal) / 6;
  }
  hull.volume_m3 = std::max(hull.volume_m3, 0.0);  // slivers round either way
  return hull;
}

/// The point of greatest measure, if the exact test accepts it; otherwise the first that it accepts, or the
/// end.
template <class Measure, class Test>
Points::const_iterator farthest_that(const Points& points, const Measure& measure, const Test& accepts) {
  const auto farthest = std::max_element(
      points.begin(), points.end(), [&](const Point& p, const Point& q) { return measure(p) < measure(q); });
  return accepts(*farthest) ? farthest : std::find_if(points.begin(), points.end(), accepts);
}

/// The hull of ascending, distinct points.
Hull hull_of_sorted(const Points& points) {
  if (points.size() < 3) return flat_hull(points);
  // Sorted, so the first and last points are the ends of a collinear set. The farthest points span most;
  // whether they span at all is decided exactly.
  const Point &first = points.front(), &last = points.back();
  const Vec3d origin = vec(first), along = vec(last) - origin;
  const auto apex = farthest_that(
      points, [&](const Point& p) { return norm(cross(along, vec(p) - origin)); },
      [&](const Point& p) { return !CGAL::collinear(first, last, p); });
  if (apex == points.end()) return flat_hull({first, last});
  const Vec3d normal = cross(along, vec(*apex) - origin);
  const auto above = farthest_that(
      points, [&](const Point& p) { return std::abs(dot(normal, vec(p) - origin)); },
      [&](const Point& p) { return !CGAL::coplanar(first, last, *apex, p); });
  if (above == points.end()) return flat_hull(polygon(points, first, last, *apex));

  const auto index = [&](Points::const_iterator it) { return static_cast<Index>(it - points.begin()); };
  const Quickhull quickhull(points, {0, index(points.end()) - 1, index(apex), index(above)});
  const std::vector<bool> is_corner = corners(points, quickhull.faces());
  const bool has_flat_vertex =
      std::any_of(quickhull.faces().begin(), quickhull.faces().end(), [&](const Quickhull::Face& f) {
        return std::any_of(f.corner.begin(), f.corner.end(), [&](Index i) { return !is_corner[i]; });
      });
  if (!has_flat_vertex) return solid_hull(points, quickhull.faces(), is_corner);
  Points kept;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (is_corner[i]) kept.push_back(points[i]);
  return hull_of_sorted(kept);  // corners alone: ends after one round
}

}  // namespace

Hull convex_hull(std::span<const Vec3d> points) {
  Points sorted;
  sorted.reserve(points.size());
  for (const Vec3d& p : points) sorted.emplace_back(p.x, p.y, p.z);
  std::sort(sorted.begin(), sorted.end());
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  return hull_of_sorted(sorted);
}

}  // namespace sqmap::bake
