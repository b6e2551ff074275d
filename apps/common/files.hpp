// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sqmap/asset/result.hpp"

namespace sqmap::apps {

/// The bytes of a regular file of at most `max_bytes`. Errors: kFileMissing, kFileUnreadable.
Result<std::vector<std::uint8_t>> read_file(const std::filesystem::path& path, std::uint64_t max_bytes);

/// All of standard input, at most `max_bytes`. Errors: kFileUnreadable.
Result<std::vector<std::uint8_t>> read_stdin(std::uint64_t max_bytes);

/// The same bytes, as text.
inline std::string_view as_text(std::span<const std::uint8_t> bytes) noexcept {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Writes to an open file, however many calls it takes. 0 or errno.
int write_all(int fd, std::span<const std::uint8_t> bytes);

/// Writes a file atomically: a temporary file beside it, synced, renamed when it is complete. Nothing is left
/// on failure; what a kill leaves, remove_abandoned() removes. A file that holds these bytes already is not
/// touched, so its time stays and build systems see that nothing changed. Links are followed. Errors:
/// kFileUnwritable.
Outcome write_file(const std::filesystem::path& path, std::span<const std::uint8_t> bytes);
Outcome write_file(const std::filesystem::path& path, const std::string& text);

/// How the temporary files of write_file() begin; a folder's meshes do not begin with a dot.
inline constexpr const char* kTemporaryPrefix = ".sqmap-";

/// Removes what write_file() left in the folders of these files where its process was killed: temporary files
/// that no living process holds a lock on. Where the file system knows no locks, they stay.
void remove_abandoned(std::span<const std::filesystem::path> files);

}  // namespace sqmap::apps
