// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "sqmap/asset/result.hpp"

namespace sqmap::io {

/// All bytes of a regular file.
/// Errors: kFileMissing; kFileUnreadable with the system's reason; kInvalidAsset for more than max_bytes.
Result<std::vector<std::uint8_t>> read_file(const std::filesystem::path& path, std::uint64_t max_bytes);

/// Makes `path` hold exactly `bytes`: written to a temporary file in the same folder, synced, renamed. A file
/// that holds them already is not touched; a symbolic link is followed. Errors: kFileUnwritable; `path` is
/// then as before.
Outcome replace_file(const std::filesystem::path& path, std::span<const std::uint8_t> bytes);

}  // namespace sqmap::io
