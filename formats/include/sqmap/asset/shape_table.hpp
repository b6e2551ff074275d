// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "sqmap/asset/map_grid.hpp"
#include "sqmap/asset/superquadric.hpp"

namespace sqmap {

/// The lesser and the greater of two numbers, b where they are equal or one is NaN: what SIMD units compute.
template <class T>
constexpr T lesser(T a, T b) noexcept {
  return a < b ? a : b;
}
template <class T>
constexpr T greater(T a, T b) noexcept {
  return a > b ? a : b;
}

/// Foot point of a query on a superquadric, in the coordinates of its map.
template <class T>
struct Foot {
  T row{};      ///< [cells of level 0], in [0, rows - 1]
  T col{};      ///< [cells of level 0], in [0, cols)
  T depth_m{};  ///< S: distance from the surface along the inward normal; negative outside
  T cell_m{};   ///< |dr/drow| + |dr/dcol| there: height and width of a cell [m]
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

/// One quadrant of a superellipse as kCells cubic Hermite arcs of equal length. `position` runs from 0 at
/// (1, 0) to kCells at (0, 1).
template <class T>
struct CurveTable {
  static constexpr int kCells = 32;

  T c[kCells + 1], s[kCells + 1];            ///< the curve
  T c_step[kCells + 1], s_step[kCells + 1];  ///< its derivative along the position

  /// A place of the curve with first and second derivatives along the position.
  struct Place {
    T c, s, c_1, s_1, c_2, s_2;
  };
  Place at(T position) const noexcept {
    const int k = std::clamp(static_cast<int>(position), 0, kCells - 1);
    const T t = position - T(k);
    Place place;
    hermite(c[k], c[k + 1], c_step[k], c_step[k + 1], t, place.c, place.c_1, place.c_2);
    hermite(s[k], s[k + 1], s_step[k], s_step[k + 1], t, place.s, place.s_1, place.s_2);
    return place;
  }

  /// The curve (c (1 + taper s), s): the quadrant of a tapered meridian that lies on the side of +s. Its arcs
  /// are of equal length where of() knew the taper.
  CurveTable tapered(T taper) const noexcept {
    CurveTable table = *this;
    for (int k = 0; k <= kCells; ++k) {
      const T width = T(1) + taper * s[k];
      table.c[k] = c[k] * width;
      table.c_step[k] = c_step[k] * width + taper * (c[k] * s_step[k]);
    }
    return table;
  }

  /// The superellipse with semi-axes alpha and beta and exponent e, at places where the same with the taper
  /// has arcs of equal length.
  static CurveTable of(double alpha_m, double beta_m, double e, double taper = 0) {
    const auto points = quadrant_nodes(alpha_m, beta_m, e, kCells, taper);
    const auto c_of = [&](int k) { return points[k].c * (1 + taper * points[k].s); };
    double length_m = 0;
    for (int k = 0; k < kCells; ++k) {
      length_m += std::hypot(alpha_m * (c_of(k + 1) - c_of(k)), beta_m * (points[k + 1].s - points[k].s));
    }
    CurveTable table;
    for (int k = 0; k <= kCells; ++k) {
      // The tangent is (-s_power, c_power) in unit coordinates; scaled so that its length is one arc.
      const auto& p = points[k];
      const double c_way = p.s_power * (1 + taper * p.s) - taper * (p.c * p.c_power);
      const double speed = length_m / kCells / std::hypot(alpha_m * c_way, beta_m * p.c_power);
      table.c[k] = T(p.c);
      table.s[k] = T(p.s);
      table.c_step[k] = T(-p.s_power * speed);
      table.s_step[k] = T(p.c_power * speed);
    }
    return table;
  }

 private:
  static void hermite(T a, T b, T a_step, T b_step, T t, T& value, T& first, T& second) noexcept {
    const T rise = b - a;
    const T cubic = (a_step + b_step) - (rise + rise);
    const T square = (rise - a_step) - cubic;
    value = a + t * (a_step + t * (square + t * cubic));
    first = a_step + t * ((square + square) + t * (T(3) * cubic));
    second = (square + square) + t * (T(6) * cubic);
  }
};

/// Tables that answer, without powers, where the foot point of a query lies and what the surface is there:
/// r(eta, omega) is a product of two 1-D curves. A tapered meridian has two halves, either a quadrant of its
/// own. Every operation is one that IEEE 754 rounds exactly, in an order that the runtime's SIMD kernels
/// follow, so that their answers equal these to the last bit. Immutable once prepared, thread-safe, allocates
/// nothing.
template <class T>
struct ShapeTable {
  static constexpr int kCells = CurveTable<T>::kCells;
  static constexpr int kScan = 8;         ///< start points of the foot search a side of the octant
  static constexpr int kNewtonSteps = 3;  ///< of the foot search
  static constexpr T kMostStep = 4;  ///< of one Newton step [table cells]: the spacing of the start points
  static constexpr T kLeastCurvature =
      T(0.2);  ///< of the squared distance, as a share of the tangents' squares
  static constexpr T kLeastDeterminant =
      T(0.03);  ///< below this share of the diagonal's product: two 1-D steps

  /// The node of the curves where start point k lies.
  static constexpr int scan_node(int k) noexcept { return kCells / kScan * k + kCells / kScan / 2; }

  ShapeTable() = default;
  ShapeTable(const Superquadric& shape, std::uint32_t rows, std::uint32_t cols) {
    const double across_m = std::sqrt(shape.semi_axes_m.x * shape.semi_axes_m.y);
    eta = CurveTable<T>::of(across_m, shape.semi_axes_m.z, shape.e1, shape.taper);
    if (shape.taper != 0)
      eta_below = CurveTable<T>::of(across_m, shape.semi_axes_m.z, shape.e1, -shape.taper);
    omega = CurveTable<T>::of(shape.semi_axes_m.x, shape.semi_axes_m.y, shape.e2);
    prepare(cast<T>(shape.semi_axes_m), T(shape.taper), rows, cols);
  }
  /// Sets the rest from the curves `eta` and `eta_below`, not yet tapered, and `omega`.
  void prepare(const Vec3<T>& semi_axes_m, T taper, std::uint32_t rows, std::uint32_t cols) noexcept;

  /// The nearest point of the surface to m (part frame, any finite point), as S, row and col.
  ///
  /// The paper maximises the cosine I_S of eq. (19), which has several maxima and is 0/0 on the surface; here
  /// the squared distance is minimised. By symmetry the foot lies in the octant of m, or on a tapered shape
  /// in the quadrant of m_x and m_y. The nearest of 8 x 8 points an octant is refined by Newton's method on
  /// the continuous surface, kept downhill by bounds on the curvature and on the step.
  Foot<T> foot(const Vec3<T>& m) const noexcept;

  /// The surface at (row, col), row in [0, rows - 1], col taken modulo cols.
  SurfaceSample<T> sample(T row, T col) const noexcept;

  Vec3<T> axes_m, inverse_axes;
  T half_rows, quarter_cols;     ///< map cells a quadrant
  T eta_per_row, omega_per_col;  ///< table cells a map cell
  T row_per_eta, col_per_omega;
  CurveTable<T> eta, omega;
  T taper;

  /// Constants of the foot search: |r - m|^2 over (i, j) is least where
  /// c_i (W_j - c_i square_j / 2) + z_i m_z - z_i^2 / 2  is greatest, W_j = x_j m_x + y_j m_y.
  struct Scan {
    T x_m[kScan], y_m[kScan], c[kScan], z_m[kScan], half_z_square_m2[kScan];
    T half_square_m2[kScan][kScan];  ///< [i][j] c_i (x_j^2 + y_j^2) / 2
  };
  Scan scan;

  // Of a tapered shape only: the half below the equator, mirrored.
  CurveTable<T> eta_below;
  Scan scan_below;

 private:
  bool is_tapered() const noexcept { return taper != T(0); }
  /// The meridian at u, counted downwards from the equator where it is negative.
  typename CurveTable<T>::Place eta_at(T u) const noexcept {
    if (!is_tapered() || !(u < T(0))) return eta.at(u);
    const auto e = eta_below.at(-u);
    return {e.c, -e.s, -e.c_1, e.s_1, e.c_2, -e.s_2};
  }
  Scan scan_of(const CurveTable<T>& meridian) const noexcept;
  /// Moves (u, v) to the start point nearest to m where it is nearer than those before.
  static void choose_start(const Scan& scan, const Vec3<T>& m, T& u, T& v, T& most) noexcept;
  void newton_step(const Vec3<T>& m, T& u, T& v) const noexcept;
  /// Unnormalised outward normal in the octant: the cross product of the tangents without the factor c of
  /// eta.
  Vec3<T> gradient(const typename CurveTable<T>::Place& e,
                   const typename CurveTable<T>::Place& o) const noexcept {
    const T w = o.c * o.s_1 - o.s * o.c_1;
    return {(e.s_1 * o.s_1) * inverse_axes.x, (e.s_1 * -o.c_1) * inverse_axes.y,
            (-e.c_1 * w) * inverse_axes.z};
  }
};

template <class T>
void ShapeTable<T>::prepare(const Vec3<T>& semi_axes_m, T shape_taper, std::uint32_t rows,
                            std::uint32_t cols) noexcept {
  axes_m = semi_axes_m;
  inverse_axes = {T(1) / axes_m.x, T(1) / axes_m.y, T(1) / axes_m.z};
  half_rows = T(rows - 1) / T(2);
  quarter_cols = T(cols) / T(4);
  eta_per_row = T(kCells) / half_rows;
  omega_per_col = T(kCells) / quarter_cols;
  row_per_eta = half_rows / T(kCells);
  col_per_omega = quarter_cols / T(kCells);
  taper = shape_taper;
  if (is_tapered()) {
    eta_below = eta_below.tapered(-taper);
    scan_below = scan_of(eta_below);
    eta = eta.tapered(taper);
  }
  scan = scan_of(eta);
}

template <class T>
typename ShapeTable<T>::Scan ShapeTable<T>::scan_of(const CurveTable<T>& meridian) const noexcept {
  Scan out;
  for (int k = 0; k < kScan; ++k) {
    const int node = scan_node(k);
    out.x_m[k] = axes_m.x * omega.c[node];
    out.y_m[k] = axes_m.y * omega.s[node];
    out.c[k] = meridian.c[node];
    out.z_m[k] = axes_m.z * meridian.s[node];
    out.half_z_square_m2[k] = T(0.5) * out.z_m[k] * out.z_m[k];
  }
  for (int i = 0; i < kScan; ++i) {
    const T half = T(0.5) * out.c[i];
    for (int j = 0; j < kScan; ++j) {
      out.half_square_m2[i][j] = half * (out.x_m[j] * out.x_m[j] + out.y_m[j] * out.y_m[j]);
    }
  }
  return out;
}

template <class T>
void ShapeTable<T>::choose_start(const Scan& scan, const Vec3<T>& m, T& u, T& v, T& most) noexcept {
  T along[kScan];
  for (int j = 0; j < kScan; ++j) along[j] = scan.x_m[j] * m.x + scan.y_m[j] * m.y;
  for (int i = 0; i < kScan; ++i) {
    T row_most = along[0] - scan.half_square_m2[i][0];
    T row_v = T(scan_node(0));
    for (int j = 1; j < kScan; ++j) {
      const T here = along[j] - scan.half_square_m2[i][j];
      if (here > row_most) {
        row_most = here;
        row_v = T(scan_node(j));
      }
    }
    const T here = scan.c[i] * row_most + (scan.z_m[i] * m.z - scan.half_z_square_m2[i]);
    if (here > most) {
      most = here;
      u = T(scan_node(i));
      v = row_v;
    }
  }
}

template <class T>
void ShapeTable<T>::newton_step(const Vec3<T>& m, T& u, T& v) const noexcept {
  const auto e = eta_at(u), o = omega.at(v);
  // r = (x e.c, y e.c, z e.s) and derivatives; d = r - m.
  const T x = axes_m.x * o.c, y = axes_m.y * o.s;
  const T x_1 = axes_m.x * o.c_1, y_1 = axes_m.y * o.s_1;
  const T x_2 = axes_m.x * o.c_2, y_2 = axes_m.y * o.s_2;
  const T z_1 = axes_m.z * e.s_1, z_2 = axes_m.z * e.s_2;
  const T dx = x * e.c - m.x, dy = y * e.c - m.y, dz = axes_m.z * e.s - m.z;
  const T along = dx * x + dy * y, along_1 = dx * x_1 + dy * y_1, along_2 = dx * x_2 + dy * y_2;
  const T g_u = e.c_1 * along + dz * z_1;
  const T g_v = e.c * along_1;
  const T t_uu = (e.c_1 * e.c_1) * (x * x + y * y) + z_1 * z_1;
  const T t_vv = (e.c * e.c) * (x_1 * x_1 + y_1 * y_1);
  const T h_uu = greater(t_uu + (e.c_2 * along + dz * z_2), kLeastCurvature * t_uu);
  T h_vv = greater(t_vv + e.c * along_2, kLeastCurvature * t_vv);
  h_vv = h_vv > T(0) ? h_vv : T(1);  // a pole: g_v is 0 too
  const T h_uv = e.c_1 * (e.c * (x * x_1 + y * y_1) + along_1);
  const T product = h_uu * h_vv;
  const T determinant = product - h_uv * h_uv;
  // A share of the diagonal product keeps nearly singular systems (poles, medial axis) out of the 2-D step.
  const bool regular = determinant > kLeastDeterminant * product;
  const T coupling = regular ? h_uv : T(0);
  const T inverse = T(1) / (regular ? determinant : product);
  const T du = (coupling * g_v - h_vv * g_u) * inverse;
  const T dv = (coupling * g_u - h_uu * g_v) * inverse;
  const T lowest = is_tapered() ? T(-kCells) : T(0);
  u = lesser(greater(u + lesser(greater(du, -kMostStep), kMostStep), lowest), T(kCells));
  v = lesser(greater(v + lesser(greater(dv, -kMostStep), kMostStep), T(0)), T(kCells));
}

template <class T>
Foot<T> ShapeTable<T>::foot(const Vec3<T>& point) const noexcept {
  using std::abs;
  using std::sqrt;
  const Vec3<T> m{abs(point.x), abs(point.y), is_tapered() ? point.z : abs(point.z)};
  T u = 0, v = 0, most = -std::numeric_limits<T>::infinity();
  choose_start(scan, m, u, v, most);
  if (is_tapered()) {
    const T above = most;
    T u_below = u;
    choose_start(scan_below, {m.x, m.y, -m.z}, u_below, v, most);
    u = most > above ? -u_below : u;
  }
  for (int step = 0; step < kNewtonSteps; ++step) newton_step(m, u, v);

  const auto e = eta_at(u), o = omega.at(v);
  const T x = axes_m.x * o.c, y = axes_m.y * o.s;
  const T dx = x * e.c - m.x, dy = y * e.c - m.y, dz = axes_m.z * e.s - m.z;
  const Vec3<T> n = normalized(gradient(e, o));
  Foot<T> foot;
  // The projection onto the normal, not the distance: a tangential error of the foot then enters only
  // squared.
  foot.depth_m = n.x * dx + n.y * dy + n.z * dz;
  const T x_1 = axes_m.x * o.c_1, y_1 = axes_m.y * o.s_1, z_1 = axes_m.z * e.s_1;
  foot.cell_m = sqrt((e.c_1 * e.c_1) * (x * x + y * y) + z_1 * z_1) * eta_per_row +
                (e.c * sqrt(x_1 * x_1 + y_1 * y_1)) * omega_per_col;
  const T du = u * row_per_eta, dv = v * col_per_omega;
  foot.row = point.z < T(0) && !is_tapered() ? half_rows - du : half_rows + du;
  const T turn = T(4) * quarter_cols, half_turn = T(2) * quarter_cols;
  if (point.y < T(0)) {
    foot.col = point.x < T(0) ? dv : half_turn - dv;
  } else {
    foot.col = point.x < T(0) ? turn - dv : half_turn + dv;
    if (!(foot.col < turn)) foot.col = T(0);
  }
  return foot;
}

template <class T>
SurfaceSample<T> ShapeTable<T>::sample(T row, T col) const noexcept {
  using std::abs;
  const T up = row - half_rows;
  const T z_sign = up < T(0) ? T(-1) : T(1);
  const auto e = (up < T(0) && is_tapered() ? eta_below : eta).at(abs(up) * eta_per_row);

  const T turn = T(4) * quarter_cols;
  T wrapped = col < T(0) ? col + turn : col;
  wrapped = wrapped < turn ? wrapped : wrapped - turn;
  // From the half turn (omega = 0) outwards; beyond a quarter the curve is walked backwards.
  const T around = wrapped - T(2) * quarter_cols;
  const T y_sign = around < T(0) ? T(-1) : T(1);
  const T along = abs(around);
  const T x_sign = along > quarter_cols ? T(-1) : T(1);
  const auto o = omega.at((along > quarter_cols ? T(2) * quarter_cols - along : along) * omega_per_col);

  // Everything in the octant, then the signs: a coordinate carries its own, a derivative that of its
  // direction too.
  const T row_scale = z_sign * eta_per_row, col_scale = (x_sign * y_sign) * omega_per_col;
  const T x = axes_m.x * o.c, y = axes_m.y * o.s;
  SurfaceSample<T> out;
  out.point_m = {x_sign * (x * e.c), y_sign * (y * e.c), z_sign * (axes_m.z * e.s)};
  out.point_row_m = {(x_sign * row_scale) * (x * e.c_1), (y_sign * row_scale) * (y * e.c_1),
                     (z_sign * row_scale) * (axes_m.z * e.s_1)};
  out.point_col_m = {(x_sign * col_scale) * ((axes_m.x * o.c_1) * e.c),
                     (y_sign * col_scale) * ((axes_m.y * o.s_1) * e.c), T(0)};

  const T w = o.c * o.s_1 - o.s * o.c_1, w_1 = o.c * o.s_2 - o.s * o.c_2;
  const Vec3<T> g = gradient(e, o);
  const Vec3<T> g_row{(e.s_2 * o.s_1) * inverse_axes.x, (e.s_2 * -o.c_1) * inverse_axes.y,
                      (-e.c_2 * w) * inverse_axes.z};
  const Vec3<T> g_col{(e.s_1 * o.s_2) * inverse_axes.x, (e.s_1 * -o.c_2) * inverse_axes.y,
                      (-e.c_1 * w_1) * inverse_axes.z};
  const T length = norm(g);
  const T inverse_length = length > T(0) ? T(1) / length : T(0);
  const Vec3<T> n = inverse_length * g;
  const Vec3<T> n_row = inverse_length * (g_row - dot(n, g_row) * n);
  const Vec3<T> n_col = inverse_length * (g_col - dot(n, g_col) * n);
  out.normal = {x_sign * n.x, y_sign * n.y, z_sign * n.z};
  out.normal_row = {(x_sign * row_scale) * n_row.x, (y_sign * row_scale) * n_row.y,
                    (z_sign * row_scale) * n_row.z};
  out.normal_col = {(x_sign * col_scale) * n_col.x, (y_sign * col_scale) * n_col.y,
                    (z_sign * col_scale) * n_col.z};
  return out;
}

}  // namespace sqmap
