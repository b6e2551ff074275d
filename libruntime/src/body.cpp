// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/body.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>

#include "body_data.hpp"
#include "combine.hpp"

namespace sqmap::runtime {

namespace {

// Radii are enlarged by this share, so that rounding leaves no point outside its ball.
constexpr float kSlack = 1e-6F;

struct Ball {
  Vec3f centre;
  float radius = 0;
};

/// The ball around the box of points [begin, end), none of them outside.
Ball ball_around(const PointBody::Data& data, std::uint32_t begin, std::uint32_t end) noexcept {
  const float* axes[3] = {data.axis(0), data.axis(1), data.axis(2)};
  Ball ball;
  for (int k = 0; k < 3; ++k) {
    const auto [least, most] = std::minmax_element(axes[k] + begin, axes[k] + end);
    ball.centre[k] = 0.5F * *least + 0.5F * *most;
  }
  float square = 0;
  for (std::uint32_t i = begin; i < end; ++i) {
    const Vec3f d = Vec3f{axes[0][i], axes[1][i], axes[2][i]} - ball.centre;
    square = std::max(square, dot(d, d));
  }
  ball.radius = std::sqrt(square) * (1 + kSlack);
  return ball;
}

/// Puts the points in their places, and balls around them.
void settle(PointBody::Data& data, std::span<const Vec3f> points_m) noexcept {
  for (std::uint32_t i = 0; i < data.padded_points; ++i) {
    const Vec3f& p = points_m[data.index[i]];
    data.axis(0)[i] = p.x;
    data.axis(1)[i] = p.y;
    data.axis(2)[i] = p.z;
  }
  for (std::uint32_t block = 0; block < data.block_count(); ++block) {
    const Ball ball = ball_around(data, block * kBlockPoints, (block + 1) * kBlockPoints);
    for (int k = 0; k < 3; ++k) data.ball(k)[block] = ball.centre[k];
    data.ball(3)[block] = ball.radius;
  }
  const Ball all = data.point_count > 0 ? ball_around(data, 0, data.point_count) : Ball{};
  data.centre_m = all.centre;
  data.radius_m = all.radius;
}

/// Splits [begin, end) of order at the longest side of its box, at whole blocks, down to blocks. Depth is the
/// logarithm of the number of blocks.
void split(std::span<const Vec3f> points, std::span<std::uint32_t> order) {
  if (order.size() <= kBlockPoints) {
    std::sort(order.begin(), order.end());
    return;
  }
  Vec3f low = points[order[0]], high = low;
  for (const std::uint32_t i : order) {
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], points[i][k]);
      high[k] = std::max(high[k], points[i][k]);
    }
  }
  const Vec3f size = high - low;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const std::size_t blocks = (order.size() + kBlockPoints - 1) / kBlockPoints;
  const std::size_t middle = blocks / 2 * kBlockPoints;
  // Ties by index: the same blocks from every standard library.
  std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(middle), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) {
                     return points[a][axis] != points[b][axis] ? points[a][axis] < points[b][axis] : a < b;
                   });
  split(points, order.first(middle));
  split(points, order.subspan(middle));
}

}  // namespace

PointBody::PointBody(std::unique_ptr<Data> data) : data_(std::move(data)) {}
PointBody::~PointBody() = default;
PointBody::PointBody(PointBody&&) noexcept = default;
PointBody& PointBody::operator=(PointBody&&) noexcept = default;

Result<PointBody> PointBody::build(std::span<const Vec3f> points_m) {
  constexpr std::size_t kMostPoints = std::numeric_limits<std::uint32_t>::max() - 16 * kBlockPoints;
  if (points_m.size() > kMostPoints) {
    return Error{Status::kInvalidMesh,
                 std::to_string(points_m.size()) + " points, must be at most " + std::to_string(kMostPoints),
                 "split the body"};
  }
  for (std::size_t i = 0; i < points_m.size(); ++i) {
    if (!is_finite(points_m[i])) {
      return Error{Status::kInvalidMesh,
                   "point " + std::to_string(i) + " of the body has a coordinate that is not finite",
                   "remove the point"};
    }
  }
  auto data = std::make_unique<Data>();
  data->point_count = static_cast<std::uint32_t>(points_m.size());
  data->padded_points = (data->point_count + kBlockPoints - 1) / kBlockPoints * kBlockPoints;
  data->padded_blocks = (data->block_count() + kMostLanes - 1) / kMostLanes * kMostLanes;
  data->values =
      std::make_unique<float[]>(3 * std::size_t{data->padded_points} + 4 * std::size_t{data->padded_blocks});
  data->index = std::make_unique<std::uint32_t[]>(data->padded_points);
  const std::span<std::uint32_t> order(data->index.get(), data->point_count);
  std::iota(order.begin(), order.end(), 0U);
  split(points_m, order);
  for (std::uint32_t i = data->point_count; i < data->padded_points; ++i) {
    data->index[i] = data->index[data->point_count - 1];
  }
  settle(*data, points_m);
  return PointBody(std::move(data));
}

bool PointBody::refit(std::span<const Vec3f> points_m) noexcept {
  if (points_m.size() != data_->point_count) return false;
  if (!std::all_of(points_m.begin(), points_m.end(), is_finite)) return false;
  settle(*data_, points_m);
  return true;
}

std::size_t PointBody::point_count() const noexcept { return data_->point_count; }
Vec3f PointBody::sphere_centre_m() const noexcept { return data_->centre_m; }
float PointBody::sphere_radius_m() const noexcept { return data_->radius_m; }

std::size_t PointBody::resident_bytes() const noexcept {
  return sizeof(PointBody) + sizeof(Data) + std::size_t{data_->padded_points} * 16 +
         std::size_t{data_->padded_blocks} * 16;
}

}  // namespace sqmap::runtime
