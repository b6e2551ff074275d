// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include "sqmap/asset/vec.hpp"

namespace sqmap {

/// Exponents a superquadric may have. Below 0.1 powers overflow; above 2 the body is not convex, and the
/// bounding guarantee of FORMAT.md (vertices inside means triangles inside) would be lost.
inline constexpr double kMinExponent = 0.1;
inline constexpr double kMaxExponent = 2.0;

/// Superquadric (superellipsoid) shape in its own part frame, centred at the origin.
template <class T>
struct SuperquadricOf {
  Vec3<T> semi_axes_m{T(1), T(1), T(1)};  ///< a1, a2, a3 > 0 [m]
  T e1{1};                                ///< squareness along the meridians (eta), in [0.1, 2]
  T e2{1};                                ///< squareness along the parallels (omega), in [0.1, 2]
  friend bool operator==(const SuperquadricOf&, const SuperquadricOf&) = default;
};
using Superquadric = SuperquadricOf<double>;

/// |(u, v)| in the p-norm with p = 2/e, for u, v >= 0:  m (1 + (n/m)^p)^(1/p), m = max, n = min.
///
/// The ratio form neither overflows nor underflows for any finite u, v. Where n = 0 the result is the
/// constant m, which is also the right derivative for p >= 1, so that automatic differentiation stays finite
/// (FORMAT.md S2).
template <class T>
T superellipse_norm(const T& u, const T& v, const T& e) noexcept {
  using std::pow;
  const T& m = u < v ? v : u;
  const T& n = u < v ? u : v;
  if (!(n > T(0))) return m;  // also m = 0
  return m * pow(T(1) + pow(n / m, T(2) / e), e / T(2));
}

/// Radial form of the inside-outside function, FORMAT.md (S1):
///
///     beta(p) = | ( |(x/a1, y/a2)|_{2/e2} , z/a3 ) |_{2/e1}
///
/// beta < 1 inside, 1 on the surface, > 1 outside; beta(t p) = t beta(p) for t >= 0; the paper's F is beta^2.
/// beta is not a distance. Source: Barr 1981; Moustakas et al. 2007, eq. (1) with its misprint 2/e^2 read as
/// 2/e2.
///
/// @param p  query point, part frame [m]
/// @return   beta [-], finite for finite input short of overflow of p/a
template <class T>
T inside_outside_radial(const SuperquadricOf<T>& sq, const Vec3<T>& p) noexcept {
  using std::abs;
  const T u = superellipse_norm<T>(abs(p.x) / sq.semi_axes_m.x, abs(p.y) / sq.semi_axes_m.y, sq.e2);
  return superellipse_norm<T>(u, abs(p.z) / sq.semi_axes_m.z, sq.e1);
}

/// Inside-outside function of the paper, eq. (1): F(p) = beta(p)^2.
template <class T>
T inside_outside(const SuperquadricOf<T>& sq, const Vec3<T>& p) noexcept {
  const T beta = inside_outside_radial(sq, p);
  return beta * beta;
}

/// A point of the unit superellipse |c|^(2/e) + |s|^(2/e) = 1, with what its tangent and normal need.
template <class T>
struct SuperellipsePoint {
  T c{}, s{};              ///< coordinates; the polar angle of (c, s) is the angle it was made from
  T c_power{}, s_power{};  ///< sgn(c) |c|^(2/e - 1), sgn(s) |s|^(2/e - 1): the unnormalised normal
};

/// Signed power sgn(x) |x|^k for k >= 0, with 0^0 = 1 carried by the sign of x (0 gives 0 for k > 0).
template <class T>
T signed_power(const T& x, const T& k) noexcept {
  using std::abs;
  using std::copysign;
  using std::pow;
  return copysign(pow(abs(x), k), x);
}

/// Point of the unit superellipse in the direction (cos_angle, sin_angle), FORMAT.md (S3):
/// c = cos/N, s = sin/N with N = |(cos, sin)|_{2/e}. This is the paper's eq. (9) without its tangent, which
/// in float turns the pole +pi/2 into -pi/2.
template <class T>
SuperellipsePoint<T> superellipse_point(const T& cos_angle, const T& sin_angle, const T& e) noexcept {
  using std::abs;
  const T n = superellipse_norm<T>(abs(cos_angle), abs(sin_angle), e);
  SuperellipsePoint<T> point{cos_angle / n, sin_angle / n, T(0), T(0)};
  const T k = T(2) / e - T(1);
  point.c_power = signed_power(point.c, k);
  point.s_power = signed_power(point.s, k);
  return point;
}

/// Surface point r(eta, omega) of FORMAT.md (S4) from its two superellipse points [m, part frame].
template <class T>
Vec3<T> surface_point(const SuperquadricOf<T>& sq, const SuperellipsePoint<T>& eta,
                      const SuperellipsePoint<T>& omega) noexcept {
  return {sq.semi_axes_m.x * eta.c * omega.c, sq.semi_axes_m.y * eta.c * omega.s, sq.semi_axes_m.z * eta.s};
}

/// Outward unit normal at r(eta, omega), FORMAT.md (S5). Finite for every angle and exponent in range.
template <class T>
Vec3<T> surface_normal(const SuperquadricOf<T>& sq, const SuperellipsePoint<T>& eta,
                       const SuperellipsePoint<T>& omega) noexcept {
  return normalized(Vec3<T>{eta.c_power * omega.c_power / sq.semi_axes_m.x,
                            eta.c_power * omega.s_power / sq.semi_axes_m.y, eta.s_power / sq.semi_axes_m.z});
}

/// Outward unit normal of the superquadric through p (the direction of grad beta at p), part frame.
/// (0, 0, 0) only at the centre.
template <class T>
Vec3<T> normal_at(const SuperquadricOf<T>& sq, const Vec3<T>& p) noexcept {
  const T x = p.x / sq.semi_axes_m.x, y = p.y / sq.semi_axes_m.y, z = p.z / sq.semi_axes_m.z;
  using std::abs;
  const T u = superellipse_norm<T>(abs(x), abs(y), sq.e2);
  const SuperellipsePoint<T> omega =
      u > T(0) ? superellipse_point<T>(x / u, y / u, sq.e2) : SuperellipsePoint<T>{T(1), T(0), T(1), T(0)};
  const T beta = superellipse_norm<T>(u, abs(z), sq.e1);
  if (!(beta > T(0))) return {};
  const SuperellipsePoint<T> eta = superellipse_point<T>(u / beta, z / beta, sq.e1);
  return surface_normal(sq, eta, omega);
}

/// Largest value of alpha c^2 + beta s^2 on the unit superellipse |c|^(2/e) + |s|^(2/e) = 1: with u = c^2, v
/// = s^2 the dual norm of (alpha, beta) where e < 1, the larger of the two where the curve lies inside the
/// circle.
inline double largest_on_superellipse(double alpha, double beta, double e) noexcept {
  const double most = std::max(alpha, beta), least = std::min(alpha, beta);
  // Below this the exponent 1/(1-e) overflows, and the result is `most` to the last bit anyway.
  if (e > 1 - 1e-6 || !(least > 0)) return most;
  const double q = 1 / (1 - e);
  return most * std::pow(1 + std::pow(least / most, q), 1 / q);
}

/// Radius of the smallest ball around the centre that holds the superquadric, exactly [m].
inline double bounding_radius_m(const Superquadric& sq) noexcept {
  const Vec3d& a = sq.semi_axes_m;
  return std::sqrt(
      largest_on_superellipse(largest_on_superellipse(a.x * a.x, a.y * a.y, sq.e2), a.z * a.z, sq.e1));
}

}  // namespace sqmap
