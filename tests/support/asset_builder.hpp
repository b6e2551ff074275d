// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <vector>

#include "sqmap/asset/asset.hpp"

namespace sqmap::test {

/// A valid map of `rows` x `cols` texels whose codes are whole-number arithmetic, so that any language can
/// repeat them: code = 100 + row^2 + 3 * (col * (cols - col) / 4), mod 2^bits - 1.
inline DistanceMap smooth_map(std::uint32_t rows, std::uint32_t cols, std::uint32_t level_count,
                              std::uint32_t bits) {
  DistanceMap map;
  map.rows = rows;
  map.cols = cols;
  map.level_count = level_count;
  map.bits = bits;
  map.depth_min_m = 0.01;
  map.depth_step_m = 0.25 / map.miss_code();
  for (std::uint32_t row = 0; row < rows; ++row)
    for (std::uint32_t col = 0; col < cols; ++col)
      map.code.push_back(
          static_cast<std::uint16_t>((100 + row * row + 3 * (col * (cols - col) / 4)) % map.miss_code()));
  return map;
}

/// A valid asset of three parts that uses everything an asset can hold: rotation, pyramid, seam bits, misses,
/// further crossings, vertex samples, bit depths 4 to 16, faces without a part, errors that were not
/// measured, UTF-8.
///
/// tests/formats/golden/v1_0.h5 is encode() of it: a change here needs another asset for the golden test.
inline Asset rich_asset() {
  Asset asset;
  asset.r_max_m = 2.5;
  asset.sphere = {{0.25, 0, 0}, 3};

  Part body;
  body.shape = {{0.3, 0.4, 0.6}, 0.8, 1.1};
  const double q = 1 / std::sqrt(30.0);
  body.object_from_part = {{1 * q, 2 * q, -3 * q, 4 * q}, {0.5, -0.125, 0.1}};
  body.sphere = {{0.5, -0.125, 0.1}, 0.8};
  body.vertex_count = 1200;
  body.face_count = 4;
  body.volume_m3 = 0.21;
  body.map = smooth_map(17, 32, 3, 10);

  Part arm;
  arm.shape = {{0.2, 0.2, 1}, 0.3, 2};
  arm.object_from_part = {{std::numbers::sqrt2 / 2, 0, 0, -std::numbers::sqrt2 / 2}, {-0.5, 0, 0}};
  arm.sphere = {{-0.5, 0, 0}, 1.1};
  arm.segment = 1;
  arm.reason = CutReason::kHyperbolic;
  arm.vertex_count = 70;
  arm.face_count = 2;
  arm.volume_m3 = 0.05;
  arm.map = smooth_map(9, 12, 1, 8);
  arm.map.code[5] = arm.map.code[30] = arm.map.miss_code();
  arm.map.code[40] = 17;
  arm.map.start_inside.assign((9 * 12 + 7) / 8, 0);
  arm.map.start_inside[0] = 0b10000001;
  arm.map.start_inside[13] = 0b00001000;  // texel 107, the last
  arm.map.crossings = {{0, 180}, {0, 201}, {40, 18}, {107, 254}};
  arm.map.vertex_samples = {{0, 0, 255, 3}, {7, 128, 64, 90}, {95, 255, 0, 254}};

  Part sliver;  // the smallest map there is, of a part that no ray meets
  sliver.shape = {{0.001, 0.5, 0.5}, 0.1, 1};
  sliver.sphere = {{0, 0, 0}, 0.75};
  sliver.segment = 1;
  sliver.reason = CutReason::kErrorTarget;
  sliver.face_count = 1;
  sliver.map.rows = 3;
  sliver.map.cols = 4;
  sliver.map.level_count = 1;
  sliver.map.bits = 4;
  sliver.map.code.assign(12, sliver.map.miss_code());

  asset.parts = {body, arm, sliver};
  asset.face_labels = {0, 0, 1, kNoPart, 0, 2, 1, 0};
  asset.mesh = {1300, 8, 1271, 7, 2, 29, 1, 2, 3, 4, 5, 6, false, -0.26};
  const double unknown = std::numeric_limits<double>::quiet_NaN();
  asset.errors = {{0, 1, unknown, unknown, unknown, 12.5, 20, 20000, 3333, 0},
                  {0, 3, 0.05, 0.03, 0.11, 0.5, 2.25, 20000, 3333, 9876},
                  {2, 2, 0.2, 0.4, 1.5, 1.25, 7, 20000, 3333, 4294967295}};
  asset.provenance = {"sqbake",
                      "0.1.0",
                      "h\u00E4nd \"left\".off",
                      "00112233445566778899aabbccddeeff",
                      "{\"max_error_percent\":0.05}",
                      0.001,
                      "y"};
  return asset;
}

/// rich_asset() with bounds of the surface on its first two parts: everything that version 1.1 can hold.
///
/// tests/formats/golden/v1_1.h5 is encode() of it.
inline Asset bounded_asset() {
  Asset asset = rich_asset();
  for (const std::uint32_t cells : {3U, 2U}) {
    SurfaceBounds& bounds = asset.parts[3 - cells].bounds;
    bounds.cells = cells;
    bounds.tolerance_m = 0.0001 * cells;
    for (std::uint32_t k = 0; k < 6 * cells * cells; ++k) {
      const auto byte = [](std::uint32_t value) { return static_cast<std::uint8_t>(value); };
      bounds.cell.push_back(
          {byte(100 + k), byte(150 - k), byte(200 + k), byte(180 - k), byte(20 + k), byte(k % 4)});
    }
  }
  asset.parts[0].bounds.cell[5] = {};  // nothing is known of it
  return asset;
}

/// bounded_asset() with two of its parts tapered: everything that version 1.2 can hold.
///
/// tests/formats/golden/v1_2.h5 is encode() of it.
inline Asset tapered_asset() {
  Asset asset = bounded_asset();
  asset.parts[0].shape.taper = 0.125;
  asset.parts[2].shape.taper = -0.75;
  asset.parts[2].sphere.radius_m = 1;
  return asset;
}

/// tapered_asset() with its last part bent: everything that version 1.3 can hold.
///
/// tests/formats/golden/v1_3.h5 is encode() of it.
inline Asset bent_asset() {
  Asset asset = tapered_asset();
  asset.parts[2].shape.bend = {0.5, -0.25};
  asset.parts[2].sphere.radius_m = 1.015625;
  return asset;
}

inline bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

/// Equal in every field; NaN equals itself.
inline bool identical(const Asset& a, const Asset& b) {
  const auto same_row = [](const ErrorRow& x, const ErrorRow& y) {
    return x.level == y.level && x.layer == y.layer && same_bits(x.eq35_percent, y.eq35_percent) &&
           same_bits(x.depth_mean_percent, y.depth_mean_percent) &&
           same_bits(x.depth_p95_percent, y.depth_p95_percent) &&
           same_bits(x.misclassified_3_percent, y.misclassified_3_percent) &&
           same_bits(x.misclassified_05_percent, y.misclassified_05_percent) && x.samples_3 == y.samples_3 &&
           x.samples_05 == y.samples_05 && x.samples_depth == y.samples_depth;
  };
  if (a.errors.size() != b.errors.size()) return false;
  for (std::size_t i = 0; i < a.errors.size(); ++i)
    if (!same_row(a.errors[i], b.errors[i])) return false;
  const Provenance &p = a.provenance, &q = b.provenance;
  return same_bits(a.r_max_m, b.r_max_m) && a.sphere == b.sphere && a.parts == b.parts &&
         a.face_labels == b.face_labels && a.mesh == b.mesh && p.generator == q.generator &&
         p.generator_version == q.generator_version && p.source_name == q.source_name &&
         p.source_hash == q.source_hash && p.options_json == q.options_json &&
         same_bits(p.metres_per_unit, q.metres_per_unit) && p.up_axis == q.up_axis;
}

}  // namespace sqmap::test
