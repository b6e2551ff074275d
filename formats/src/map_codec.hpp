// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

namespace sqmap::io {

/// What `code` of a map becomes in the file (FORMAT.md section 6.1): the second difference along both axes,
/// mod 2^bits, folded so that small differences of either sign are small numbers.
///
/// Measured with shuffle + deflate 9 on 8 maps of 65 x 128 over the elephant, bytes at 8 / 10 / 12 bits:
/// plain 29.6 / 49.3 / 62.1 KB, this 21.4 / 32.0 / 43.1 KB, the median predictor of JPEG-LS 20.8 / 31.9
/// / 44.3 KB, which no two lines of array code can undo.
///
/// @param code  [rows * cols], row-major, each < 2^bits
/// @param out   as long as code; may not overlap it
void fold_codes(std::span<const std::uint16_t> code, std::uint32_t cols, std::uint32_t bits,
                std::span<std::uint16_t> out);

/// Inverse of fold_codes. False where a value is not below 2^bits; `out` is then unspecified.
bool unfold_codes(std::span<const std::uint16_t> folded, std::uint32_t cols, std::uint32_t bits,
                  std::span<std::uint16_t> out);

}  // namespace sqmap::io
