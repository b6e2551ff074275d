// SPDX-License-Identifier: Apache-2.0
#include "map_image.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "../common/png_bytes.hpp"

namespace sqmap::apps {

Rgb viridis(double fraction) {
  // Nine points of the map that Smith and van der Walt designed for matplotlib (public domain, CC0).
  constexpr std::array<Rgb, 9> kPoints{{{68, 1, 84},
                                        {71, 44, 122},
                                        {59, 81, 139},
                                        {44, 113, 142},
                                        {33, 144, 141},
                                        {39, 173, 129},
                                        {92, 200, 99},
                                        {170, 220, 50},
                                        {253, 231, 37}}};
  const double place = fraction > 0 ? std::min(fraction, 1.0) * (kPoints.size() - 1) : 0;  // NaN: 0
  const std::size_t low = std::min(static_cast<std::size_t>(place), kPoints.size() - 2);
  const double t = place - static_cast<double>(low);
  Rgb color{};
  for (std::size_t channel = 0; channel < 3; ++channel)
    color[channel] = static_cast<std::uint8_t>(
        std::lround((1 - t) * kPoints[low][channel] + t * kPoints[low + 1][channel]));
  return color;
}

Result<std::vector<std::uint8_t>> map_png(const DistanceMap& map, std::uint32_t level, double least_m,
                                          double most_m) {
  const std::uint32_t stride = 1U << std::min(level, map.level_count - 1);
  const std::uint32_t rows = (map.rows - 1) / stride + 1, cols = map.cols / stride;
  std::vector<std::uint8_t> pixels;
  pixels.reserve(std::size_t{3} * rows * cols);
  for (std::uint32_t line = 0; line < rows; ++line) {
    for (std::uint32_t col = 0; col < cols; ++col) {
      const std::uint32_t texel = (rows - 1 - line) * stride * map.cols + col * stride;
      Rgb color = kStartInsideColor;
      if (!map.starts_inside(texel))
        color = map.code[texel] == map.miss_code()
                    ? kMissColor
                    : viridis((map.depth_m(map.code[texel]) - least_m) / (most_m - least_m));
      pixels.insert(pixels.end(), color.begin(), color.end());
    }
  }

  return png_bytes(pixels, cols, rows, PixelFormat::kRgb);
}

}  // namespace sqmap::apps
