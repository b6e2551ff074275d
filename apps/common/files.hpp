// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "sqmap/asset/result.hpp"

namespace sqmap::apps {

/// The bytes of a regular file of at most `max_bytes`. Errors: kFileMissing, kFileUnreadable.
Result<std::vector<std::uint8_t>> read_file(const std::filesystem::path& path, std::uint64_t max_bytes);

/// All of standard input, at most `max_bytes`. Errors: kFileUnreadable.
Result<std::vector<std::uint8_t>> read_stdin(std::uint64_t max_bytes);

/// Writes to an open file, however many calls it takes. 0 or errno.
int write_all(int fd, std::span<const std::uint8_t> bytes);

/// Writes a file atomically: a temporary file beside it, synced, renamed when it is complete. Nothing is left
/// on failure. A file that holds these bytes already is not touched, so its time stays and build systems see
/// that nothing changed. Links are followed. Errors: kFileUnwritable.
Outcome write_file(const std::filesystem::path& path, std::span<const std::uint8_t> bytes);
Outcome write_file(const std::filesystem::path& path, const std::string& text);

}  // namespace sqmap::apps
