// SPDX-License-Identifier: Apache-2.0
//
// Layer 3 of Chart, the search for the nearest point of the represented surface: where it starts, its steps
// and the fans of vertices. The SIMD engine (walk.inl) follows it operation by operation and gives the same
// bits: change both. Part of chart.hpp, which includes it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "chart.hpp"
#include "triangle.hpp"

namespace sqmap::runtime {

inline Chart::Start Chart::start_at(const Vec3f& p, float row, float col,
                                    std::uint32_t stride) const noexcept {
  Start start{row, col, std::numeric_limits<float>::infinity()};
  const Cell cell = cell_at(row, col, stride);
  if (!cell.eligible) return start;
  const Vec3f error = p - patch_at(cell, row, col, stride).point;
  start.square = dot(error, error);
  return start;
}

inline Chart::Start Chart::start_beside(const Vec3f& p, float row, float col,
                                        std::uint32_t stride) const noexcept {
  const auto size = static_cast<float>(stride);
  const Cell middle = cell_at(row, col, stride);
  const float mid_row = static_cast<float>(middle.row) + size / 2,
              mid_col = static_cast<float>(middle.col) + size / 2;
  Start best;
  for (int ring = 0; ring < kRings && !std::isfinite(best.square); ++ring) {
    const auto step = static_cast<float>(stride << ring);
    for (int k = 0; k < 9; ++k) {
      if (k == 4) continue;  // the middle
      const int rows_up = k / 3 - 1;
      const float here_row = mid_row + static_cast<float>(rows_up) * step;
      const float here_col = wrapped(mid_col + static_cast<float>(k % 3 - 1) * step);
      if (!(here_row > 0 && here_row < static_cast<float>(part_.rows - 1) && here_col >= 0)) continue;
      const Start start = start_at(p, here_row, here_col, stride);
      if (start.square < best.square) best = start;
    }
  }
  return best;
}

inline Chart::Start Chart::start_named(const Vec3f& p, std::uint32_t stride) const noexcept {
  const Vec3f straight = part_.bend.straightened(p);
  Start best;
  for (int k = 0; k < StartTable::kAround; ++k) {
    const std::uint32_t name = resident_.start(part_, straight, k);
    if (name == StartTable::kNone) continue;
    const Start start = start_at(p, part_.starts.row(name), part_.starts.col(name), stride);
    if (start.square < best.square) best = start;
  }
  return best;
}

inline Chart::Start Chart::start_away(const Vec3f& p, float row, float col,
                                      std::uint32_t stride) const noexcept {
  const std::uint32_t name = resident_.start(part_, part_.bend.straightened(p), StartTable::kOwn);
  const float named_row = part_.starts.row(name), named_col = part_.starts.col(name);
  const float across = std::abs(col - named_col), reach = part_.starts.reach();
  const bool is_near =
      std::abs(row - named_row) <= reach && lesser(across, static_cast<float>(part_.cols) - across) <= reach;
  return is_near || name == StartTable::kNone ? Start{} : start_at(p, named_row, named_col, stride);
}

inline Chart::Step Chart::step_towards(const Patch& patch, const Vec3f& error,
                                       std::uint32_t stride) const noexcept {
  const float a = dot(patch.row, patch.row), b = dot(patch.row, patch.col), c = dot(patch.col, patch.col);
  const float f = dot(patch.row, error), g = dot(patch.col, error);
  const float product = a * c, determinant = product - b * b;
  const bool regular = determinant > kLeastAngle * product;
  const bool rows_only = !regular && a > 0;  // a pole: columns have no length
  const float inverse = 1.0F / (regular ? determinant : rows_only ? a : 1.0F);
  const float d_row = regular ? (c * f - b * g) * inverse : rows_only ? f * inverse : 0.0F;
  const float d_col = regular ? (a * g - b * f) * inverse : 0.0F;
  // Beside a pole, where columns are short, as far as the rows may go.
  const float most_row = kMostCells * static_cast<float>(stride);
  const float slimness =
      std::sqrt(a / greater(greater(c, kLeastAngle * a), std::numeric_limits<float>::min()));
  const float most_col = lesser(static_cast<float>(part_.cols) * 0.125F, most_row * greater(slimness, 1.0F));
  Step step{lesser(greater(d_row, -most_row), most_row), lesser(greater(d_col, -most_col), most_col), 0, {}};
  step.gain = f * step.row + g * step.col;
  step.way = step.row * patch.row + step.col * patch.col;
  return step;
}

inline void Chart::third_layer(const Vec3f& p, std::uint32_t stride, ChartAnswer& answer) const noexcept {
  const auto last_row = static_cast<float>(part_.rows - 1), turn = static_cast<float>(part_.cols);
  const auto size = static_cast<float>(stride);
  const float last_col = std::nextafter(turn, 0.0F);
  float row = answer.row, col = answer.col;
  Cell cell = cell_at(row, col, stride);
  Patch patch = patch_at(cell, row, col, stride);
  Vec3f error = p - patch.point, point = patch.point;
  float square = dot(error, error);
  bool on_rim = false;
  Step ahead = step_towards(patch, error, stride);
  // Always from the nearest place so far; a step that leads away from it is taken again, shorter.
  for (int step = 0; step < kThirdLayerSteps; ++step) {
    if (is_over(ahead, square)) break;
    float next_row = lesser(greater(row + ahead.row, 0.0F), last_row);
    float next_col = wrapped(col + ahead.col);
    Cell next = cell_at(next_row, next_col, stride);
    bool stays = !next.eligible;
    if (stays) {  // half the way, where that is another cell
      const float half_row = lesser(greater(row + 0.5F * ahead.row, 0.0F), last_row);
      const float half_col = wrapped(col + 0.5F * ahead.col);
      const Cell between = cell_at(half_row, half_col, stride);
      if (between.eligible && between.texel[0] != cell.texel[0]) {
        next = between;
        next_row = half_row;
        next_col = half_col;
        stays = false;
      }
    }
    if (stays) {  // on the rim of the patch
      const auto low_row = static_cast<float>(cell.row), low_col = static_cast<float>(cell.col);
      next = cell;
      next_row = lesser(greater(row + ahead.row, low_row), low_row + size);
      next_col = lesser(greater(col + ahead.col, low_col), low_col + size);
      if (std::abs(next_row - row) + std::abs(next_col - col) < kLeastCellStep) break;
      next_col = lesser(next_col, last_col);
    }
    patch = patch_at(next, next_row, next_col, stride);
    error = p - patch.point;
    if (dot(error, error) < square) {
      square = dot(error, error);
      point = patch.point;
      cell = next;
      row = next_row;
      col = next_col;
      on_rim = stays;
      ahead = step_towards(patch, error, stride);
    } else {
      ahead.row *= kBackStep;
      ahead.col *= kBackStep;
      ahead.gain *= kBackStep;
      ahead.way = kBackStep * ahead.way;
    }
  }
  // What is left of the way needs no look at the map.
  if (!on_rim && is_over(ahead, square)) {
    const Vec3f further = point + ahead.way;
    const Vec3f rest = p - further;
    if (dot(rest, rest) < square) {
      square = dot(rest, rest);
      point = further;
    }
  }
  answer.distance = std::sqrt(square);
  answer.surface = point;
  answer.faces_patch = !on_rim;
  answer.row = row;
  answer.col = col;
  answer.normal = patch_across(cell, row, col, stride);
  answer.refined = true;
  if (stride == 1) vertex_fan(p, cell, answer);
}

inline bool Chart::vertex_fan(const Vec3f& p, const Cell& cell, ChartAnswer& answer) const noexcept {
  const std::uint32_t position = resident_.find_fan(part_, cell.texel[0]);
  if (position >= part_.fans.count) return false;
  const std::uint32_t where = resident_.fan_place(part_, position);
  const auto low = static_cast<float>(cell.row), left = static_cast<float>(cell.col);
  const float top = low + 1.0F, right = left + 1.0F;
  const Vec3f apex = place(low + static_cast<float>(where & 255U) * (1 / 256.0F),
                           left + static_cast<float>(where >> 8U) * (1 / 256.0F),
                           part_.depth_of(resident_.fan_code(part_, position)));
  // Corners counter-clockwise seen from outside: rows grow upwards, columns to the right.
  const Vec3f corner[4] = {place(low, left, cell.depth[0]), place(low, right, cell.depth[1]),
                           place(top, right, cell.depth[3]), place(top, left, cell.depth[2])};
  float best_square = std::numeric_limits<float>::infinity();
  for (int k = 0; k < 4; ++k) {
    const Vec3f& a = corner[k];
    const Vec3f& b = corner[(k + 1) % 4];
    const Vec3f nearest = nearest_on_triangle(p, a, b, apex);
    const Vec3f d = p - nearest;
    const float square = dot(d, d);
    if (square < best_square) {
      best_square = square;
      answer.surface = nearest;
      answer.normal = cross(b - a, apex - a);
    }
  }
  answer.distance = std::sqrt(best_square);
  return true;
}

}  // namespace sqmap::runtime
