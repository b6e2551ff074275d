// SPDX-License-Identifier: GPL-3.0-or-later
#include "cloud.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace sqmap::bench {
namespace {

/// Splits at the median of the longest axis, in whole blocks, down to one block.
void sort_into_blocks(std::span<const Vec3d> points_m, std::span<std::uint32_t> order) {
  if (order.size() <= kBlock) return;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Vec3d low{kInfinity, kInfinity, kInfinity}, high = -low;
  for (const std::uint32_t i : order)
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], points_m[i][axis]);
      high[axis] = std::max(high[axis], points_m[i][axis]);
    }
  const Vec3d size = high - low;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const std::size_t blocks = (order.size() + kBlock - 1) / kBlock;
  const std::size_t middle = (blocks + 1) / 2 * kBlock;
  if (middle >= order.size()) return;
  std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(middle), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) {
                     const double pa = points_m[a][axis], pb = points_m[b][axis];
                     return pa != pb ? pa < pb : a < b;
                   });
  sort_into_blocks(points_m, order.first(middle));
  sort_into_blocks(points_m, order.subspan(middle));
}

std::size_t padded(std::size_t count) { return (count + kBlock - 1) / kBlock * kBlock + kPadding; }

}  // namespace

Cloud::Cloud(std::span<const Vec3d> input_m) : count(input_m.size()), source(input_m.size()) {
  std::iota(source.begin(), source.end(), 0U);
  sort_into_blocks(input_m, source);
  points_m.reserve(count);
  for (const std::uint32_t i : source) points_m.push_back(cast<float>(input_m[i]));
  const Vec3f last = points_m.empty() ? Vec3f{} : points_m.back();
  for (auto* axis : {&x_m, &y_m, &z_m}) axis->reserve(padded(count));
  for (std::size_t i = 0; i < padded(count); ++i) {
    const Vec3f& p = i < count ? points_m[i] : last;
    x_m.push_back(p.x);
    y_m.push_back(p.y);
    z_m.push_back(p.z);
  }
  block_count = (count + kBlock - 1) / kBlock;
  for (std::size_t block = 0; block < block_count; ++block) {
    const std::size_t begin = block * kBlock, end = std::min(begin + kBlock, count);
    Vec3d low = cast<double>(points_m[begin]), high = low;
    for (std::size_t i = begin; i < end; ++i)
      for (int axis = 0; axis < 3; ++axis) {
        low[axis] = std::min<double>(low[axis], points_m[i][axis]);
        high[axis] = std::max<double>(high[axis], points_m[i][axis]);
      }
    const Vec3d centre = 0.5 * (low + high);
    double radius = 0;
    for (std::size_t i = begin; i < end; ++i)
      radius = std::max(radius, norm(cast<double>(points_m[i]) - centre));
    block_x_m.push_back(static_cast<float>(centre.x));
    block_y_m.push_back(static_cast<float>(centre.y));
    block_z_m.push_back(static_cast<float>(centre.z));
    block_radius_m.push_back(static_cast<float>(radius * 1.00001));  // rounding of the centre
  }
  for (auto* axis : {&block_x_m, &block_y_m, &block_z_m, &block_radius_m})
    axis->resize(padded(block_count), axis->empty() ? 0.0F : axis->back());
}

Hits::Hits(std::size_t points) : point(padded(points)) {
  for (auto* values : {&distance_m, &normal_x, &normal_y, &normal_z, &force_x_n, &force_y_n, &force_z_n})
    values->resize(padded(points));
}

void Hits::add(std::size_t index, float distance, const Vec3f& normal) noexcept {
  point[count] = static_cast<std::uint32_t>(index);
  distance_m[count] = distance;
  normal_x[count] = normal.x;
  normal_y[count] = normal.y;
  normal_z[count] = normal.z;
  const float pressure = kStiffness_n_per_m * std::max(0.0F, -distance);
  force_x_n[count] = pressure * normal.x;
  force_y_n[count] = pressure * normal.y;
  force_z_n[count] = pressure * normal.z;
  ++count;
}

}  // namespace sqmap::bench
