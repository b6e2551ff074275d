// SPDX-License-Identifier: Apache-2.0
// What a bundle can make its reader allocate, counted by an operator new of our own.
#include <atomic>
#include <cstdlib>
#include <new>

#include <gtest/gtest.h>
#include <malloc.h>

#include "sqmap/io/bundle.hpp"

#include "support/asset_builder.hpp"

namespace {

std::atomic<std::size_t> live_bytes{0}, peak_bytes{0};

void* counted(std::size_t size) {
  void* memory = std::malloc(size > 0 ? size : 1);
  if (memory == nullptr) std::abort();
  const std::size_t live = live_bytes += malloc_usable_size(memory);
  if (live > peak_bytes) peak_bytes = live;
  return memory;
}
void discounted(void* memory) noexcept {
  if (memory != nullptr) live_bytes -= malloc_usable_size(memory);
  std::free(memory);
}

}  // namespace

void* operator new(std::size_t size) { return counted(size); }
void* operator new[](std::size_t size) { return counted(size); }
void* operator new(std::size_t size, const std::nothrow_t&) noexcept { return counted(size); }
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept { return counted(size); }
void operator delete(void* memory) noexcept { discounted(memory); }
void operator delete[](void* memory) noexcept { discounted(memory); }
void operator delete(void* memory, std::size_t) noexcept { discounted(memory); }
void operator delete[](void* memory, std::size_t) noexcept { discounted(memory); }

namespace sqmap {
namespace {

constexpr std::uint64_t kMiB = std::uint64_t{1} << 20;

/// Most bytes that were allocated at a time while `bytes` was read, beyond those before.
std::size_t peak_of_decoding(const std::vector<std::uint8_t>& bytes, const io::ReadLimits& limits,
                             bool& accepted) {
  const std::size_t before = live_bytes;
  peak_bytes = before;
  accepted = io::decode(bytes, limits).ok();
  return peak_bytes - before;
}

/// A valid bundle that inflates 8.4 MB, or with side lists 12 MB, from a few kilobytes.
std::vector<std::uint8_t> swollen_bundle(bool with_lists) {
  Asset asset = test::rich_asset();
  asset.errors.clear();
  DistanceMap& map = asset.parts[0].map;
  map.rows = 1025;
  map.cols = 4096;
  map.level_count = 1;
  map.code.assign(std::size_t{map.rows} * map.cols, 1);
  if (with_lists) {
    map.rows = 513;
    map.code.assign(std::size_t{map.rows} * map.cols, 1);
    for (std::uint32_t texel = 0; texel < map.code.size() / 2; ++texel) map.crossings.push_back({texel, 2});
  }
  return io::encode(asset).value();
}

TEST(ReadMemory, IsRefusedBeforeItIsAllocated) {
  const auto bundle = swollen_bundle(false);
  ASSERT_LT(bundle.size(), 64 * 1024U);
  bool accepted = true;
  EXPECT_LT(peak_of_decoding(bundle, {kMiB, 4 * kMiB}, accepted), kMiB);
  EXPECT_FALSE(accepted);
}

TEST(ReadMemory, StaysWithinThePromisedMultipleOfTheLimit) {
  for (const bool with_lists : {false, true}) {
    const auto bundle = swollen_bundle(with_lists);
    const io::ReadLimits limits{kMiB, 12 * kMiB};
    bool accepted = false;
    const std::size_t peak = peak_of_decoding(bundle, limits, accepted);
    ASSERT_TRUE(accepted);
    RecordProperty(with_lists ? "peak_with_lists" : "peak", std::to_string(peak));
    EXPECT_GT(peak, 8 * kMiB) << "the bundle is not large enough to tell";
    EXPECT_LT(peak, io::kMostMemoryShare * limits.max_decoded_bytes + io::kMostMemoryBytes);
  }
}

}  // namespace
}  // namespace sqmap
