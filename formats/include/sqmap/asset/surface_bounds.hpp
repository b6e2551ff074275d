// SPDX-License-Identifier: Apache-2.0
//
// Cells of one of the six faces of a part's box, cells = 4, seen from outside along -axis (FORMAT.md 3.1).
// The pyramid from the part's centre through a cell is what the cell's bounds speak of.
//
//     v = +1   12 13 14 15         face 2 axis + (q[axis] < 0), axis = that of the largest |q|
//               8  9 10 11         u, v = q[axis + 1], q[axis + 2] over |q[axis]|, axes counted in a circle
//               4  5  6  7
//     v = -1    0  1  2  3
//           u = -1        u = +1
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "sqmap/asset/vec.hpp"

namespace sqmap {

/// Where the surface of the mesh cannot be, in the pyramid of one cell. Heights are codes of bound_height.
struct BoundCell {
  static constexpr std::uint8_t kLevel = 128;  ///< a tilt of nothing
  static constexpr std::uint8_t kNone = 255;

  std::uint8_t tilt_u{kLevel}, tilt_v{kLevel};  ///< of the planes of equal height, (tilt - 128) / 256
  std::uint8_t outer{kNone};  ///< no surface from this height outwards; kNone: nothing is known of it
  std::uint8_t upper{0}, lower{kNone};  ///< nor from `lower` to `upper`; where lower > upper, unknown
  std::uint8_t sides{};  ///< bit 0: inside the mesh from `outer` outwards; bit 1: between lower and upper
  friend bool operator==(const BoundCell&, const BoundCell&) = default;
};

/// Bounds of the surface within one superquadric: what may be called surely inside or surely outside.
struct SurfaceBounds {
  static constexpr std::uint32_t kMostCells = 64;

  std::uint32_t cells{};        ///< a side of each face; 0: there are no bounds
  double tolerance_m{};         ///< nothing deeper than this beyond the surface is called wrong [m]
  std::vector<BoundCell> cell;  ///< shape [6, cells, cells]: face, v, u
  friend bool operator==(const SurfaceBounds&, const SurfaceBounds&) = default;
};

/// Height code of the box's faces; the centre has 0.
inline constexpr int kBoundSteps = 240;

/// Where a point lies among the cells.
template <class T>
struct BoundPlace {
  std::uint32_t cell{};
  T u{}, v{};  ///< from the middle of the cell, [-1, 1]
  T height{};  ///< that of |q| in the largest of its coordinates, in codes; not tilted
};

/// The cell of q, a point of the part frame over the semi-axes. Any finite q; cells >= 1.
template <class T>
BoundPlace<T> bound_place(const Vec3<T>& q, std::uint32_t cells) noexcept {
  using std::abs;
  const T x = abs(q.x), y = abs(q.y), z = abs(q.z);
  const int axis = x >= y ? (x >= z ? 0 : 2) : (y >= z ? 1 : 2);
  const T along = q[axis], reach = abs(along);
  if (!(reach > T(0))) return {};  // the centre, where all cells meet; also NaN
  const T half = T(0.5) * T(cells);
  const auto place = [&](T across, T& middle_off) {
    const T at = (across / reach + T(1)) * half;
    const std::uint32_t index = std::min(static_cast<std::uint32_t>(at), cells - 1);
    middle_off = T(2) * (at - T(index)) - T(1);
    return index;
  };
  BoundPlace<T> out;
  const std::uint32_t col = place(q[(axis + 1) % 3], out.u), row = place(q[(axis + 2) % 3], out.v);
  const std::uint32_t face = 2 * static_cast<std::uint32_t>(axis) + (along < T(0) ? 1U : 0U);
  out.cell = (face * cells + row) * cells + col;
  out.height = T(kBoundSteps) * reach;
  return out;
}

/// A tilt as a number in [-1/2, 1/2).
template <class T>
T bound_tilt(std::uint8_t code) noexcept {
  return (T(code) - T(BoundCell::kLevel)) * T(1.0 / 256);
}

/// Height of a place over the cell's tilted planes: linear in q within a cell, so that between two heights
/// lies a convex piece of the cell's pyramid.
template <class T>
T bound_height(const BoundCell& cell, const BoundPlace<T>& at) noexcept {
  return at.height * (T(1) + bound_tilt<T>(cell.tilt_u) * at.u + bound_tilt<T>(cell.tilt_v) * at.v);
}

}  // namespace sqmap
