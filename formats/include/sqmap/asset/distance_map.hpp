// SPDX-License-Identifier: Apache-2.0
//
// Index convention of a map with rows = 5, cols = 8 (row = eta, col = omega, row-major; FORMAT.md section 3):
//
//     row 4   eta = +pi/2   o o o o o o o o     the pole: one surface point, stored once a column
//     row 3                 o o o o o o o o
//     row 2   eta = 0       o o o o o o o o     the equator
//     row 1                 o o o o o o o o
//     row 0   eta = -pi/2   o o o o o o o o
//                           |   |   |   |
//                  omega = -pi -pi/2 0 +pi/2      columns wrap: column 8 is column 0
//
// Nodes lie at equal arc lengths within each quadrant, so the planes of symmetry always fall on rows and
// columns. Level l of the pyramid is every 2^l-th row and column of the same array: a coarse level costs no
// byte.
#pragma once

#include <cstdint>
#include <vector>

namespace sqmap {

/// Distance map of one part: for each node of a grid on its superquadric, the distances along the inward
/// normal at which the ray enters or leaves the material of the *whole* mesh.
struct DistanceMap {
  /// A second or later crossing of the ray of one texel.
  struct Crossing {
    std::uint32_t texel;  ///< row * cols + col
    std::uint16_t code;   ///< depth code, as `code`
    friend bool operator==(const Crossing&, const Crossing&) = default;
  };
  /// A mesh vertex projected into a cell (the paper's Step 3), kept where the four corners alone miss it.
  struct VertexSample {
    std::uint32_t cell;       ///< row * cols + col of the cell's lowest corner; row in [0, rows - 1)
    std::uint8_t row_256ths;  ///< position inside the cell along the rows, in 1/256 of a cell
    std::uint8_t col_256ths;  ///< the same along the columns
    std::uint16_t code;       ///< depth code of the vertex, as `code`
    friend bool operator==(const VertexSample&, const VertexSample&) = default;
  };

  std::uint32_t rows{};         ///< nodes along eta; rows - 1 is a multiple of 2 * 2^(level_count - 1)
  std::uint32_t cols{};         ///< nodes along omega; a multiple of 4 * 2^(level_count - 1)
  std::uint32_t level_count{};  ///< pyramid levels, 0 the finest
  std::uint32_t bits{};         ///< significant bits of a code, in [4, 16]
  double depth_min_m{};         ///< depth of code 0 [m], >= 0
  double depth_step_m{};        ///< depth of one code step [m], >= 0

  /// First crossing of each texel's ray, shape [rows, cols]: depth = depth_min_m + code * depth_step_m, or
  /// miss_code() where the ray crosses nothing that a query can reach.
  std::vector<std::uint16_t> code;
  /// One bit a texel, least significant first, shape [(rows * cols + 7) / 8]: the texel's surface point lies
  /// inside the mesh (a seam, covered by a neighbour's superquadric). Empty: no texel does.
  std::vector<std::uint8_t> start_inside;
  std::vector<Crossing> crossings;           ///< ascending by (texel, code); codes above the texel's first
  std::vector<VertexSample> vertex_samples;  ///< ascending by cell, at most one a cell

  std::uint16_t miss_code() const noexcept { return static_cast<std::uint16_t>((1U << bits) - 1U); }
  /// Depth of a code other than miss_code() [m].
  double depth_m(std::uint16_t depth_code) const noexcept { return depth_min_m + depth_code * depth_step_m; }
  bool starts_inside(std::uint32_t texel) const noexcept {
    return !start_inside.empty() && ((start_inside[texel / 8] >> (texel % 8)) & 1U) != 0;
  }
  friend bool operator==(const DistanceMap&, const DistanceMap&) = default;
};

}  // namespace sqmap
