// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "sqmap/asset/map_grid.hpp"
#include "sqmap/asset/superquadric.hpp"

namespace sqmap {

/// Foot point of a query on a superquadric, in the coordinates of its map.
template <class T>
struct Foot {
  T row{};      ///< [cells of level 0], in [0, rows - 1]
  T col{};      ///< [cells of level 0], in [0, cols)
  T depth_m{};  ///< S: distance from the surface along the inward normal; negative outside
};

/// The superquadric's surface at one place of its map, with derivatives along the map's coordinates. Part
/// frame.
template <class T>
struct SurfaceSample {
  Vec3<T> point_m;      ///< r
  Vec3<T> normal;       ///< n, outward, unit length
  Vec3<T> point_row_m;  ///< dr/drow [m a cell]
  Vec3<T> point_col_m;  ///< dr/dcol [m a cell]
  Vec3<T> normal_row;   ///< dn/drow [1/cell]
  Vec3<T> normal_col;   ///< dn/dcol [1/cell]
};

/// Tables that answer, without powers, where the foot point of a query lies and what the surface is there.
/// One of the two 1-D tables runs over eta, one over omega, one quadrant each: r(eta, omega) is a product of
/// the two.
///
/// The nodes are those of the map, subdivided to at least kMinCells arcs a quadrant, with cubic Hermite
/// interpolation between them. Immutable, thread-safe; nothing here allocates but the constructor.
template <class T>
class ShapeTable {
 public:
  static constexpr std::uint32_t kMinCells = 32;

  ShapeTable(const Superquadric& shape, std::uint32_t rows, std::uint32_t cols);

  /// The nearest point of the surface to m (part frame, any finite point), as S, row and col.
  ///
  /// The paper maximises the cosine I_S of eq. (19), which has several maxima and is 0/0 on the surface; here
  /// the squared distance is minimised. By symmetry the foot lies in the octant of m. Every local minimum of
  /// a 5 x 5 scan of that octant is followed down through halved steps of the tables; the best one is refined
  /// by a quadratic through its 3 x 3 neighbours.
  Foot<T> foot(const Vec3<T>& m) const noexcept;

  /// The surface at (row, col), row in [0, rows - 1], col taken modulo cols.
  SurfaceSample<T> sample(T row, T col) const noexcept;

  std::size_t bytes() const noexcept { return (eta_.capacity() + omega_.capacity()) * sizeof(Node); }

 private:
  struct Node {
    T c, s;              // superellipse point
    T c_power, s_power;  // its normal, unnormalised
    T c_step, s_step;    // d(c, s) a table cell
  };
  struct Curve {
    T c, s, c_power, s_power, c_step, s_step, c_power_step, s_power_step;
  };
  struct Candidate {
    int i, j;
    T square;
  };

  static std::vector<Node> make_nodes(double alpha_m, double beta_m, double e, std::uint32_t cells);
  static Curve interpolate(const std::vector<Node>& nodes, T position) noexcept;
  T square_at(int i, int j, const Vec3<T>& m) const noexcept;
  Candidate descend(Candidate start, int stride_i, int stride_j, const Vec3<T>& m) const noexcept;

  Vec3<T> axes_m_, inverse_axes_;
  T half_rows_, quarter_cols_;     // map cells a quadrant
  T eta_per_row_, omega_per_col_;  // table cells a map cell
  std::vector<Node> eta_, omega_;  // [eta cells + 1], [omega cells + 1]
};

template <class T>
std::vector<typename ShapeTable<T>::Node> ShapeTable<T>::make_nodes(double alpha_m, double beta_m, double e,
                                                                    std::uint32_t cells) {
  const auto points = quadrant_nodes(alpha_m, beta_m, e, cells);
  double length_m = 0;
  for (std::uint32_t k = 0; k < cells; ++k) {
    length_m +=
        std::hypot(alpha_m * (points[k + 1].c - points[k].c), beta_m * (points[k + 1].s - points[k].s));
  }
  std::vector<Node> nodes;
  nodes.reserve(points.size());
  for (const auto& p : points) {
    // The tangent is (-s_power, c_power) in unit coordinates; scaled so that its length is one arc.
    const double speed = length_m / cells / std::hypot(alpha_m * p.s_power, beta_m * p.c_power);
    nodes.push_back(
        {T(p.c), T(p.s), T(p.c_power), T(p.s_power), T(-p.s_power * speed), T(p.c_power * speed)});
  }
  return nodes;
}

template <class T>
ShapeTable<T>::ShapeTable(const Superquadric& shape, std::uint32_t rows, std::uint32_t cols)
    : axes_m_(cast<T>(shape.semi_axes_m)),
      inverse_axes_{T(1 / shape.semi_axes_m.x), T(1 / shape.semi_axes_m.y), T(1 / shape.semi_axes_m.z)},
      half_rows_(T(rows - 1) / T(2)),
      quarter_cols_(T(cols) / T(4)) {
  const std::uint32_t half = (rows - 1) / 2, quarter = cols / 4;
  const std::uint32_t eta_factor = (kMinCells + half - 1) / half;
  const std::uint32_t omega_factor = (kMinCells + quarter - 1) / quarter;
  eta_per_row_ = T(eta_factor);
  omega_per_col_ = T(omega_factor);
  eta_ = make_nodes(std::sqrt(shape.semi_axes_m.x * shape.semi_axes_m.y), shape.semi_axes_m.z, shape.e1,
                    half * eta_factor);
  omega_ = make_nodes(shape.semi_axes_m.x, shape.semi_axes_m.y, shape.e2, quarter * omega_factor);
}

template <class T>
typename ShapeTable<T>::Curve ShapeTable<T>::interpolate(const std::vector<Node>& nodes,
                                                         T position) noexcept {
  const int last = static_cast<int>(nodes.size()) - 2;
  const int k = std::clamp(static_cast<int>(position), 0, last);
  const T t = position - T(k);
  const Node& a = nodes[k];
  const Node& b = nodes[k + 1];
  const T u = T(1) - t;
  const T h01 = t * t * (T(3) - T(2) * t), h00 = T(1) - h01, h10 = t * u * u, h11 = -t * t * u;
  const T d01 = T(6) * t * u, d10 = u * (T(1) - T(3) * t), d11 = t * (T(3) * t - T(2));
  Curve curve;
  curve.c = h00 * a.c + h01 * b.c + h10 * a.c_step + h11 * b.c_step;
  curve.s = h00 * a.s + h01 * b.s + h10 * a.s_step + h11 * b.s_step;
  curve.c_step = d01 * (b.c - a.c) + d10 * a.c_step + d11 * b.c_step;
  curve.s_step = d01 * (b.s - a.s) + d10 * a.s_step + d11 * b.s_step;
  curve.c_power = a.c_power + t * (b.c_power - a.c_power);
  curve.s_power = a.s_power + t * (b.s_power - a.s_power);
  curve.c_power_step = b.c_power - a.c_power;
  curve.s_power_step = b.s_power - a.s_power;
  return curve;
}

template <class T>
T ShapeTable<T>::square_at(int i, int j, const Vec3<T>& m) const noexcept {
  const T x = axes_m_.x * eta_[i].c * omega_[j].c - m.x;
  const T y = axes_m_.y * eta_[i].c * omega_[j].s - m.y;
  const T z = axes_m_.z * eta_[i].s - m.z;
  return x * x + y * y + z * z;
}

template <class T>
typename ShapeTable<T>::Candidate ShapeTable<T>::descend(Candidate best, int stride_i, int stride_j,
                                                         const Vec3<T>& m) const noexcept {
  const int last_i = static_cast<int>(eta_.size()) - 1, last_j = static_cast<int>(omega_.size()) - 1;
  constexpr int kMovesPerLevel = 8;  // bounds the time; two suffice on all but needles
  while (stride_i > 1 || stride_j > 1) {
    stride_i = std::max(1, stride_i / 2);
    stride_j = std::max(1, stride_j / 2);
    for (int move = 0; move < kMovesPerLevel; ++move) {
      const Candidate centre = best;
      for (int di = -1; di <= 1; ++di) {
        for (int dj = -1; dj <= 1; ++dj) {
          const int i = std::clamp(centre.i + di * stride_i, 0, last_i);
          const int j = std::clamp(centre.j + dj * stride_j, 0, last_j);
          const T square = square_at(i, j, m);
          if (square < best.square) best = {i, j, square};
        }
      }
      if (best.i == centre.i && best.j == centre.j) break;
    }
  }
  return best;
}

template <class T>
Foot<T> ShapeTable<T>::foot(const Vec3<T>& point) const noexcept {
  using std::abs;
  using std::sqrt;
  const Vec3<T> m{abs(point.x), abs(point.y), abs(point.z)};
  const int last_i = static_cast<int>(eta_.size()) - 1, last_j = static_cast<int>(omega_.size()) - 1;

  constexpr int kScan = 4;  // scan cells a side of the octant
  std::array<Candidate, (kScan + 1) * (kScan + 1)> scan;
  for (int a = 0; a <= kScan; ++a) {
    for (int b = 0; b <= kScan; ++b) {
      const int i = a * last_i / kScan, j = b * last_j / kScan;
      scan[a * (kScan + 1) + b] = {i, j, square_at(i, j, m)};
    }
  }
  Candidate best{0, 0, scan[0].square};
  bool first = true;
  for (int a = 0; a <= kScan; ++a) {
    for (int b = 0; b <= kScan; ++b) {
      const Candidate& here = scan[a * (kScan + 1) + b];
      bool lowest = true;
      for (int da = std::max(-1, -a); da <= std::min(1, kScan - a); ++da) {
        for (int db = std::max(-1, -b); db <= std::min(1, kScan - b); ++db) {
          lowest = lowest && !(scan[(a + da) * (kScan + 1) + b + db].square < here.square);
        }
      }
      if (!lowest) continue;
      const Candidate found = descend(here, (last_i + kScan - 1) / kScan, (last_j + kScan - 1) / kScan, m);
      if (first || found.square < best.square) best = found;
      first = false;
    }
  }

  // Quadratic through the 3 x 3 neighbours; across a plane of symmetry the neighbour is the mirror image.
  const auto square_beside = [&](int i, int j) {
    Vec3<T> mirrored = m;
    if (i < 0) i = -i, mirrored.z = -m.z;
    if (i > last_i) i = 2 * last_i - i, mirrored.x = -mirrored.x, mirrored.y = -mirrored.y;
    if (j < 0) j = -j, mirrored.y = -mirrored.y;
    if (j > last_j) j = 2 * last_j - j, mirrored.x = -mirrored.x;
    return square_at(i, j, mirrored);
  };
  const T f0 = best.square;
  const T fn = square_beside(best.i - 1, best.j), fs = square_beside(best.i + 1, best.j);
  const T fw = square_beside(best.i, best.j - 1), fe = square_beside(best.i, best.j + 1);
  const T g_i = (fs - fn) / T(2), g_j = (fe - fw) / T(2);
  const T h_ii = fs + fn - T(2) * f0, h_jj = fe + fw - T(2) * f0;
  const T h_ij = (square_beside(best.i + 1, best.j + 1) - square_beside(best.i + 1, best.j - 1) -
                  square_beside(best.i - 1, best.j + 1) + square_beside(best.i - 1, best.j - 1)) /
                 T(4);
  const T determinant = h_ii * h_jj - h_ij * h_ij;
  T step_i = 0, step_j = 0;
  // A share of the diagonal product keeps nearly singular systems (poles, medial axis) out of the 2-D step.
  if (determinant > T(1e-3) * h_ii * h_jj && h_ii > T(0)) {
    step_i = (h_ij * g_j - h_jj * g_i) / determinant;
    step_j = (h_ij * g_i - h_ii * g_j) / determinant;
  } else {
    if (h_ii > T(0)) step_i = -g_i / h_ii;
    if (h_jj > T(0)) step_j = -g_j / h_jj;
  }
  const T i = std::clamp(T(best.i) + std::clamp(step_i, T(-1), T(1)), T(0), T(last_i));
  const T j = std::clamp(T(best.j) + std::clamp(step_j, T(-1), T(1)), T(0), T(last_j));

  const T du = i / eta_per_row_, dv = j / omega_per_col_;
  Foot<T> foot;
  foot.row = point.z < T(0) ? half_rows_ - du : half_rows_ + du;
  if (point.y < T(0)) {
    foot.col = point.x < T(0) ? dv : T(2) * quarter_cols_ - dv;
  } else {
    foot.col = point.x < T(0) ? T(4) * quarter_cols_ - dv : T(2) * quarter_cols_ + dv;
    if (!(foot.col < T(4) * quarter_cols_)) foot.col = T(0);
  }
  const SurfaceSample<T> surface = sample(foot.row, foot.col);
  // The projection onto the normal, not the distance: a tangential error of the foot then enters only
  // squared.
  foot.depth_m = dot(surface.normal, surface.point_m - point);
  return foot;
}

template <class T>
SurfaceSample<T> ShapeTable<T>::sample(T row, T col) const noexcept {
  const T up = row - half_rows_;
  const T eta_sign = up < T(0) ? T(-1) : T(1);
  Curve eta = interpolate(eta_, eta_sign * up * eta_per_row_);
  eta.s *= eta_sign;
  eta.s_power *= eta_sign;
  eta.c_step *= eta_sign;  // even in eta: its derivative is odd
  eta.c_power_step *= eta_sign;

  const T turn = T(4) * quarter_cols_;
  T wrapped = col < T(0) ? col + turn : col;
  if (!(wrapped < turn)) wrapped -= turn;
  const int quadrant = std::clamp(static_cast<int>(wrapped / quarter_cols_), 0, 3);
  const T along = wrapped - T(quadrant) * quarter_cols_;
  const bool backwards = quadrant == 1 || quadrant == 3;
  Curve omega = interpolate(omega_, (backwards ? quarter_cols_ - along : along) * omega_per_col_);
  const T c_sign = quadrant == 0 || quadrant == 3 ? T(-1) : T(1);
  const T s_sign = quadrant < 2 ? T(-1) : T(1);
  const T direction = backwards ? T(-1) : T(1);
  omega.c *= c_sign;
  omega.s *= s_sign;
  omega.c_power *= c_sign;
  omega.s_power *= s_sign;
  omega.c_step *= c_sign * direction;
  omega.s_step *= s_sign * direction;
  omega.c_power_step *= c_sign * direction;
  omega.s_power_step *= s_sign * direction;

  SurfaceSample<T> out;
  out.point_m = {axes_m_.x * eta.c * omega.c, axes_m_.y * eta.c * omega.s, axes_m_.z * eta.s};
  out.point_row_m = eta_per_row_ * Vec3<T>{axes_m_.x * eta.c_step * omega.c, axes_m_.y * eta.c_step * omega.s,
                                           axes_m_.z * eta.s_step};
  out.point_col_m =
      omega_per_col_ * Vec3<T>{axes_m_.x * eta.c * omega.c_step, axes_m_.y * eta.c * omega.s_step, T(0)};

  const Vec3<T> gradient{eta.c_power * omega.c_power * inverse_axes_.x,
                         eta.c_power * omega.s_power * inverse_axes_.y, eta.s_power * inverse_axes_.z};
  const Vec3<T> gradient_row = eta_per_row_ * Vec3<T>{eta.c_power_step * omega.c_power * inverse_axes_.x,
                                                      eta.c_power_step * omega.s_power * inverse_axes_.y,
                                                      eta.s_power_step * inverse_axes_.z};
  const Vec3<T> gradient_col =
      omega_per_col_ * Vec3<T>{eta.c_power * omega.c_power_step * inverse_axes_.x,
                               eta.c_power * omega.s_power_step * inverse_axes_.y, T(0)};
  const T length = norm(gradient);
  const T inverse_length = length > T(0) ? T(1) / length : T(0);
  out.normal = inverse_length * gradient;
  out.normal_row = inverse_length * (gradient_row - dot(out.normal, gradient_row) * out.normal);
  out.normal_col = inverse_length * (gradient_col - dot(out.normal, gradient_col) * out.normal);
  return out;
}

}  // namespace sqmap
