// SPDX-License-Identifier: Apache-2.0
//
// sqmap/asset/bend.hpp for queries: from operations that IEEE 754 rounds exactly, so that answers are the
// same on every machine. bends.inl holds the same lines for vectors.
#pragma once

#include <cmath>
#include <limits>

#include "sqmap/asset/bend.hpp"
#include "sqmap/asset/shape_table.hpp"

namespace sqmap::runtime {

/// sin h / h and cos h in powers of h^2, |h| <= 1.11; atan u / u in powers of u^2, |u| <= 0.6181. Errors
/// below 2e-7 of the value, fitted at Chebyshev nodes.
inline constexpr float kSineSeries[5] = {1.0F, -0.1666666567325592F, 0.008333297446370125F,
                                         -0.00019833093392662704F, 2.6795626126840943e-06F};
inline constexpr float kCosineSeries[5] = {1.0F, -0.4999999403953552F, 0.04166627302765846F,
                                           -0.0013879924081265926F, 2.3965705622686073e-05F};
inline constexpr float kArctangentSeries[7] = {1.0F,
                                               -0.33333250880241394F,
                                               0.1999639868736267F,
                                               -0.14226514101028442F,
                                               0.10636486858129501F,
                                               -0.07041209936141968F,
                                               0.027697760611772537F};
/// No superquadric turns by more; what its map may represent beyond its ends is bent no farther.
inline constexpr float kMostHalfTurn = 1.11F;
template <int kCount>
float series_of(const float (&coefficient)[kCount], float square) noexcept {
  float sum = coefficient[kCount - 1];
  for (int k = kCount - 2; k >= 0; --k) sum = coefficient[k] + square * sum;
  return sum;
}

/// Bend<float> with what queries need of it; lengths in units of Resident::unit_m.
struct PartBend {
  float curvature{};  ///< k; 0: straight
  float x{}, y{};     ///< cos alpha, sin alpha

  bool is_none() const noexcept { return curvature == 0; }
  float radius() const noexcept { return 1.0F / curvature; }

  static PartBend of(const Superquadric& shape, double units_per_m) noexcept {
    if (shape.bend.is_none()) return {};
    const double k = shape.bend.curvature();
    return {static_cast<float>(k / units_per_m), static_cast<float>(shape.bend.x / k),
            static_cast<float>(shape.bend.y / k)};
  }

  /// straightened() of bend.hpp.
  Vec3f straightened(const Vec3f& p) const noexcept {
    if (is_none()) return p;
    const float c = 1.0F - curvature * (x * p.x + y * p.y), w = curvature * p.z;
    const float sum = std::sqrt(c * c + w * w) + c;
    constexpr float kMost{kMostBendTangent};
    const float size = std::abs(w);
    const bool is_near = size < kMost * sum && sum <= std::numeric_limits<float>::max();
    const float t = is_near ? size / sum : kMost;
    const float u = t / (1.0F + std::sqrt(1.0F + t * t));
    const float angle = (4.0F * u) * series_of(kArctangentSeries, u * u);
    const float lean = std::abs(p.z) * t;
    return {p.x - x * lean, p.y - y * lean, std::copysign(radius() * angle, p.z)};
  }

  /// The turn of the axis at one place of the straight frame.
  struct Turn {
    float sine, versine, stretch;
  };
  Turn turn_at(const Vec3f& straight) const noexcept {
    const float half = lesser(greater((0.5F * curvature) * straight.z, -kMostHalfTurn), kMostHalfTurn);
    const float square = half * half;
    const float s = half * series_of(kSineSeries, square), c = series_of(kCosineSeries, square);
    return {(s + s) * c, (s + s) * s, 1.0F - curvature * (x * straight.x + y * straight.y)};
  }
  /// bent() of bend.hpp.
  Vec3f point(const Turn& turn, const Vec3f& straight) const noexcept {
    const float reach = turn.stretch * radius(), lean = turn.versine * reach;
    return {straight.x + x * lean, straight.y + y * lean, turn.sine * reach};
  }
  /// Of a step in the straight frame, that in the part frame.
  Vec3f step(const Turn& turn, const Vec3f& v) const noexcept {
    const float across = x * v.x + y * v.y, along = turn.stretch * v.z;
    const float lean = turn.sine * along - turn.versine * across;
    return {v.x + x * lean, v.y + y * lean, (1.0F - turn.versine) * along - turn.sine * across};
  }
  /// turned() of bend.hpp.
  Vec3f gradient(const Turn& turn, const Vec3f& v) const noexcept {
    const float across = x * v.x + y * v.y, along = v.z / turn.stretch;
    const float lean = turn.sine * along - turn.versine * across;
    return {v.x + x * lean, v.y + y * lean, (1.0F - turn.versine) * along - turn.sine * across};
  }
};

}  // namespace sqmap::runtime
