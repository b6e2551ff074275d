// SPDX-License-Identifier: GPL-3.0-or-later
#include "content_hash.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <memory>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#define XXH_INLINE_ALL
#include <xxhash.h>

namespace sqmap::apps {
namespace {

// FAT counts two seconds; local Linux file systems some milliseconds.
constexpr std::int64_t kCoarsestFileTime_ns = 2'000'000'000;
constexpr std::size_t kBlockBytes = std::size_t{1} << 18;

class Hasher {
 public:
  Hasher() {
    XXH3_INITSTATE(&state_);
    XXH3_128bits_reset(&state_);
  }
  void add(const void* bytes, std::size_t count) { XXH3_128bits_update(&state_, bytes, count); }
  std::string hex() const {
    const XXH128_hash_t value = XXH3_128bits_digest(&state_);
    std::string digits;
    for (const std::uint64_t half : {value.high64, value.low64})
      for (int shift = 60; shift >= 0; shift -= 4) digits += "0123456789abcdef"[half >> shift & 15];
    return digits;
  }

 private:
  XXH3_state_t state_;
};

std::int64_t to_ns(const timespec& time) { return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec; }

FileStamp to_stamp(const struct stat& info) {
  return {static_cast<std::uint64_t>(info.st_size), info.st_ino, info.st_dev, to_ns(info.st_mtim),
          to_ns(info.st_ctim)};
}

/// False when the file could not be read to its end.
bool add_contents(int fd, Hasher& hasher) {
  const auto block = std::make_unique<std::array<std::uint8_t, kBlockBytes>>();
  for (;;) {
    const ssize_t count = ::read(fd, block->data(), block->size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return false;
    if (count == 0) return true;
    hasher.add(block->data(), static_cast<std::size_t>(count));
  }
}

}  // namespace

std::string content_hash(std::span<const std::uint8_t> bytes) {
  Hasher hasher;
  if (!bytes.empty()) hasher.add(bytes.data(), bytes.size());
  return hasher.hex();
}

std::string content_hash(std::span<const std::string_view> pieces) {
  Hasher hasher;
  for (const std::string_view piece : pieces) {
    std::array<std::uint8_t, 8> length{};
    for (std::size_t i = 0; i < length.size(); ++i)
      length[i] = static_cast<std::uint8_t>(std::uint64_t{piece.size()} >> (8 * i));
    hasher.add(length.data(), length.size());
    if (!piece.empty()) hasher.add(piece.data(), piece.size());
  }
  return hasher.hex();
}

bool is_content_hash(std::string_view text) noexcept {
  return text.size() == 32 &&
         std::ranges::all_of(text, [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

std::optional<FileStamp> stamp_of(const std::filesystem::path& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0 || !S_ISREG(info.st_mode)) return std::nullopt;
  return to_stamp(info);
}

std::optional<HashedFile> hash_file(const std::filesystem::path& path) {
  const std::int64_t start_ns = now_ns();
  // O_NONBLOCK: opening a pipe without a writer must not wait for one.
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd < 0) return std::nullopt;
  struct stat before {
  }, after{};
  Hasher hasher;
  const bool is_read = ::fstat(fd, &before) == 0 && S_ISREG(before.st_mode) && add_contents(fd, hasher) &&
                       ::fstat(fd, &after) == 0;
  ::close(fd);
  if (!is_read) return std::nullopt;
  HashedFile file{hasher.hex(), to_stamp(before), false};
  file.is_settled = file.stamp == to_stamp(after) &&
                    std::max(file.stamp.mtime_ns, file.stamp.ctime_ns) < start_ns - kCoarsestFileTime_ns;
  return file;
}

std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

}  // namespace sqmap::apps
