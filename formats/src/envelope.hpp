// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "sqmap/asset/result.hpp"

namespace sqmap::io {

/// The 512 bytes in front of the HDF5 data of a bundle (its "user block"), FORMAT.md section 4.
///
///     offset  bytes  content
///          0      8  "SQMAP" 1A 0A 00
///          8      4  major version, u32          all integers little-endian
///         12      4  minor version, u32
///         16      8  bytes of the whole file, u64
///         24     16  XXH3-128 of the whole file with these 16 bytes as zeros, canonical (big-endian)
///         40    472  zeros
///
/// HDF5 1.10 crashes or hangs on some damaged files; no damaged byte gets past this digest to it.
inline constexpr std::size_t kEnvelopeBytes = 512;

/// Fills the first kEnvelopeBytes of a bundle of version kFormatMajor.minor whose other bytes are final.
/// Precondition: it is at least that long.
void seal(std::span<std::uint8_t> bundle, std::uint32_t minor);

/// Errors: kInvalidAsset (no bundle, cut short, bytes appended, damaged), kUnsupportedVersion.
Outcome check_envelope(std::span<const std::uint8_t> bundle);

}  // namespace sqmap::io
