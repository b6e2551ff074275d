// SPDX-License-Identifier: Apache-2.0
//
// Superquadrics in 50 decimal digits, from the paper's eq. (1) as Barr printed it and from a search over the
// surface: no line in common with formats or libruntime.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <boost/multiprecision/cpp_bin_float.hpp>

#include "sqmap/asset/superquadric.hpp"

namespace sqmap::reference {

using Real = boost::multiprecision::cpp_bin_float_50;
using Point = std::array<Real, 3>;

inline Real power(const Real& base, const Real& exponent) {
  return base == 0 ? Real(0) : boost::multiprecision::pow(base, exponent);
}

/// The root of F(x, y, z): 1 on the surface, and t times as large t times as far from the centre.
template <class T, class P>
Real radial(const SuperquadricOf<T>& sq, const P& p) {
  const Real e1(sq.e1), e2(sq.e2);
  const auto term = [](const Real& length, const Real& axis, const Real& exponent) {
    return power(abs(length) / axis, exponent);
  };
  const Real across =
      term(Real(p[0]), Real(sq.semi_axes_m.x), 2 / e2) + term(Real(p[1]), Real(sq.semi_axes_m.y), 2 / e2);
  return power(power(across, e2 / e1) + term(Real(p[2]), Real(sq.semi_axes_m.z), 2 / e1), e1 / 2);
}

/// The gradient of F, not normalised; needs x, y and z other than 0.
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

/// Distance from a point to the surface, by search: a grid over one octant, then windows that shrink round
/// each of the best nodes. Double is enough: the squares are sums of positive terms.
class SurfaceSearch {
 public:
  explicit SurfaceSearch(const Superquadric& sq) : sq_(sq) {}

  double distance_m(const Vec3d& p) const {
    const Vec3d m{std::abs(p.x), std::abs(p.y), std::abs(p.z)};
    constexpr int kNodes = 48;
    std::vector<Place> best = scan(m, 0, 1, 0, 1, kNodes);
    constexpr std::size_t kStarts = 4;
    std::partial_sort(best.begin(), best.begin() + kStarts, best.end());
    double least = best.front().square;
    for (std::size_t k = 0; k < kStarts; ++k) {
      Place here = best[k];
      for (double reach = 1.5 / kNodes; reach > 1e-11; reach *= 0.5) {
        for (const Place& there : scan(m, here.u - reach, here.u + reach, here.v - reach, here.v + reach, 8))
          here = std::min(here, there);
      }
      least = std::min(least, here.square);
    }
    return std::sqrt(least);
  }

 private:
  // (c, s) with |c|^(2/e) + |s|^(2/e) = 1, evenly spread over the two legs of the curve: the share of the
  // lesser coordinate, not an angle, so that corners of squarish curves and tips of pointed ones are both
  // reached.
  static std::pair<double, double> on_curve(double share, double e) {
    const double least_at_corner = std::pow(0.5, e / 2);
    if (share <= 0.5) {
      const double s = 2 * share * least_at_corner;
      return {std::pow(1 - std::pow(s, 2 / e), e / 2), s};
    }
    const double c = 2 * (1 - share) * least_at_corner;
    return {c, std::pow(1 - std::pow(c, 2 / e), e / 2)};
  }

  struct Place {
    double u, v, square;  ///< shares of a quarter turn in eta and omega; squared distance there [m^2]
    friend bool operator<(const Place& a, const Place& b) { return a.square < b.square; }
  };
  std::vector<Place> scan(const Vec3d& m, double u_from, double u_to, double v_from, double v_to,
                          int steps) const {
    const auto share = [&](double from, double to, int k) {
      return std::clamp(from + (to - from) * k / steps, 0.0, 1.0);
    };
    std::vector<std::pair<double, double>> omega;
    for (int j = 0; j <= steps; ++j) omega.push_back(on_curve(share(v_from, v_to, j), sq_.e2));
    std::vector<Place> places;
    for (int i = 0; i <= steps; ++i) {
      const double u = share(u_from, u_to, i);
      const auto [c1, s1] = on_curve(u, sq_.e1);
      for (int j = 0; j <= steps; ++j) {
        const auto [c2, s2] = omega[static_cast<std::size_t>(j)];
        const Vec3d d =
            Vec3d{sq_.semi_axes_m.x * c1 * c2, sq_.semi_axes_m.y * c1 * s2, sq_.semi_axes_m.z * s1} - m;
        places.push_back({u, share(v_from, v_to, j), dot(d, d)});
      }
    }
    return places;
  }

  Superquadric sq_;
};

}  // namespace sqmap::reference
