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
  for (auto* axis : {&block_x_m, &block_y_m, &block_z_m, &block_radius_m}) axis->resize(padded(block_count));
  for (std::size_t block = 0; block < block_count; ++block) bound(block);
}

void Cloud::refit(std::span<const Vec3f> places_m) {
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3f& p = places_m[source[i]];
    points_m[i] = p;
    x_m[i] = p.x;
    y_m[i] = p.y;
    z_m[i] = p.z;
  }
  for (auto* axis : {&x_m, &y_m, &z_m})  // a whole block is read, and bounded, where the last is not full
    std::fill(axis->begin() + static_cast<std::ptrdiff_t>(count), axis->end(),
              count == 0 ? 0.0F : (*axis)[count - 1]);
  for (std::size_t block = 0; block < block_count; ++block) bound(block);
}

void Cloud::bound(std::size_t block) {
  constexpr std::size_t kLanes = 8;  // one after the other they would wait for each other
  const std::vector<float>* const from[] = {&x_m, &y_m, &z_m};
  std::vector<float>* const to[] = {&block_x_m, &block_y_m, &block_z_m};
  const std::size_t begin = block * kBlock;
  float square_m2[kBlock] = {};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float* at = from[axis]->data() + begin;
    float low[kLanes], high[kLanes];
    for (std::size_t k = 0; k < kLanes; ++k) low[k] = high[k] = at[k];
    for (std::size_t i = kLanes; i < kBlock; i += kLanes)
      for (std::size_t k = 0; k < kLanes; ++k) {
        low[k] = at[i + k] < low[k] ? at[i + k] : low[k];
        high[k] = at[i + k] > high[k] ? at[i + k] : high[k];
      }
    const float centre_m =
        0.5F * (*std::min_element(low, low + kLanes) + *std::max_element(high, high + kLanes));
    (*to[axis])[block] = centre_m;
    for (std::size_t i = 0; i < kBlock; ++i) square_m2[i] += (at[i] - centre_m) * (at[i] - centre_m);
  }
  float most_m2[kLanes] = {};
  for (std::size_t i = 0; i < kBlock; i += kLanes)
    for (std::size_t k = 0; k < kLanes; ++k)
      most_m2[k] = square_m2[i + k] > most_m2[k] ? square_m2[i + k] : most_m2[k];
  block_radius_m[block] = std::sqrt(*std::max_element(most_m2, most_m2 + kLanes)) * 1.00001F;  // rounding
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
