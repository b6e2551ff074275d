// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "sqmap/asset/superquadric.hpp"

namespace sqmap {

/// Nodes of one quadrant of a superellipse at equal arc lengths, FORMAT.md (S6).
///
/// The curve is (alpha c(theta) (1 + taper s(theta)), beta s(theta)), theta from 0 to pi/2 the polar angle of
/// the unit superellipse. Node 0 is exactly (1, 0), node `cells` exactly (0, 1). Deterministic; cost is a
/// fixed number of evaluations.
///
/// @param alpha,beta  semi-axes [m], > 0
/// @param e           exponent of the curve
/// @param cells       arcs of equal length, >= 1
/// @param taper       of a meridian, on the side of +s; above -1
/// @return            cells + 1 points of the unit superellipse, without the taper
std::vector<SuperellipsePoint<double>> quadrant_nodes(double alpha_m, double beta_m, double e,
                                                      std::uint32_t cells, double taper = 0);

/// Where the nodes of a distance map lie on its superquadric, and where their rays point. Part frame.
///
/// Rows follow the meridian superellipse with semi-axes (sqrt(a1 a2), a3), exponent e1 and the taper, columns
/// the equator with (a1, a2) and e2, each at equal arc lengths (in place of the paper's eq. (9), whose
/// spacing ignores the axes).
class MapGrid {
 public:
  /// rows - 1 must be a positive multiple of 2, cols a positive multiple of 4.
  MapGrid(const Superquadric& shape, std::uint32_t rows, std::uint32_t cols);

  std::uint32_t rows() const noexcept { return rows_; }
  std::uint32_t cols() const noexcept { return cols_; }
  /// Superellipse point of a row, eta from -pi/2 (row 0) to +pi/2.
  SuperellipsePoint<double> eta(std::uint32_t row) const noexcept;
  /// Superellipse point of a column, omega from -pi (column 0) up to, not including, +pi.
  SuperellipsePoint<double> omega(std::uint32_t col) const noexcept;
  /// Surface point r of a node [m], part frame as the normal.
  Vec3d point(std::uint32_t row, std::uint32_t col) const noexcept {
    return surface_point(shape_, eta(row), omega(col));
  }
  /// Outward unit normal n of a node. The node's ray runs along -n; the represented surface is r - D n (eq.
  /// 22).
  Vec3d normal(std::uint32_t row, std::uint32_t col) const noexcept {
    return surface_normal(shape_, eta(row), omega(col));
  }

 private:
  Superquadric shape_;
  std::uint32_t rows_, cols_;
  // Of one quadrant, from the equator (or omega = 0) on; below the equator only where a taper tells them
  // apart.
  std::vector<SuperellipsePoint<double>> eta_, eta_below_, omega_;
};

}  // namespace sqmap
