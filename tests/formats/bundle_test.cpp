// SPDX-License-Identifier: Apache-2.0
#include "sqmap/io/bundle.hpp"

#include <cstring>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "sqmap/asset/version.hpp"

#include "../../formats/src/map_codec.hpp"
#include "formats/bundle_bytes.hpp"
#include "support/asset_builder.hpp"

namespace sqmap {
namespace {

using test::bent_asset;
using test::bounded_asset;
using test::Bytes;
using test::identical;
using test::rich_asset;
using test::tapered_asset;

Bytes encoded(const Asset& asset) {
  auto bytes = io::encode(asset);
  EXPECT_TRUE(bytes) << bytes.error().finding;
  return bytes ? std::move(bytes).value() : Bytes{};
}

TEST(Bundle, RoundTripKeepsEveryField) {
  const Asset asset = rich_asset();
  const auto decoded = io::decode(encoded(asset));
  ASSERT_TRUE(decoded) << decoded.error().finding;
  EXPECT_TRUE(identical(decoded.value(), asset));
}

TEST(Bundle, RoundTripKeepsAnAssetThatHasOnlyWhatItMust) {
  Asset asset = rich_asset();
  asset.parts.erase(asset.parts.begin(), asset.parts.begin() + 2);
  asset.face_labels.clear();
  asset.errors.clear();
  asset.provenance = {};
  const auto decoded = io::decode(encoded(asset));
  ASSERT_TRUE(decoded) << decoded.error().finding;
  EXPECT_TRUE(identical(decoded.value(), asset));
}

TEST(Bundle, RoundTripKeepsBoundsTapersAndBends) {
  for (const Asset& asset : {bounded_asset(), tapered_asset(), bent_asset()}) {
    const auto decoded = io::decode(encoded(asset));
    ASSERT_TRUE(decoded) << decoded.error().finding;
    EXPECT_TRUE(identical(decoded.value(), asset));
    EXPECT_FALSE(identical(decoded.value(), rich_asset()));
  }
  EXPECT_FALSE(identical(tapered_asset(), bounded_asset()));
  EXPECT_FALSE(identical(bent_asset(), tapered_asset()));
}

// What has no bounds, tapers and bends is a bundle of version 1.0, for readers that know no other.
TEST(Bundle, HasTheEarliestVersionThatHoldsIt) {
  const Asset assets[] = {rich_asset(), bounded_asset(), tapered_asset(), bent_asset()};
  for (const std::uint32_t minor : {0U, 1U, 2U, 3U}) {
    const Bytes bytes = encoded(assets[minor]);
    std::uint32_t found = 9;
    std::memcpy(&found, bytes.data() + 12, 4);
    EXPECT_EQ(found, minor);
    const auto sizes = io::stored_bytes(bytes);
    ASSERT_TRUE(sizes);
    constexpr const char* kLast[] = {"/errors", "/maps/bounds", "/parts/taper", "/parts/bend_per_m"};
    EXPECT_EQ(sizes.value().back().name, kLast[minor]);
  }
}

// Noise of every bit depth: what no prediction helps with must come back too.
TEST(Bundle, RoundTripKeepsNoise) {
  std::mt19937_64 random(5);
  Asset asset = rich_asset();
  for (std::uint32_t bits = 4; bits <= 16; ++bits) {
    DistanceMap& map = asset.parts[0].map;
    map = test::smooth_map(33, 64, 3, bits);
    for (auto& code : map.code) code = static_cast<std::uint16_t>(random() & map.miss_code());
    const auto decoded = io::decode(encoded(asset));
    ASSERT_TRUE(decoded) << decoded.error().finding;
    EXPECT_TRUE(identical(decoded.value(), asset)) << bits << " bits";
  }
}

TEST(Bundle, SameAssetGivesSameBytesOnAnyThread) {
  const Bytes first = encoded(rich_asset());
  std::vector<Bytes> others(4);
  {
    std::vector<std::jthread> threads;
    for (Bytes& other : others) threads.emplace_back([&other] { other = encoded(rich_asset()); });
  }
  for (const Bytes& other : others) EXPECT_EQ(other, first);
}

// A part of 17 x 32 texels and two small ones: what HDF5 and the tables cost beside the maps themselves.
TEST(Bundle, OverheadStaysBelow8KB) {
  const Bytes bytes = encoded(rich_asset());
  const auto sizes = io::stored_bytes(bytes);
  ASSERT_TRUE(sizes) << sizes.error().finding;
  std::uint64_t data = 0;
  for (const auto& size : sizes.value()) data += size.stored;
  EXPECT_LT(bytes.size() - data, 8192u) << bytes.size() << " bytes, " << data << " of data";
}

TEST(Bundle, StoredBytesListsDatasetsInFileOrder) {
  const auto sizes = io::stored_bytes(encoded(rich_asset()));
  ASSERT_TRUE(sizes) << sizes.error().finding;
  ASSERT_EQ(sizes.value().size(), 21u);
  EXPECT_EQ(sizes.value().front().name, "/parts/semi_axes_m");
  EXPECT_EQ(sizes.value().front().decoded, 3u * 3 * 8);
  EXPECT_EQ(sizes.value()[12].name, "/maps/code");
  EXPECT_EQ(sizes.value()[12].decoded, 2u * (17 * 32 + 9 * 12 + 3 * 4));
  EXPECT_EQ(sizes.value().back().name, "/errors");
  for (const auto& size : sizes.value()) EXPECT_GT(size.stored, 0u) << size.name;
}

TEST(Bundle, RefusesToEncodeWhatBreaksARule) {
  Asset asset = rich_asset();
  asset.parts[0].map.code[3] = 1024;  // a rule of the full check
  const auto bytes = io::encode(asset);
  ASSERT_FALSE(bytes);
  EXPECT_EQ(bytes.error().status, Status::kInvalidAsset);
  EXPECT_NE(bytes.error().finding.find("rule 51"), std::string::npos) << bytes.error().finding;
}

TEST(Bundle, EveryTruncationIsAnError) {
  const Bytes bytes = encoded(rich_asset());
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    const Bytes cut(bytes.begin(),
                    bytes.begin() + static_cast<std::ptrdiff_t>(length));  // own buffer: ASan sees over-reads
    const auto decoded = io::decode(cut);
    ASSERT_FALSE(decoded) << length;
    ASSERT_EQ(decoded.error().status, Status::kInvalidAsset) << length;
  }
}

TEST(Bundle, EveryRandomBitFlipIsAnError) {
  const Bytes bytes = encoded(rich_asset());
  std::mt19937_64 random(1);
  for (int i = 0; i < 2000; ++i) {
    Bytes damaged = bytes;
    const std::size_t bit = random() % (8 * bytes.size());
    damaged[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
    ASSERT_FALSE(io::decode(damaged)) << "bit " << bit;
  }
}

TEST(Bundle, AppendedBytesAreAnError) {
  Bytes bytes = encoded(rich_asset());
  bytes.push_back(0);
  EXPECT_FALSE(io::decode(bytes));
  const Bytes once = encoded(rich_asset());
  Bytes twice = once;
  twice.insert(twice.end(), once.begin(), once.end());
  EXPECT_FALSE(io::decode(twice));
}

TEST(Bundle, NewerVersionIsRefusedWithBothVersions) {
  const std::pair<std::uint32_t, std::uint32_t> newer[] = {{kFormatMajor, kFormatMinor + 1},
                                                           {kFormatMajor + 1, 0}};
  for (const auto& [major, minor] : newer) {
    Bytes bytes = encoded(rich_asset());
    std::memcpy(bytes.data() + 8, &major, 4);
    std::memcpy(bytes.data() + 12, &minor, 4);
    bytes.resize(600);  // another version may mean anything by what follows
    const auto decoded = io::decode(bytes);
    ASSERT_FALSE(decoded);
    EXPECT_EQ(decoded.error().status, Status::kUnsupportedVersion);
    const std::string theirs = std::to_string(major) + "." + std::to_string(minor);
    const std::string ours = std::to_string(kFormatMajor) + "." + std::to_string(kFormatMinor);
    EXPECT_NE(decoded.error().finding.find(theirs), std::string::npos) << decoded.error().finding;
    EXPECT_NE(decoded.error().finding.find(ours), std::string::npos) << decoded.error().finding;
  }
}

TEST(Bundle, AnOlderVersionIsRefusedWithAnotherRemedyThanANewerOne) {
  const auto refusal = [](std::uint32_t major, std::uint32_t minor) {
    Bytes bytes = encoded(rich_asset());
    std::memcpy(bytes.data() + 8, &major, 4);
    std::memcpy(bytes.data() + 12, &minor, 4);
    const auto decoded = io::decode(bytes);
    EXPECT_FALSE(decoded);
    return decoded ? Error{} : decoded.error();
  };
  for (const std::uint32_t minor : {0U, 1U, 9U}) {
    const Error older = refusal(0, minor);
    EXPECT_EQ(older.status, Status::kUnsupportedVersion);
    EXPECT_NE(older.finding.find("version 0." + std::to_string(minor)), std::string::npos) << older.finding;
    EXPECT_EQ(older.remedy, "bake the asset again");
  }
  EXPECT_NE(refusal(kFormatMajor + 1, 0).remedy.find("newer sqmap"), std::string::npos);
}

TEST(Bundle, LimitsAreKept) {
  const Bytes bytes = encoded(rich_asset());
  EXPECT_FALSE(io::decode(bytes, {bytes.size() - 1, 1 << 20}));
  const auto decoded = io::decode(bytes, {bytes.size(), 1000});
  ASSERT_FALSE(decoded);
  EXPECT_NE(decoded.error().finding.find("/maps/"), std::string::npos) << decoded.error().finding;
  EXPECT_TRUE(io::decode(bytes, {bytes.size(), 4096}));
}

// Each written when its version was made; they never change.
TEST(Bundle, GoldenBundlesOfAllVersionsLoad) {
  for (const auto& [name, asset] : {std::pair{"v1_0.h5", rich_asset()},
                                    {"v1_1.h5", bounded_asset()},
                                    {"v1_2.h5", tapered_asset()},
                                    {"v1_3.h5", bent_asset()}}) {
    SCOPED_TRACE(name);
    std::ifstream file(std::string(SQMAP_GOLDEN_DIR "/") + name, std::ios::binary);
    const Bytes bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    const auto decoded = io::decode(bytes);
    ASSERT_TRUE(decoded) << decoded.error().finding;
    EXPECT_TRUE(identical(decoded.value(), asset));
  }
}

// Two rows by four columns, worked by hand from FORMAT.md section 6.1.
TEST(MapCodec, FoldsAsWrittenInTheFormat) {
  const std::vector<std::uint16_t> code{5, 6, 6, 15, 5, 7, 7, 0};
  std::vector<std::uint16_t> folded(8);
  io::fold_codes(code, 4, 4, folded);
  // second differences 5 1 0 9=-7, 0 1 0 -16=0 (mod 16); folded 2 d, or -2 d - 1 for d < 0
  EXPECT_EQ(folded, (std::vector<std::uint16_t>{10, 2, 0, 13, 0, 2, 0, 0}));
}

TEST(MapCodec, InvertsForEveryPairOfNeighbours) {
  for (std::uint32_t a = 0; a < 16; ++a)
    for (std::uint32_t b = 0; b < 16; ++b) {
      const std::vector<std::uint16_t> code{static_cast<std::uint16_t>(a), static_cast<std::uint16_t>(b),
                                            static_cast<std::uint16_t>(b), static_cast<std::uint16_t>(a)};
      std::vector<std::uint16_t> folded(4), back(4);
      io::fold_codes(code, 2, 4, folded);
      ASSERT_TRUE(io::unfold_codes(folded, 2, 4, back));
      ASSERT_EQ(back, code);
    }
}

}  // namespace
}  // namespace sqmap
