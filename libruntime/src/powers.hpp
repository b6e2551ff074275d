// SPDX-License-Identifier: Apache-2.0
//
// Powers for layer 1 from operations that IEEE 754 rounds exactly, so that they are the same on every
// machine; std::pow is not. lanes.inl holds the same lines for vectors.
#pragma once

#include <bit>
#include <cstdint>

#include "sqmap/asset/shape_table.hpp"

namespace sqmap::runtime {

/// 2/ln 2 times the series of artanh: log2(m) = 2/ln 2 artanh((m - 1)/(m + 1)).
inline constexpr float kLog2Series[5] = {2.885390082F, 0.961796694F, 0.577078016F, 0.412198583F,
                                         0.320598898F};
/// Taylor series of 2^f.
inline constexpr float kExp2Series[8] = {1.0F,           0.693147181F,   0.240226507F,    0.0555041087F,
                                         0.00961812911F, 0.00133335581F, 0.000154035304F, 0.0000152527338F};
inline constexpr float kLeastNormal = 1.17549435e-38F;     ///< 2^-126; log2 of less is taken as -126
inline constexpr std::int32_t kHalfRootBits = 0x3F3504F3;  ///< sqrt(1/2): mantissas are taken from there up
inline constexpr float kRounder = 12582912.0F;             ///< 1.5 * 2^23: adding it rounds to an integer

/// log2(x) of x >= 0, within 4e-7 (1 + |log2 x|).
inline float log2_of(float x) noexcept {
  const auto bits = std::bit_cast<std::int32_t>(greater(x, kLeastNormal));
  const std::int32_t exponent = (bits - kHalfRootBits) >> 23;
  const float m = std::bit_cast<float>(bits - (exponent << 23));
  const float s = (m - 1.0F) / (m + 1.0F), q = s * s;
  const float series =
      kLog2Series[0] +
      q * (kLog2Series[1] + q * (kLog2Series[2] + q * (kLog2Series[3] + q * kLog2Series[4])));
  return static_cast<float>(exponent) + s * series;
}

/// 2^x, x limited to [-126, 126].
inline float exp2_of(float x) noexcept {
  const float limited = lesser(greater(x, -126.0F), 126.0F);
  const float shifted = limited + kRounder;
  const float f = limited - (shifted - kRounder);
  const std::int32_t n = std::bit_cast<std::int32_t>(shifted) - std::bit_cast<std::int32_t>(kRounder);
  float series = kExp2Series[7];
  for (int k = 6; k >= 0; --k) series = kExp2Series[k] + f * series;
  return std::bit_cast<float>(std::bit_cast<std::int32_t>(series) + (n << 23));
}

/// x^k of x >= 0.
inline float power_of(float x, float k) noexcept { return exp2_of(k * log2_of(x)); }

}  // namespace sqmap::runtime
