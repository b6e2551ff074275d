// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

namespace sqmap::io {

/// XXH3-128, canonical byte order.
using Digest = std::array<std::uint8_t, 16>;

/// Digest of the pieces one after the other. It guards against damage, not against intent.
Digest xxh3_128(std::span<const std::span<const std::uint8_t>> pieces);

/// 32 lower-case hex digits.
std::string to_hex(const Digest& digest);

}  // namespace sqmap::io
