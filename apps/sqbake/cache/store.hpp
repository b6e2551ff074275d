// SPDX-License-Identifier: GPL-3.0-or-later
//
// The folder of a cache:
//
//     CACHEDIR.TAG         tells backup programs to leave it out (bford.info/cachedir)
//     v1/results/ab/KEY    what a bake gave: JSON, names an object
//     v1/objects/cd/HASH   a bundle, named by its content hash
//     v1/outputs/ef/HASH   the last bake of an output, named by the hash of its path: JSON
//
// Files appear by rename and never change; objects before the results that name them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sqmap/asset/result.hpp"

#include "content_hash.hpp"

namespace sqmap::apps {

/// A file that a bake read, or looked for and missed.
struct BakeInput {
  std::string name;                ///< relative to the mesh's folder; the mesh itself: its file name
  std::string hash;                ///< empty: there was no such file
  std::optional<FileStamp> stamp;  ///< of a settled file
  friend bool operator==(const BakeInput&, const BakeInput&) = default;
};

/// What is filed under a key: either the bundle, or, where the import read more than the mesh, the names of
/// those files, whose contents lead to the key of the bundle.
struct CacheResult {
  std::vector<std::string> side_files;
  std::string object;  ///< content hash of the bundle; empty with side_files
  std::string record_json;
};

/// The last bake of an output on record: what --explain compares with, and what saves reading files again.
struct OutputRecord {
  std::vector<BakeInput> inputs;  ///< the mesh first
  std::string options_json, algorithm, format;
  std::string object;                     ///< content hash of the bundle
  std::optional<FileStamp> bundle_stamp;  ///< of the output, once settled
  friend bool operator==(const OutputRecord&, const OutputRecord&) = default;
};

/// Reads and writes the files of a cache. A file that cannot be used counts as absent and is removed.
class CacheStore {
 public:
  explicit CacheStore(std::filesystem::path folder) : folder_(std::move(folder)) {}

  const std::filesystem::path& folder() const noexcept { return folder_; }
  std::filesystem::path results() const { return folder_ / "v1" / "results"; }
  std::filesystem::path objects() const { return folder_ / "v1" / "objects"; }
  std::filesystem::path outputs() const { return folder_ / "v1" / "outputs"; }

  std::optional<CacheResult> result(const std::string& key) const;
  /// The bytes, checked against their hash.
  std::optional<std::vector<std::uint8_t>> object(const std::string& hash) const;
  std::optional<OutputRecord> output_record(const std::filesystem::path& output) const;

  /// Errors: kFileUnwritable.
  Outcome put_result(const std::string& key, const CacheResult& result) const;
  Outcome put_object(const std::string& hash, std::span<const std::uint8_t> bytes) const;
  Outcome put_output_record(const std::filesystem::path& output, const OutputRecord& record) const;

  /// Says that a result was of use, for gc; at most once an hour reaches the disk.
  void mark_used(const std::string& key) const;

 private:
  Outcome put(const std::filesystem::path& path, std::span<const std::uint8_t> bytes) const;

  std::filesystem::path folder_;
};

/// The text of a result file, decoded; empty when it is damaged.
std::optional<CacheResult> parse_result(std::span<const std::uint8_t> bytes);

}  // namespace sqmap::apps
