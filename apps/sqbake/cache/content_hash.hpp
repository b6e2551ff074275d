// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace sqmap::apps {

/// XXH3-128 as 32 hex digits. It tells contents apart and finds damage; it does not withstand intent.
std::string content_hash(std::span<const std::uint8_t> bytes);
/// Of pieces one after the other, each led by its length, so that neighbours cannot trade bytes.
std::string content_hash(std::span<const std::string_view> pieces);

/// True for what content_hash returns: such a name cannot leave its folder.
bool is_content_hash(std::string_view text) noexcept;

/// What tells without reading it that a file is still the same.
struct FileStamp {
  std::uint64_t size{}, inode{}, device{};
  std::int64_t mtime_ns{}, ctime_ns{};
  friend bool operator==(const FileStamp&, const FileStamp&) = default;
};

/// Contents of a regular file at a moment.
struct HashedFile {
  std::string hash;
  FileStamp stamp;
  /// When the reading began, later by at least the resolution of file times than the last change: only then a
  /// file with the same stamp is sure to have the same bytes.
  bool is_settled = false;
};

/// Empty where there is no regular file.
std::optional<FileStamp> stamp_of(const std::filesystem::path& path);
/// Empty where there is no regular file that can be read.
std::optional<HashedFile> hash_file(const std::filesystem::path& path);

/// Nanoseconds of the system clock, as file times count them.
std::int64_t now_ns();

}  // namespace sqmap::apps
