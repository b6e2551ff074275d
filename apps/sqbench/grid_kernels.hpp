// SPDX-License-Identifier: GPL-3.0-or-later
//
// The inner loops of the grids, vectorised with run-time dispatch to the best instruction set of the machine.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "cloud.hpp"

namespace sqmap::bench {

/// A dense grid as its kernel reads it.
struct DenseView {
  const float* distance_m;   ///< or null
  const std::int16_t* code;  ///< or null
  float step_m;              ///< of one code
  float spacing_m;
  float nodes[3];
  std::int32_t row, slab;
  float origin_m[3];
  float band_m;
  float far_error_m;  ///< what blocks are culled with, as the values beyond the band are not exact
};

/// Which bricks of a lattice hold anything within the band, for leaving out whole blocks of points.
struct NearView {
  const std::uint8_t*
      gap;        ///< by place: how far every point of the brick is from those, at least, in kGapStep
  float brick_m;  ///< edge of a brick
  float bricks[3];
  std::int32_t row, slab;
  float origin_m[3];
};
inline constexpr float kGapStep = 0.125F;  ///< of a brick

struct BrickView {
  const std::int32_t* brick;    ///< by place: byte offset of the brick's record, negative: nothing near
  const std::uint8_t* records;  ///< per brick: least distance and step as float, then 5^3 codes
  float spacing_m;
  float cells[3];
  std::int32_t row, slab;  ///< of `brick`
  float origin_m[3];
  float band_m;
  NearView near;
};
inline constexpr int kBrickCells = 4;
inline constexpr int kBrickNodes = kBrickCells + 1;
inline constexpr int kBrickHeader = 8;    ///< bytes
inline constexpr int kBrickRecord = 136;  ///< bytes, codes padded to whole words

void answer_dense_float(const DenseView& grid, const Cloud& cloud, const Placement& placement, Hits& hits);
void answer_dense_int16(const DenseView& grid, const Cloud& cloud, const Placement& placement, Hits& hits);
/// The same, and blocks of points are left out where the grid at their centre tells that no point is near.
void answer_dense_int16_culled(const DenseView& grid, const Cloud& cloud, const Placement& placement,
                               Hits& hits);
/// Indices of the blocks that may reach a brick that holds anything, to `blocks`, which has room for all and
/// a vector more; returns how many.
std::size_t find_near_blocks(const NearView& view, const Cloud& cloud, const Placement& placement,
                             std::vector<std::uint32_t>& blocks);
/// `blocks`: to work in.
void answer_bricks(const BrickView& grid, const Cloud& cloud, const Placement& placement,
                   std::vector<std::uint32_t>& blocks, Hits& hits);

/// The instruction set that the kernels run on, as Highway names it.
const char* instruction_set();

}  // namespace sqmap::bench
