// SPDX-License-Identifier: Apache-2.0
//
// Distances to superquadrics by search over their surface: no line in common with formats or libruntime.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "sqmap/asset/superquadric.hpp"

namespace sqmap::reference {

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
