// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "sqmap/asset/asset.hpp"
#include "sqmap/asset/result.hpp"

namespace sqmap::io {

/// The bytes of a bundle (formats/FORMAT.md). The same asset always gives the same bytes.
/// Errors: kInvalidAsset when the asset breaks a rule of the format; nothing invalid is ever written.
Result<std::vector<std::uint8_t>> encode(const Asset& asset);

/// Writes encode(asset) to `path` atomically: a temporary file in the same folder, synced, then renamed. On
/// any failure the temporary file is removed and an earlier file at `path` stays as it was. A file that
/// already holds exactly these bytes is left untouched. Errors: as encode; kFileUnwritable with the system's
/// reason.
Outcome write(const Asset& asset, const std::filesystem::path& path);

/// What bounds the work a bundle may ask of its reader.
struct ReadLimits {
  std::uint64_t max_file_bytes = std::uint64_t{256} << 20;  ///< larger files are refused before they are read
  std::uint64_t max_decoded_bytes = std::uint64_t{512} << 20;  ///< sum of all declared datasets
};

/// Reading allocates at most kMostMemoryShare * max_decoded_bytes + kMostMemoryBytes, and the file itself.
inline constexpr std::uint64_t kMostMemoryShare = 4;
inline constexpr std::uint64_t kMostMemoryBytes = std::uint64_t{16} << 20;

/// Reads and validates (quick) a bundle held in memory. Safe on hostile bytes: parses the little of HDF5 that
/// bundles use without the HDF5 library, walks a fixed list of names, checks every size before it allocates,
/// follows no link out of the file. Errors: kInvalidAsset with the dataset and the rule; kUnsupportedVersion
/// with both versions.
Result<Asset> decode(std::span<const std::uint8_t> bytes, const ReadLimits& limits = {});

/// decode() of a file. Errors: also kFileMissing, kFileUnreadable.
Result<Asset> read(const std::filesystem::path& path, const ReadLimits& limits = {});

/// Size on disk of one part of a bundle, for sqinfo [bytes].
struct StoredBytes {
  std::string name;         ///< HDF5 path of the dataset
  std::uint64_t stored{};   ///< after compression
  std::uint64_t decoded{};  ///< as declared
};
/// Every dataset of the bundle with its sizes, in file order. Errors: as decode.
Result<std::vector<StoredBytes>> stored_bytes(std::span<const std::uint8_t> bytes);

}  // namespace sqmap::io
