// SPDX-License-Identifier: GPL-3.0-or-later
#include "near_bricks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace sqmap::bench {
namespace {

std::array<std::size_t, 3> brick_counts(const Field& field, std::uint32_t cells) {
  std::array<std::size_t, 3> counts{};
  for (std::size_t axis = 0; axis < 3; ++axis) counts[axis] = (field.nodes[axis] - 1 + cells - 1) / cells;
  return counts;
}

/// Square of the least way from one brick to another `apart` further, along one axis.
double square_of_gap(std::size_t apart) {
  const double between = apart > 1 ? static_cast<double>(apart - 1) : 0;
  return between * between;
}

}  // namespace

NearBricks::NearBricks(const Field& field, std::uint32_t cells, const std::vector<bool>& is_near) {
  const std::array<std::size_t, 3> count = brick_counts(field, cells);
  std::vector<double> square;
  square.reserve(is_near.size());
  for (const bool near : is_near) square.push_back(near ? 0 : std::numeric_limits<double>::infinity());
  // Squares of ways add up over the axes, so each has its turn.
  std::array<std::size_t, 3> stride{1, count[0], count[0] * count[1]};
  std::vector<double> line;
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t first = 0; first < square.size(); ++first) {
      if (first / stride[axis] % count[axis] != 0) continue;
      line.clear();
      for (std::size_t i = 0; i < count[axis]; ++i) line.push_back(square[first + i * stride[axis]]);
      for (std::size_t i = 0; i < count[axis]; ++i) {
        double least = std::numeric_limits<double>::infinity();
        for (std::size_t j = 0; j < count[axis]; ++j)
          least = std::min(least, line[j] + square_of_gap(i > j ? i - j : j - i));
        square[first + i * stride[axis]] = least;
      }
    }
  gap_.reserve(square.size() + 3);  // read as words
  for (const double s : square)
    gap_.push_back(static_cast<std::uint8_t>(std::min(std::floor(std::sqrt(s) / double{kGapStep}), 255.0)));
  gap_.resize(square.size() + 3);
  view_.brick_m = static_cast<float>(cells * field.spacing_m);
  for (int axis = 0; axis < 3; ++axis) {
    view_.bricks[axis] = static_cast<float>(count[static_cast<std::size_t>(axis)]);
    view_.origin_m[axis] = static_cast<float>(field.origin_m[axis]);
  }
  view_.row = static_cast<std::int32_t>(count[0]);
  view_.slab = static_cast<std::int32_t>(count[0] * count[1]);
}

NearView NearBricks::view() const noexcept {
  NearView view = view_;
  view.gap = gap_.data();
  return view;
}

std::vector<bool> bricks_within(const Field& field, std::uint32_t cells, double band_m) {
  const std::array<std::size_t, 3> count = brick_counts(field, cells);
  std::vector<bool> is_near;
  for (std::uint32_t z = 0; z < count[2]; ++z)
    for (std::uint32_t y = 0; y < count[1]; ++y)
      for (std::uint32_t x = 0; x < count[0]; ++x) {
        float least_m = std::numeric_limits<float>::infinity(), most_m = -least_m;
        for (std::uint32_t k = z * cells; k <= std::min((z + 1) * cells, field.nodes[2] - 1); ++k)
          for (std::uint32_t j = y * cells; j <= std::min((y + 1) * cells, field.nodes[1] - 1); ++j)
            for (std::uint32_t i = x * cells; i <= std::min((x + 1) * cells, field.nodes[0] - 1); ++i) {
              const float d = field.distance_m[field.index(i, j, k)];
              least_m = std::min(least_m, d);
              most_m = std::max(most_m, d);
            }
        is_near.push_back(least_m <= band_m && most_m >= -band_m);
      }
  return is_near;
}

}  // namespace sqmap::bench
