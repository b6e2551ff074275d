// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sqmap/asset/result.hpp"

namespace sqmap::apps {

enum class PixelFormat { kRgb, kRgba };

/// A PNG of 8 bits a channel. `pixels`: rows from the top, channels interleaved; shape [height, width, 3 or
/// 4]. Errors: kFileUnwritable when the encoder refuses.
Result<std::vector<std::uint8_t>> png_bytes(std::span<const std::uint8_t> pixels, std::uint32_t width,
                                            std::uint32_t height, PixelFormat format);

}  // namespace sqmap::apps
