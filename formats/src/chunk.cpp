// SPDX-License-Identifier: Apache-2.0
#include "chunk.hpp"

#include <limits>
#include <utility>

#include <zlib.h>

namespace sqmap::io {
namespace {

constexpr std::size_t kChecksumBytes = 4;

bool inflate_exactly(std::span<const std::uint8_t> stored, std::span<std::uint8_t> decoded) {
  z_stream stream{};
  if (inflateInit(&stream) != Z_OK) return false;
  stream.next_in = const_cast<Bytef*>(stored.data());  // zlib's interface predates const; it does not write
  stream.avail_in = static_cast<uInt>(stored.size());
  stream.next_out = decoded.data();
  stream.avail_out = static_cast<uInt>(decoded.size());
  const int status = inflate(&stream, Z_FINISH);
  const bool exact = status == Z_STREAM_END && stream.avail_in == 0 && stream.avail_out == 0;
  inflateEnd(&stream);
  return exact;
}

}  // namespace

std::optional<std::vector<std::uint8_t>> unpack_chunk(std::span<const std::uint8_t> stored,
                                                      std::uint32_t decoded_bytes,
                                                      std::size_t element_bytes) {
  if (stored.size() < kChecksumBytes || stored.size() > std::numeric_limits<uInt>::max()) return std::nullopt;
  std::vector<std::uint8_t> planes(decoded_bytes);
  if (!inflate_exactly(stored.first(stored.size() - kChecksumBytes), planes)) return std::nullopt;
  if (element_bytes == 1) return planes;
  // Shuffle stores the first byte of every element, then the second of every element, ...
  std::vector<std::uint8_t> elements(decoded_bytes);
  const std::size_t count = decoded_bytes / element_bytes;
  for (std::size_t byte = 0; byte < element_bytes; ++byte)
    for (std::size_t i = 0; i < count; ++i) elements[i * element_bytes + byte] = planes[byte * count + i];
  return elements;
}

}  // namespace sqmap::io
