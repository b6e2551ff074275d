// SPDX-License-Identifier: Apache-2.0
#include "map_codec.hpp"

#include <cstddef>

namespace sqmap::io {
namespace {

// Sum of the left and upper neighbour less the diagonal one; neighbours outside the array are 0.
std::uint32_t prediction(std::span<const std::uint16_t> code, std::size_t index, std::uint32_t cols) {
  const bool has_left = index % cols != 0;
  const bool has_up = index >= cols;
  std::uint32_t sum = 0;
  if (has_left) sum += code[index - 1];
  if (has_up) sum += code[index - cols];
  if (has_left && has_up) sum -= code[index - cols - 1];
  return sum;  // wraps; only its low bits count
}

}  // namespace

void fold_codes(std::span<const std::uint16_t> code, std::uint32_t cols, std::uint32_t bits,
                std::span<std::uint16_t> out) {
  const std::uint32_t mask = (1U << bits) - 1U;
  for (std::size_t i = 0; i < code.size(); ++i) {
    const std::uint32_t difference = (code[i] - prediction(code, i, cols)) & mask;
    const bool negative = (difference >> (bits - 1)) != 0;  // as a signed number of `bits` bits
    out[i] = static_cast<std::uint16_t>((negative ? 2 * (mask - difference) + 1 : 2 * difference));
  }
}

bool unfold_codes(std::span<const std::uint16_t> folded, std::uint32_t cols, std::uint32_t bits,
                  std::span<std::uint16_t> out) {
  const std::uint32_t mask = (1U << bits) - 1U;
  for (std::size_t i = 0; i < folded.size(); ++i) {
    const std::uint32_t value = folded[i];
    if (value > mask) return false;
    const std::uint32_t difference = (value & 1U) != 0 ? mask - value / 2 : value / 2;
    out[i] = static_cast<std::uint16_t>((difference + prediction(out, i, cols)) & mask);
  }
  return true;
}

}  // namespace sqmap::io
