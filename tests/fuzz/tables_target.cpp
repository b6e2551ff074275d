// SPDX-License-Identifier: Apache-2.0
//
// What stands behind a correct content hash: the arrays of a bundle with arbitrary content. The input is a
// list of edits of the arrays of test::bent_asset(): which array, where, how many bytes, the bytes.
#include <algorithm>
#include <cstring>
#include <utility>

#include "../../formats/src/tables.hpp"
#include "fuzz/target.hpp"
#include "fuzz/use_asset.hpp"
#include "support/asset_builder.hpp"

namespace {

using sqmap::fuzz::Bytes;
using sqmap::io::Document;

constexpr std::size_t kMostBytes = 1 << 16;  // of one array

class Edits {
 public:
  Edits(const std::uint8_t* data, std::size_t size) : at_(data), left_(size) {}
  bool any() const { return left_ > 0; }
  std::uint32_t number(std::size_t size) {
    std::uint32_t value = 0;
    const std::size_t count = std::min(size, left_);
    if (count > 0) std::memcpy(&value, at_, count);
    skip(count);
    return value;
  }
  void copy(std::uint8_t* to, std::size_t size) {
    const std::size_t count = std::min(size, left_);
    if (count > 0) std::memcpy(to, at_, count);
    skip(count);
  }

 private:
  void skip(std::size_t count) {
    at_ += count;
    left_ -= count;
  }
  const std::uint8_t* at_;
  std::size_t left_;
};

template <class Array>
void edit(Array& array, Edits& edits) {
  const std::size_t place = edits.number(2), length = edits.number(1);
  if (array.empty()) return;
  const std::size_t at = place % array.size();
  edits.copy(reinterpret_cast<std::uint8_t*>(array.data()) + at, std::min(length, array.size() - at));
}

void resize_rows(Document& document, std::size_t id, Edits& edits) {
  const auto& spec = sqmap::io::kTables[id];
  const std::size_t row = sqmap::io::element_bytes(spec.element) * spec.columns;
  document.tables[id].resize(std::min<std::size_t>(edits.number(2) * row, kMostBytes / row * row));
}

}  // namespace

std::vector<Bytes> sqmap::fuzz::seeds() {
  // No edit; an exponent of part 1; its taper; another layout; longer crossings.
  return {{},
          {9 + 18 + 1, 0x18, 0, 8, 0, 0, 0, 0, 0, 0, 0xF0, 0x3F},
          {9 + 18 + 24, 8, 0, 8, 0, 0, 0, 0, 0, 0, 0xE0, 0x3F},
          {9 + 18 + 10, 0, 0, 4, 9, 0, 0, 0},
          {9 + 18 + 25 + 14, 200, 0, 9 + 18 + 25 + 15, 200, 0, 9 + 18 + 10, 0x30, 0, 4, 200, 0, 0, 0}};
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Document kDocument = sqmap::io::to_document(sqmap::test::bent_asset());
  Document document = kDocument;
  Edits edits(data, size);
  constexpr std::size_t kTexts = sqmap::io::kTextCount, kNumbers = sqmap::io::kNumberCount,
                        kTables = sqmap::io::kTableCount;
  for (int count = 0; edits.any() && count < 64; ++count) {
    const std::size_t which = edits.number(1) % (kTexts + kNumbers + 2 * kTables);
    if (which < kTexts) {
      edit(document.text[which], edits);
    } else if (which < kTexts + kNumbers) {
      edit(document.numbers[which - kTexts], edits);
    } else if (which < kTexts + kNumbers + kTables) {
      edit(document.tables[which - kTexts - kNumbers], edits);
    } else {
      resize_rows(document, which - kTexts - kNumbers - kTables, edits);
    }
  }
  const auto asset = sqmap::io::to_asset(document);
  if (asset && validate(asset.value(), sqmap::CheckLevel::kQuick).empty())
    sqmap::fuzz::use_asset(asset.value());
  return 0;
}
