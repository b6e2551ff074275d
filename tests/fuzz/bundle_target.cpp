// SPDX-License-Identifier: Apache-2.0
//
// The bytes of a bundle, once as they are and once with correct length and digests, as an attacker would send
// them.
#include <algorithm>
#include <cstring>
#include <span>

#include "sqmap/io/bundle.hpp"

#include "formats/bundle_bytes.hpp"
#include "fuzz/target.hpp"
#include "fuzz/use_asset.hpp"
#include "support/asset_builder.hpp"

namespace {

constexpr std::size_t kUserBlockBytes = 512, kEndOfFileAt = kUserBlockBytes + 28;  // FORMAT.md section 4
constexpr sqmap::io::ReadLimits kLimits{std::uint64_t{1} << 20, std::uint64_t{16} << 20};

void decode(const sqmap::fuzz::Bytes& bytes) {
  const auto asset = sqmap::io::decode(bytes, kLimits);
  if (!asset) {
    sqmap::fuzz::require(!asset.error().finding.empty() && !asset.error().remedy.empty(),
                         "a refusal says what was found and what to do");
    return;
  }
  sqmap::fuzz::use_asset(asset.value());
  const auto again = sqmap::io::encode(asset.value());
  if (!again) return;  // breaks a rule that readers need not check
  const auto same = sqmap::io::decode(again.value());
  sqmap::fuzz::require(same.ok() && sqmap::test::identical(same.value(), asset.value()),
                       "what was read is written and read again as it was");
}

}  // namespace

std::vector<sqmap::fuzz::Bytes> sqmap::fuzz::seeds() {
  Asset small = test::rich_asset();
  small.parts.resize(1);
  small.face_labels.clear();
  small.errors.clear();
  return {io::encode(test::rich_asset()).value(), io::encode(small).value(),
          io::encode(test::bent_asset()).value()};
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  sqmap::fuzz::Bytes bytes(data, data + size);
  decode(bytes);
  if (bytes.size() < kEndOfFileAt + 8) return 0;
  constexpr std::uint8_t kHead[16] = {'S', 'Q', 'M', 'A', 'P', 0x1A, '\n', 0, 1, 0, 0, 0, 0, 0, 0, 0};
  std::copy(std::begin(kHead), std::end(kHead), bytes.begin());
  const std::uint64_t length = bytes.size();
  std::memcpy(bytes.data() + kEndOfFileAt, &length, sizeof length);
  sqmap::test::reseal(bytes);
  decode(bytes);
  return 0;
}
