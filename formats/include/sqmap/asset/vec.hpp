// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>

namespace sqmap {

/// Three coordinates of one scalar type. Frame and unit are those of the variable that holds it.
template <class T>
struct Vec3 {
  T x{}, y{}, z{};

  T& operator[](int axis) noexcept { return axis == 0 ? x : axis == 1 ? y : z; }
  const T& operator[](int axis) const noexcept { return axis == 0 ? x : axis == 1 ? y : z; }
  friend bool operator==(const Vec3&, const Vec3&) = default;
};

using Vec3d = Vec3<double>;
using Vec3f = Vec3<float>;

template <class T>
Vec3<T> operator+(const Vec3<T>& a, const Vec3<T>& b) noexcept {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class T>
Vec3<T> operator-(const Vec3<T>& a, const Vec3<T>& b) noexcept {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class T>
Vec3<T> operator-(const Vec3<T>& a) noexcept {
  return {-a.x, -a.y, -a.z};
}
template <class T>
Vec3<T> operator*(const T& s, const Vec3<T>& a) noexcept {
  return {s * a.x, s * a.y, s * a.z};
}
template <class T>
Vec3<T> operator*(const Vec3<T>& a, const T& s) noexcept {
  return s * a;
}
template <class T>
T dot(const Vec3<T>& a, const Vec3<T>& b) noexcept {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
Vec3<T> cross(const Vec3<T>& a, const Vec3<T>& b) noexcept {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class T>
T norm(const Vec3<T>& a) noexcept {
  using std::sqrt;
  return sqrt(dot(a, a));
}
/// a / |a|, or (0, 0, 0) where |a| is zero or not a number.
template <class T>
Vec3<T> normalized(const Vec3<T>& a) noexcept {
  const T length = norm(a);
  return length > T(0) ? (T(1) / length) * a : Vec3<T>{};  // NaN: zero vector
}
template <class To, class From>
Vec3<To> cast(const Vec3<From>& a) noexcept {
  return {static_cast<To>(a.x), static_cast<To>(a.y), static_cast<To>(a.z)};
}

/// Unit quaternion w + xi + yj + zk, Hamilton convention.
struct Quaternion {
  double w{1}, x{}, y{}, z{};
  friend bool operator==(const Quaternion&, const Quaternion&) = default;
};

/// Rotation matrix by rows; rotates a column vector.
template <class T>
struct Rotation {
  std::array<Vec3<T>, 3> row{Vec3<T>{1, 0, 0}, Vec3<T>{0, 1, 0}, Vec3<T>{0, 0, 1}};

  Vec3<T> apply(const Vec3<T>& v) const noexcept { return {dot(row[0], v), dot(row[1], v), dot(row[2], v)}; }
  Vec3<T> apply_inverse(const Vec3<T>& v) const noexcept {
    return v.x * row[0] + v.y * row[1] + v.z * row[2];
  }
};

/// The rotation of a quaternion. The quaternion need not be exactly of unit length: it is normalised here, so
/// that every reader of a bundle gets the same rotation.
template <class T = double>
Rotation<T> rotation(const Quaternion& q) noexcept {
  const double n = q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z;
  const double s = n > 0 ? 2 / n : 0;
  const double xx = s * q.x * q.x, yy = s * q.y * q.y, zz = s * q.z * q.z;
  const double xy = s * q.x * q.y, xz = s * q.x * q.z, yz = s * q.y * q.z;
  const double wx = s * q.w * q.x, wy = s * q.w * q.y, wz = s * q.w * q.z;
  return {{Vec3<T>{T(1 - yy - zz), T(xy - wz), T(xz + wy)}, Vec3<T>{T(xy + wz), T(1 - xx - zz), T(yz - wx)},
           Vec3<T>{T(xz - wy), T(yz + wx), T(1 - xx - yy)}}};
}

/// Rigid transform: p_to = rotation(orientation) * p_from + translation_m.
struct Pose {
  Quaternion orientation;
  Vec3d translation_m;
  friend bool operator==(const Pose&, const Pose&) = default;
};

/// A ball, in the frame its user names.
struct BoundingSphere {
  Vec3d centre_m;
  double radius_m{};
  friend bool operator==(const BoundingSphere&, const BoundingSphere&) = default;
};

}  // namespace sqmap
