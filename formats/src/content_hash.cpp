// SPDX-License-Identifier: Apache-2.0
#include <span>

#include "digest.hpp"
#include "tables.hpp"

namespace sqmap::io {

std::string content_hash(const Document& document) {
  std::vector<std::span<const std::uint8_t>> pieces;
  for (const std::string& text :
       document.text)  // with its terminating zero, so that neighbours cannot trade letters
    pieces.emplace_back(reinterpret_cast<const std::uint8_t*>(text.c_str()), text.size() + 1);
  pieces.insert(pieces.end(), document.numbers.begin(), document.numbers.end());
  pieces.insert(pieces.end(), document.tables.begin(), document.tables.end());
  return to_hex(xxh3_128(pieces));
}

}  // namespace sqmap::io
