// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace sqmap::io {

/// Undoes shuffle + deflate + fletcher32 on the one chunk of a dataset. Not HDF5's own filters, because its
/// deflate filter allocates whatever the stream inflates to; this one refuses a stream that is not exactly
/// `decoded_bytes`.
///
/// @param stored  the chunk as stored: deflated bytes and 4 bytes of fletcher32, which are skipped, since the
/// digest
///                in the header of the bundle has already vouched for every byte
/// @return        decoded_bytes bytes, or nothing where the stream is damaged or of another length
std::optional<std::vector<std::uint8_t>> unpack_chunk(std::span<const std::uint8_t> stored,
                                                      std::uint32_t decoded_bytes, std::size_t element_bytes);

/// Deflate expands a byte to at most this many (zlib's technical notes give 1032:1).
inline constexpr std::uint64_t kMaxDeflateRatio = 1032;

}  // namespace sqmap::io
