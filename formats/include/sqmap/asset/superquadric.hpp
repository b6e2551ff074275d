// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "sqmap/asset/bend.hpp"
#include "sqmap/asset/vec.hpp"

namespace sqmap {

/// Exponents a superquadric may have. Below 0.1 powers overflow; above 2 the body is not convex, and the
/// bounding guarantee of FORMAT.md (vertices inside means triangles inside, of straight ones) would be lost.
inline constexpr double kMinExponent = 0.1;
inline constexpr double kMaxExponent = 2.0;

/// Superquadric (superellipsoid) shape in its own part frame, centred at the origin; tapered along z: what
/// lies at the height z is widened by 1 + taper z/a3 (paper eq. (2) with K_x = K_y = taper); then bent.
/// Without the bend it is convex. What follows takes and gives places in the part frame, bend and
/// all, unless it says otherwise.
template <class T>
struct SuperquadricOf {
  Vec3<T> semi_axes_m{T(1), T(1), T(1)};  ///< a1, a2, a3 > 0 [m]
  T e1{1};                                ///< squareness along the meridians (eta), in [0.1, 2]
  T e2{1};                                ///< squareness along the parallels (omega), in [0.1, 2]
  T taper{0};                             ///< K, within +- max_taper(e1); 0: rigid
  Bend<T> bend{};                         ///< within kMostBendTurn and kMostBendReach; none: straight
  friend bool operator==(const SuperquadricOf&, const SuperquadricOf&) = default;
};
using Superquadric = SuperquadricOf<double>;

/// The superquadric in its straight frame.
template <class T>
SuperquadricOf<T> straight(const SuperquadricOf<T>& sq) noexcept {
  return {sq.semi_axes_m, sq.e1, sq.e2, sq.taper, {}};
}

/// The largest taper K at which a superquadric with the exponent e1 is convex: (1 - e1/2) 2^(e1/2), below 1.
///
/// At the height w = z/a3 the cross-section has the width c(w) (1 + K w), c = (1 - |w|^q)^(1/q), q = 2/e1;
/// the body is convex where that is concave. Its second derivative is nowhere positive exactly if q - 1 >=
/// |K| w (q + 1 - 2 w^q) on [0, 1]; the right side is greatest at w^q = 1/2.
inline double max_taper(double e1) noexcept { return (1 - e1 / 2) * std::exp2(e1 / 2); }

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

/// The t for which (u, w) / t lies on the meridian of a tapered superquadric, FORMAT.md (S7):
///
///     | ( u / (t + K w), w / t ) |_{2/e} = 1
///
/// The left side falls with t and is convex, so that Newton's method climbs from a t that is too small to the
/// root without passing it.
///
/// @param u  distance from the axis over that of the surface at the equator, >= 0
/// @param w  z/a3
template <class T>
T tapered_radial(const T& u, const T& w, const T& taper, const T& e) noexcept {
  using std::abs;
  using std::pow;
  constexpr int kMostSteps = 32;   // 5 are usual; a double has no more to gain from these
  const T across = u - taper * w;  // each term alone is 1 or less from here, or from |w|
  T t = abs(w) > across ? abs(w) : across;
  for (int k = 0; k < kMostSteps && t > T(0); ++k) {
    const T width = t + taper * w;
    const T x = u / width, y = abs(w) / t;
    const T n = superellipse_norm<T>(x, y, e);
    const T slope = n * (pow(x / n, T(2) / e) / width + pow(y / n, T(2) / e) / t);
    const T next = t + (n - T(1)) / slope;
    if (!(next > t)) break;  // NaN too
    t = next;
  }
  return t;
}

/// Radial form of the inside-outside function, FORMAT.md (S1):
///
///     beta(p) = | ( |(x/a1, y/a2)|_{2/e2} , z/a3 ) |_{2/e1}
///
/// beta < 1 inside, 1 on the surface, > 1 outside; beta(t p) = t beta(p) for t >= 0 where there is no bend;
/// the paper's F is beta^2. beta is not a distance. Source: Barr 1981; Moustakas et al. 2007, eq. (1) with
/// its misprint 2/e^2 read as 2/e2. Of a tapered superquadric: the same multiple of its surface, (S7); of a
/// bent one that of the place in the straight frame, (S9).
///
/// @param point  query point, part frame [m]
/// @return   beta [-], finite for finite input short of overflow of p/a
template <class T>
T inside_outside_radial(const SuperquadricOf<T>& sq, const Vec3<T>& point) noexcept {
  using std::abs;
  const Vec3<T> p = straightened(sq.bend, point);
  const T u = superellipse_norm<T>(abs(p.x) / sq.semi_axes_m.x, abs(p.y) / sq.semi_axes_m.y, sq.e2);
  if (sq.taper != T(0)) return tapered_radial<T>(u, p.z / sq.semi_axes_m.z, sq.taper, sq.e1);
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
  const T width = T(1) + sq.taper * eta.s;
  return bent(sq.bend, Vec3<T>{sq.semi_axes_m.x * eta.c * omega.c * width,
                               sq.semi_axes_m.y * eta.c * omega.s * width, sq.semi_axes_m.z * eta.s});
}

/// An outward vector along the normal at r(eta, omega), FORMAT.md (S5). Finite for every angle and exponent
/// in range.
template <class T>
Vec3<T> surface_gradient(const SuperquadricOf<T>& sq, const SuperellipsePoint<T>& eta,
                         const SuperellipsePoint<T>& omega) noexcept {
  const T width = T(1) + sq.taper * eta.s;
  const T lean = sq.taper * (eta.c * eta.c_power) / width;
  const Vec3<T> gradient{eta.c_power * omega.c_power / (sq.semi_axes_m.x * width),
                         eta.c_power * omega.s_power / (sq.semi_axes_m.y * width),
                         (eta.s_power - lean) / sq.semi_axes_m.z};
  if (sq.bend.is_none()) return gradient;
  return turned(sq.bend, surface_point(straight(sq), eta, omega), gradient);
}

/// Outward unit normal at r(eta, omega).
template <class T>
Vec3<T> surface_normal(const SuperquadricOf<T>& sq, const SuperellipsePoint<T>& eta,
                       const SuperellipsePoint<T>& omega) noexcept {
  return normalized(surface_gradient(sq, eta, omega));
}

/// Outward unit normal of the superquadric through the point (the direction of grad beta there), part frame.
/// (0, 0, 0) only at the centre.
template <class T>
Vec3<T> normal_at(const SuperquadricOf<T>& sq, const Vec3<T>& point) noexcept {
  const Vec3<T> p = straightened(sq.bend, point);
  const T x = p.x / sq.semi_axes_m.x, y = p.y / sq.semi_axes_m.y, z = p.z / sq.semi_axes_m.z;
  using std::abs;
  const T u = superellipse_norm<T>(abs(x), abs(y), sq.e2);
  const SuperellipsePoint<T> omega =
      u > T(0) ? superellipse_point<T>(x / u, y / u, sq.e2) : SuperellipsePoint<T>{T(1), T(0), T(1), T(0)};
  const bool tapered = sq.taper != T(0);
  const T beta = tapered ? tapered_radial<T>(u, z, sq.taper, sq.e1) : superellipse_norm<T>(u, abs(z), sq.e1);
  if (!(beta > T(0))) return {};
  const T width = tapered ? beta + sq.taper * z : beta;
  const SuperellipsePoint<T> eta = superellipse_point<T>(u / width, z / beta, sq.e1);
  return normalized(turned(sq.bend, p, surface_gradient(straight(sq), eta, omega)));
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

/// Bounds from above of width(w) = c(w) (1 + taper w), the half width of a superquadric at the height w =
/// z/a3 over that at its equator, and of its sums with heights: the largest of `value(width, |w|)`, which
/// rises with both.
template <class Value>
double largest_over_heights(double taper, double e1, const Value& value) noexcept {
  constexpr int kSteps = 512;  // a side; between two heights the lower one's c and the upper one's |w| count
  double largest = 0;
  for (int k = 0; k < kSteps; ++k) {
    const double low = static_cast<double>(k) / kSteps, high = static_cast<double>(k + 1) / kSteps;
    const double c = std::pow(1 - std::pow(low, 2 / e1), e1 / 2);
    for (const double side : {taper, -taper})
      largest = std::max(largest, value(c * (1 + std::max(side * low, side * high)), high));
  }
  return largest;
}

/// Radius of a ball around the centre of a straight superquadric that holds it: the smallest, or of a tapered
/// one a few thousandths larger [m].
inline double bounding_radius_m(const Superquadric& sq) noexcept {
  const Vec3d& a = sq.semi_axes_m;
  const double across = largest_on_superellipse(a.x * a.x, a.y * a.y, sq.e2);
  if (sq.taper == 0) return std::sqrt(largest_on_superellipse(across, a.z * a.z, sq.e1));
  return std::sqrt(largest_over_heights(
      sq.taper, sq.e1, [&](double width, double w) { return width * width * across + w * w * a.z * a.z; }));
}

/// A ball around the superquadric, part frame: of bounding_radius_m() around the centre of a straight one; of
/// a bent one the smallest, but for a few hundredths, whose centre lies where the bend leans.
inline BoundingSphere bounding_sphere(const Superquadric& sq) noexcept {
  if (sq.bend.is_none()) return {{}, bounding_radius_m(sq)};
  // Cross-sections lie in discs. Between the heights of one step a disc moves by less than half a step of the
  // axis, within it by less than that times lambda.
  constexpr int kSteps = 128;  // a side
  struct Disc {
    double radius_m, slack_m, x_m, z_m, cosine, sine;
  };
  std::array<Disc, std::size_t{2} * kSteps> discs;
  const Vec3d& a = sq.semi_axes_m;
  const double across_m = std::sqrt(largest_on_superellipse(a.x * a.x, a.y * a.y, sq.e2));
  const double k = sq.bend.curvature(), step_m = a.z / kSteps;
  int place = -kSteps;
  for (Disc& disc : discs) {
    const int i = place++;
    const double low = std::min(std::abs(i), std::abs(i + 1)) / double{kSteps};
    const double c = std::pow(1 - std::pow(low, 2 / sq.e1), sq.e1 / 2);
    disc.radius_m = across_m * c * (1 + std::max(sq.taper * i, sq.taper * (i + 1)) / kSteps);
    disc.slack_m = 0.5 * step_m * (1 + k * disc.radius_m);
    const double angle = k * (i + 0.5) * step_m;
    disc.sine = std::sin(angle);
    disc.cosine = std::cos(angle);
    disc.x_m = (1 - disc.cosine) / k;
    disc.z_m = disc.sine / k;
  }
  // Of the ball around the place `lean_m` from the part's centre in the direction of the bend.
  const auto radius_m = [&](double lean_m) {
    double largest_m = 0;
    for (const Disc& disc : discs) {
      const double x_m = disc.x_m - lean_m;
      const double along_m = std::abs(x_m * disc.cosine - disc.z_m * disc.sine);
      const double square_m2 =
          x_m * x_m + disc.z_m * disc.z_m + disc.radius_m * (disc.radius_m + 2 * along_m);
      largest_m = std::max(largest_m, std::sqrt(square_m2) + disc.slack_m);
    }
    return largest_m;
  };
  double low_m = 0, high_m = (1 - std::cos(k * a.z)) / k;
  constexpr int kThirds = 12;  // the radius is convex in where the centre lies
  for (int i = 0; i < kThirds; ++i) {
    const double third_m = (high_m - low_m) / 3;
    const bool is_low = radius_m(low_m + third_m) < radius_m(high_m - third_m);
    (is_low ? high_m : low_m) += is_low ? -third_m : third_m;
  }
  const double lean_m = 0.5 * (low_m + high_m);
  return {{lean_m * (sq.bend.x / k), lean_m * (sq.bend.y / k), 0}, radius_m(lean_m)};
}

/// The same in the object's frame.
inline BoundingSphere bounding_sphere(const Superquadric& sq, const Pose& object_from_part) noexcept {
  BoundingSphere sphere = bounding_sphere(sq);
  sphere.centre_m =
      rotation(object_from_part.orientation).apply(sphere.centre_m) + object_from_part.translation_m;
  return sphere;
}

/// Volume [m^3]: 2 a1 a2 a3 e1 e2 B(e1/2 + 1, e1) B(e2/2, e2/2) (Jaklic, Leonardis, Solina 2000), times
/// 1 + K^2 B(3 e1/2, e1 + 1) / B(e1/2, e1 + 1) of one with the taper K: cross-sections grow by (1 + K w)^2,
/// w = z/a3, and the second factor is the mean of w^2. A bend, whose lambda is 1 in the mean over every
/// cross-section, leaves it.
inline double volume_m3(const Superquadric& sq) noexcept {
  const auto beta = [](double x, double y) { return std::tgamma(x) * std::tgamma(y) / std::tgamma(x + y); };
  const double rigid_m3 = 2 * sq.semi_axes_m.x * sq.semi_axes_m.y * sq.semi_axes_m.z * sq.e1 * sq.e2 *
                          beta(sq.e1 / 2 + 1, sq.e1) * beta(sq.e2 / 2, sq.e2 / 2);
  if (sq.taper == 0) return rigid_m3;
  return rigid_m3 * (1 + sq.taper * sq.taper * beta(1.5 * sq.e1, sq.e1 + 1) / beta(0.5 * sq.e1, sq.e1 + 1));
}

/// Half extents of a box around the superquadric in its straight frame: a1 (1 + |K|), a2 (1 + |K|), a3 [m].
template <class T>
Vec3<T> half_extents_m(const SuperquadricOf<T>& sq) noexcept {
  using std::abs;
  const T widest = T(1) + abs(sq.taper);
  return {sq.semi_axes_m.x * widest, sq.semi_axes_m.y * widest, sq.semi_axes_m.z};
}

/// The largest share of its arc's radius by which a bent superquadric may come near the middle: no place of
/// it has a lambda below 1 minus this.
inline double bend_reach(const Superquadric& sq) noexcept {
  const Vec3d half_m = half_extents_m(sq);
  return std::abs(sq.bend.x) * half_m.x + std::abs(sq.bend.y) * half_m.y;
}

}  // namespace sqmap
