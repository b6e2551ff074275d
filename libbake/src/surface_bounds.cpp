// SPDX-License-Identifier: GPL-3.0-or-later
#include "surface_bounds.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <utility>
#include <vector>

#include <tbb/parallel_for.h>

namespace sqmap::bake {

namespace {

// Bounds hold up to this multiple of the superquadric: farther than the runtime asks, whose layer 1 has a
// margin.
constexpr double kBoundReach = 1 + 1.0 / 512;
// Cells are taken this much wider [cells], and pieces this much higher and lower [codes], than they are: many
// times what float rounds, and of no effect on the stored codes.
constexpr double kWider = 1.0 / 16384;
constexpr double kHigher = 0.03;
// Of |centre| + radius of the object: 32 units in the last place of a float. The runtime's rotation,
// translation, scaling and division move a point by less than 25 radius + |centre| of such units.
constexpr double kTolerance = 32.0 / (1 << 24);
// The most that both tilts together may be, in their codes: heights then stay above a fourth of the untilted.
constexpr int kMostTilt = 192;
// Width of a cell as a share of R_max: 0.02 leaves about 6 % of the shell of +-3 % of the sample meshes
// unsure, and half of that would take four times the bytes for half as much.
constexpr double kCellWidth = 0.02;
constexpr double kLeastCells = 4;
constexpr double kLeastHeight = 1e-6;  // of a corner, of the box's: below, rounding turns its direction

/// A triangle, cut by planes: by 9 of them at most.
class Polygon {
 public:
  explicit Polygon(const std::array<Vec3d, 3>& triangle) : count_(3) {
    std::copy(triangle.begin(), triangle.end(), corner_.begin());
  }
  bool empty() const { return count_ == 0; }
  const Vec3d* begin() const { return corner_.data(); }
  const Vec3d* end() const { return corner_.data() + count_; }

  /// Keeps what lies at n . p >= least, or more.
  void clip(const Vec3d& n, double least) {
    std::array<Vec3d, 2 * kMost> kept;
    std::size_t count = 0;
    for (std::size_t k = 0; k < count_; ++k) {
      const Vec3d &a = corner_[k], &b = corner_[k + 1 < count_ ? k + 1 : 0];
      const double above_a = dot(n, a) - least, above_b = dot(n, b) - least;
      if (above_a >= 0) kept[count++] = a;
      if ((above_a >= 0) != (above_b >= 0)) kept[count++] = a + (above_a / (above_a - above_b)) * (b - a);
    }
    if (count > kMost) return;  // a sliver that rounding has folded: whole, it is bounded too
    count_ = count < 3 ? 0 : count;
    std::copy(kept.begin(), kept.begin() + static_cast<std::ptrdiff_t>(count_), corner_.begin());
  }

 private:
  static constexpr std::size_t kMost = 3 + 9;  // a plane adds one corner
  std::array<Vec3d, kMost> corner_;
  std::size_t count_;
};

/// Part of a triangle in one cell. Corners as (h, h u, h v), h the untilted height in codes and u, v those of
/// BoundPlace: every tilted height is linear in them.
struct Piece {
  std::uint32_t cell, first, count;  ///< of CutSurface::corners
};

struct CutSurface {
  std::vector<Piece> pieces;  ///< ascending by cell
  std::vector<Vec3d> corners;
};

/// Coordinate `axis` first, outwards, then the next two.
Vec3d in_face(const Vec3d& q, int axis, double sign) {
  return {sign * q[axis], q[(axis + 1) % 3], q[(axis + 2) % 3]};
}

/// First and last cell that holds a direction of the polygon, along u (axis 1) or v (axis 2).
std::pair<std::uint32_t, std::uint32_t> cells_along(const Polygon& polygon, int axis, std::uint32_t cells) {
  double low = 1, high = -1;
  for (const Vec3d& p : polygon) {
    if (!(p.x > kLeastHeight)) return {0, cells - 1};
    low = std::min(low, p[axis] / p.x);
    high = std::max(high, p[axis] / p.x);
  }
  const auto index = [&](double u) {
    return static_cast<std::uint32_t>(std::clamp((u + 1) * 0.5 * cells, 0.0, cells - 1.0));
  };
  return {index(low - 2 * kWider / cells), index(high + 2 * kWider / cells)};
}

/// What of the polygon lies between the planes of one row or column of cells.
Polygon strip(Polygon polygon, int axis, std::uint32_t index, std::uint32_t cells) {
  const double low = 2 * (index - kWider) / cells - 1, high = 2 * (index + 1 + kWider) / cells - 1;
  Vec3d above{-low, 0, 0}, below{high, 0, 0};
  above[axis] = 1;
  below[axis] = -1;
  polygon.clip(above, 0);
  polygon.clip(below, 0);
  return polygon;
}

void cut_triangle(const std::array<Vec3d, 3>& q, std::uint32_t cells, CutSurface& out) {
  for (std::uint32_t face = 0; face < 6; ++face) {
    const int axis = static_cast<int>(face / 2);
    const double sign = face % 2 == 0 ? 1 : -1;
    Polygon inside({in_face(q[0], axis, sign), in_face(q[1], axis, sign), in_face(q[2], axis, sign)});
    inside.clip({-1, 0, 0}, -kBoundReach);
    constexpr double kSlope = 1 + kWider;
    for (const Vec3d& n :
         {Vec3d{kSlope, 1, 0}, Vec3d{kSlope, -1, 0}, Vec3d{kSlope, 0, 1}, Vec3d{kSlope, 0, -1}}) {
      if (!inside.empty()) inside.clip(n, 0);
    }
    if (inside.empty()) continue;
    const auto [first_col, last_col] = cells_along(inside, 1, cells);
    for (std::uint32_t col = first_col; col <= last_col; ++col) {
      const Polygon column = strip(inside, 1, col, cells);
      if (column.empty()) continue;
      const auto [first_row, last_row] = cells_along(column, 2, cells);
      for (std::uint32_t row = first_row; row <= last_row; ++row) {
        const Polygon piece = strip(column, 2, row, cells);
        if (piece.empty()) continue;
        const auto first = static_cast<std::uint32_t>(out.corners.size());
        for (const Vec3d& p : piece) {
          const double u = cells * (p.y + p.x) - (2.0 * col + 1) * p.x;
          const double v = cells * (p.z + p.x) - (2.0 * row + 1) * p.x;
          out.corners.push_back(static_cast<double>(kBoundSteps) * Vec3d{p.x, u, v});
        }
        out.pieces.push_back({(face * cells + row) * cells + col, first,
                              static_cast<std::uint32_t>(out.corners.size()) - first});
      }
    }
  }
}

CutSurface cut_surface(const Part& part, const Mesh& mesh, std::uint32_t cells) {
  const Rotation<double> turn = rotation(part.object_from_part.orientation);
  const Vec3d a = half_extents_m(part.shape);
  std::vector<Vec3d> q;
  q.reserve(mesh.vertices_m.size());
  for (const Vec3d& vertex_m : mesh.vertices_m) {
    const Vec3d p = turn.apply_inverse(vertex_m - part.object_from_part.translation_m);
    q.push_back({p.x / a.x, p.y / a.y, p.z / a.z});
  }
  CutSurface out;
  for (const auto& f : mesh.faces) {
    const std::array<Vec3d, 3> corner{q[f[0]], q[f[1]], q[f[2]]};
    bool is_near = true;
    for (int axis = 0; axis < 3 && is_near; ++axis) {
      const auto [low, high] = std::minmax({corner[0][axis], corner[1][axis], corner[2][axis]});
      is_near = low <= kBoundReach && high >= -kBoundReach;
    }
    if (is_near) cut_triangle(corner, cells, out);
  }
  std::stable_sort(out.pieces.begin(), out.pieces.end(),
                   [](const Piece& one, const Piece& other) { return one.cell < other.cell; });
  return out;
}

/// The surface in one cell, and what of the cell it leaves free.
class CellSurface {
 public:
  /// `top`: height at which the middle of the cell leaves the superquadric.
  explicit CellSurface(double top) : top_(top) {}

  void add(const Vec3d* first, std::uint32_t count) {
    ends_.push_back(ends_.empty() ? count : ends_.back() + count);
    corners_.insert(corners_.end(), first, first + count);
  }
  bool empty() const { return ends_.empty(); }

  /// The bounds, but for their sides, of planes tilted so.
  BoundCell bounds(int tilt_u, int tilt_v) {
    BoundCell cell;
    cell.tilt_u = static_cast<std::uint8_t>(tilt_u);
    cell.tilt_v = static_cast<std::uint8_t>(tilt_v);
    const double u = bound_tilt<double>(cell.tilt_u), v = bound_tilt<double>(cell.tilt_v);
    spans_.clear();
    std::uint32_t k = 0;
    for (const std::uint32_t end : ends_) {
      Span span{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
      for (; k < end; ++k) {
        const double height = corners_[k].x + u * corners_[k].y + v * corners_[k].z;
        span.low = std::min(span.low, height);
        span.high = std::max(span.high, height);
      }
      spans_.push_back({span.low - kHigher, span.high + kHigher});
    }
    std::sort(spans_.begin(), spans_.end(), [](const Span& a, const Span& b) { return a.high > b.high; });

    const double highest = spans_.empty() ? 0 : std::max(0.0, std::ceil(spans_.front().high));
    if (highest < top_ && highest < BoundCell::kNone) cell.outer = static_cast<std::uint8_t>(highest);
    double free_below = std::numeric_limits<double>::infinity(), most = 0;
    const auto offer = [&](double high, double low) {
      const double upper = std::min({std::floor(high), std::floor(top_), 254.0}), lower = std::ceil(low);
      if (!(upper > lower) || !(volume(lower, upper) > most)) return;
      most = volume(lower, upper);
      cell.upper = static_cast<std::uint8_t>(upper);
      cell.lower = static_cast<std::uint8_t>(lower);
    };
    for (const Span& span : spans_) {
      if (span.high < free_below && std::isfinite(free_below)) offer(free_below, std::max(0.0, span.high));
      free_below = std::min(free_below, span.low);
    }
    if (std::isfinite(free_below)) offer(free_below, 0);
    return cell;
  }

  /// Of the pyramid, as a number to compare.
  double free_volume(const BoundCell& cell) const {
    return (cell.outer < BoundCell::kNone ? volume(cell.outer, top_) : 0) +
           (cell.lower <= cell.upper ? volume(cell.lower, cell.upper) : 0);
  }

  /// Bounds with the tilts that leave most free, found downhill from several starts.
  BoundCell best_bounds(const Vec3d& shape_plane) {
    BoundCell best = bounds(BoundCell::kLevel, BoundCell::kLevel);
    if (empty()) return best;
    double most = free_volume(best);
    const auto attempt = [&](int u, int v) {
      u = std::clamp(u, 0, 255);
      v = std::clamp(v, 0, 255);
      if (std::abs(u - BoundCell::kLevel) + std::abs(v - BoundCell::kLevel) > kMostTilt) return false;
      const BoundCell cell = bounds(u, v);
      const double volume = free_volume(cell);
      if (!(volume > most)) return false;
      most = volume;
      best = cell;
      return true;
    };
    const auto attempt_plane = [&](const Vec3d& n) {
      if (!(n.x > 0)) return;
      const auto code = [&](double slope) {
        return BoundCell::kLevel + static_cast<int>(std::clamp(std::round(256 * slope / n.x), -128.0, 127.0));
      };
      attempt(code(n.y), code(n.z));
    };
    attempt_plane(shape_plane);
    attempt_plane(mean_normal());
    for (const int step : {32, 12, 4, 1}) {
      constexpr int kMostMoves = 8;
      for (int move = 0; move < kMostMoves; ++move) {
        const int u = best.tilt_u, v = best.tilt_v;
        bool better = false;
        for (const auto& [du, dv] :
             {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, -1}, {1, -1}, {-1, 1}})
          better = attempt(u + du * step, v + dv * step) || better;
        if (!better) break;
      }
    }
    return best;
  }

 private:
  struct Span {
    double low, high;
  };
  static double volume(double low, double high) { return high * high * high - low * low * low; }

  /// Of all pieces, turned outwards, in the corners' coordinates.
  Vec3d mean_normal() const {
    Vec3d sum;
    std::uint32_t first = 0;
    for (const std::uint32_t end : ends_) {
      Vec3d n;
      for (std::uint32_t k = first + 2; k < end; ++k)
        n = n + cross(corners_[k - 1] - corners_[first], corners_[k] - corners_[first]);
      sum = n.x < 0 ? sum - n : sum + n;
      first = end;
    }
    return sum;
  }

  double top_;
  std::vector<Vec3d> corners_;
  std::vector<std::uint32_t> ends_;
  std::vector<Span> spans_;
};

/// A cell's middle ray and the plane that touches the superquadric where they meet.
struct CellMiddle {
  Vec3d direction;  ///< of the scaled part frame, its largest coordinate 1
  double top;       ///< height at kBoundReach of the superquadric
  Vec3d plane;      ///< the touching plane's normal in coordinates (h, h u, h v)
};

CellMiddle middle_of(const Superquadric& shape, std::uint32_t cell, std::uint32_t cells) {
  const std::uint32_t face = cell / (cells * cells), row = cell / cells % cells, col = cell % cells;
  const int axis = static_cast<int>(face / 2);
  CellMiddle middle;
  middle.direction[axis] = face % 2 == 0 ? 1 : -1;
  middle.direction[(axis + 1) % 3] = (2.0 * col + 1) / cells - 1;
  middle.direction[(axis + 2) % 3] = (2.0 * row + 1) / cells - 1;
  const double narrow = 1 / (1 + std::abs(shape.taper));
  const Superquadric unit{{narrow, narrow, 1}, shape.e1, shape.e2, shape.taper};
  middle.top = kBoundSteps * kBoundReach / inside_outside_radial(unit, middle.direction);
  const Vec3d n = normal_at(unit, middle.direction);
  middle.plane = {dot(n, middle.direction), n[(axis + 1) % 3] / cells, n[(axis + 2) % 3] / cells};
  return middle;
}

}  // namespace

std::uint32_t bound_cells(const Part& part, double r_max_m) {
  const Vec3d& a = part.shape.semi_axes_m;
  const double mean_width_m = 2 * std::cbrt(a.x * a.y * a.z);
  return static_cast<std::uint32_t>(std::clamp(std::round(mean_width_m / (kCellWidth * r_max_m)), kLeastCells,
                                               double{SurfaceBounds::kMostCells}));
}

SurfaceBounds bound_surface(const Part& part, const BoundingSphere& around, const MeshQueries& queries,
                            std::uint32_t cells) {
  const CutSurface surface = cut_surface(part, queries.mesh, cells);
  const Rotation<double> turn = rotation(part.object_from_part.orientation);
  SurfaceBounds out;
  out.cells = cells;
  out.tolerance_m = kTolerance * (norm(around.centre_m) + around.radius_m);
  out.cell.resize(std::size_t{6} * cells * cells);
  tbb::parallel_for(std::uint32_t{0}, 6 * cells * cells, [&](std::uint32_t k) {
    const CellMiddle middle = middle_of(part.shape, k, cells);
    CellSurface in_cell(middle.top);
    const auto by_cell = [](const Piece& piece, std::uint32_t cell) { return piece.cell < cell; };
    for (auto piece = std::lower_bound(surface.pieces.begin(), surface.pieces.end(), k, by_cell);
         piece != surface.pieces.end() && piece->cell == k; ++piece) {
      const Vec3d* first = &surface.corners[piece->first];
      // Wholly beyond the plane that touches the superquadric: beyond the superquadric.
      const bool is_beyond = std::all_of(first, first + piece->count, [&](const Vec3d& corner) {
        return dot(middle.plane, corner) > middle.plane.x * middle.top + kHigher;
      });
      if (!is_beyond) in_cell.add(first, piece->count);
    }
    BoundCell cell = in_cell.best_bounds(middle.plane);
    const auto is_inside = [&](double height) {
      // Any direction serves; this one lies in no plane that models are aligned with.
      const Vec3d direction = normalized(Vec3d{0.3217, 0.5431, 0.7757});
      const Vec3d a = half_extents_m(part.shape);
      const Vec3d q = (height / kBoundSteps) * middle.direction;
      const Vec3d p_m =
          turn.apply(Vec3d{a.x * q.x, a.y * q.y, a.z * q.z}) + part.object_from_part.translation_m;
      std::vector<RayTracer::Hit> hits;
      queries.rays.trace_line(p_m, direction, hits);
      return queries.winding(p_m, direction, hits) > 0;
    };
    if (cell.outer < BoundCell::kNone && is_inside(0.5 * (cell.outer + middle.top))) cell.sides |= 1U;
    if (cell.lower <= cell.upper && is_inside(0.5 * (cell.lower + cell.upper))) cell.sides |= 2U;
    out.cell[k] = cell;
  });
  return out;
}

}  // namespace sqmap::bake
