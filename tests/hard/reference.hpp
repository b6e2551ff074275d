// SPDX-License-Identifier: Apache-2.0
//
// Superquadrics in 50 decimal digits, from the paper's eq. (1) as Barr printed it: no line in common with
// formats or libruntime.
#pragma once

#include <array>

#include <boost/multiprecision/cpp_bin_float.hpp>

#include "sqmap/asset/superquadric.hpp"

namespace sqmap::reference {

using Real = boost::multiprecision::cpp_bin_float_50;
using Point = std::array<Real, 3>;

inline Real power(const Real& base, const Real& exponent) {
  return base == 0 ? Real(0) : boost::multiprecision::pow(base, exponent);
}

/// The root of F(x, y, z) of the rigid superquadric: 1 on the surface, and t times as large t times as far
/// from the centre.
template <class T, class P>
Real rigid_radial(const SuperquadricOf<T>& sq, const P& p) {
  const Real e1(sq.e1), e2(sq.e2);
  const auto term = [](const Real& length, const Real& axis, const Real& exponent) {
    return power(abs(length) / axis, exponent);
  };
  const Real across =
      term(Real(p[0]), Real(sq.semi_axes_m.x), 2 / e2) + term(Real(p[1]), Real(sq.semi_axes_m.y), 2 / e2);
  return power(power(across, e2 / e1) + term(Real(p[2]), Real(sq.semi_axes_m.z), 2 / e1), e1 / 2);
}

/// The same of a tapered one: the t for which p / t, with its taper undone as in the paper's eq. (2), lies on
/// the rigid one. Found by halving.
template <class T, class P>
Real radial(const SuperquadricOf<T>& sq, const P& p) {
  const Real taper(sq.taper), height = Real(p[2]) / Real(sq.semi_axes_m.z);
  if (taper == 0 || (p[0] == 0 && p[1] == 0 && p[2] == 0)) return rigid_radial(sq, p);
  const auto is_beyond = [&](const Real& t) {
    if (abs(height) > t) return true;
    const Real width = t * (1 + taper * height / t);
    return rigid_radial(sq, Point{Real(p[0]) / width, Real(p[1]) / width, Real(p[2]) / t}) > 1;
  };
  Real high = rigid_radial(sq, p);
  while (is_beyond(high)) high *= 2;
  Real low = high / 2;
  while (!is_beyond(low)) low /= 2;
  constexpr int kHalvings = 70;  // to the last bit of a double, and four more digits
  for (int k = 0; k < kHalvings; ++k) {
    const Real middle = (low + high) / 2;
    (is_beyond(middle) ? low : high) = middle;
  }
  return high;
}

/// The gradient of F of a rigid superquadric, not normalised; needs x, y and z other than 0.
template <class T>
Point gradient(const SuperquadricOf<T>& sq, const Point& p) {
  const Real e1(sq.e1), e2(sq.e2), ax(sq.semi_axes_m.x), ay(sq.semi_axes_m.y), az(sq.semi_axes_m.z);
  const Real x = abs(p[0]) / ax, y = abs(p[1]) / ay, z = abs(p[2]) / az;
  const Real across = power(x, 2 / e2) + power(y, 2 / e2);
  const Real outer = power(across, e2 / e1 - 1);
  return {outer * power(x, 2 / e2 - 1) / ax * (p[0] < 0 ? -1 : 1),
          outer * power(y, 2 / e2 - 1) / ay * (p[1] < 0 ? -1 : 1),
          power(z, 2 / e1 - 1) / az * (p[2] < 0 ? -1 : 1)};
}

}  // namespace sqmap::reference
