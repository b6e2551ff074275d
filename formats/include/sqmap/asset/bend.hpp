// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "sqmap/asset/vec.hpp"

namespace sqmap {

/// Bending of a part's z axis into a circular arc (paper eq. (2); Solina and Bajcsy 1990), as the curvature k
/// of the axis times the direction (cos alpha, sin alpha) in which it leans [1/m]. FORMAT.md (S9).
///
/// What lies in the *straight frame* at (x, y, z), there at r = x cos alpha + y sin alpha, lies in the part
/// frame on the same circle around the line r = 1/k, z = 0, turned by the angle k z. Lengths across the axis
/// stay; those along it become lambda = 1 - k r times as long; volumes do, too.
template <class T>
struct Bend {
  T x{0}, y{0};
  bool is_none() const noexcept { return x == T(0) && y == T(0); }
  T curvature() const noexcept { return std::hypot(x, y); }
  /// lambda at a place of the straight frame.
  T stretch(const Vec3<T>& straight) const noexcept { return T(1) - (x * straight.x + y * straight.y); }
  friend bool operator==(const Bend&, const Bend&) = default;
};

/// The farthest that a superquadric's axis may turn to either side [rad], and how near, as a share of the
/// radius of its arc, it may come to the middle of that: the bend then maps it one to one, and nowhere
/// shortens more than five times.
inline constexpr double kMostBendTurn = 2.0;
inline constexpr double kMostBendReach = 0.8;
/// Below this turn [rad] a part counts as straight.
inline constexpr double kLeastBendTurn = 1e-3;

/// The tangent of half the angle by which a point of the part frame is turned is limited to this, beyond
/// which, at 2.21 rad, no superquadric reaches.
inline constexpr double kMostBendTangent = 2.0;

/// The point of the part frame that lies at `q` in the straight frame.
template <class T>
Vec3<T> bent(const Bend<T>& bend, const Vec3<T>& q) noexcept {
  if (bend.is_none()) return q;
  using std::cos;
  using std::sin;
  const T k = bend.curvature(), half = k * q.z / T(2);
  const T s = sin(half), reach = bend.stretch(q) / k;
  const T lean = T(2) * s * s * reach / k;  // times the bend: (1 - cos) lambda / k along it
  return {q.x + bend.x * lean, q.y + bend.y * lean, T(2) * s * cos(half) * reach};
}

/// The place in the straight frame of a point `p` of the part frame. Of a point beyond all superquadrics, on
/// the far side of the arc's middle, it is one outside of them.
template <class T>
Vec3<T> straightened(const Bend<T>& bend, const Vec3<T>& p) noexcept {
  if (bend.is_none()) return p;
  using std::atan;
  using std::sqrt;
  const T k = bend.curvature(), c = bend.stretch(p), w = k * p.z;
  const T radius = sqrt(c * c + w * w);  // over that of the arc: lambda
  const T sum = radius + c, most = T(kMostBendTangent);
  const bool is_near = std::abs(w) < most * sum && sum <= std::numeric_limits<T>::max();
  const T t = is_near ? w / sum : std::copysign(most, w);
  const T lean = p.z * t / k;
  return {p.x - bend.x * lean, p.y - bend.y * lean, T(2) * atan(t) / k};
}

/// A gradient at `q` in the straight frame, such as a normal, as seen in the part frame; of another length.
/// At the middle of the arc, where there is none, it is finite.
template <class T>
Vec3<T> turned(const Bend<T>& bend, const Vec3<T>& q, const Vec3<T>& gradient) noexcept {
  if (bend.is_none()) return gradient;
  using std::cos;
  using std::sin;
  const T k = bend.curvature(), half = k * q.z / T(2);
  const T s = sin(half), c = cos(half), sine = T(2) * s * c;
  const T along = (bend.x * gradient.x + bend.y * gradient.y) / k,
          up = gradient.z / std::max(bend.stretch(q), T(1e-6));
  const T lean = (sine * up - T(2) * s * s * along) / k;
  return {gradient.x + bend.x * lean, gradient.y + bend.y * lean, (T(1) - T(2) * s * s) * up - sine * along};
}

}  // namespace sqmap
