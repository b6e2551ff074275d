// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sqmap/asset/result.hpp"

#include "store.hpp"

namespace sqmap::apps {

/// What decides the bytes of a bundle beside the files that are read.
struct BakeIdentity {
  std::string
      options_json;       ///< BakeOptions::to_json(), or any other object that holds all that was asked for
  std::string algorithm;  ///< bake::algorithm_version()
};

/// One asset: this mesh, baked with these options, to this file.
struct CacheRequest {
  std::filesystem::path mesh;
  std::filesystem::path output;
  BakeIdentity identity;
};

/// What a lookup learnt of the inputs; publish() needs it.
struct CacheTicket {
  CacheRequest request;
  std::string mesh_hash;       ///< empty: the mesh could not be read, nothing can be published
  std::int64_t asked_at_ns{};  ///< system clock
};

struct CacheAnswer {
  bool is_hit = false;
  bool output_written =
      false;                ///< a hit that had to write the output: it was missing or other than it must be
  std::string record_json;  ///< of a hit: what publish() was given
  std::string object;       ///< of a hit: content hash of the bundle
  /// Why the asset must be baked, or what the hit found; one line each, for --explain. Never empty.
  std::vector<std::string> reasons;
  CacheTicket ticket;
};

/// A folder of finished bundles, found by what they were made from. Local or shared by many machines: entries
/// appear by rename, nothing is locked, and a reader checks the hash of what it reads. Nothing that is wrong
/// with the folder fails a bake: a damaged entry counts as absent and is removed.
///
/// Paths and times decide nothing. The key covers the bytes of the mesh and of every other file its import
/// read, the mesh's file name (the bundle records it), the options, the algorithm and the format version.
///
/// Thread-safe: it holds no state but the folder's name.
class BundleCache {
 public:
  explicit BundleCache(std::filesystem::path folder) : store_(std::move(folder)) {}

  /// SQMAP_CACHE_DIR, else sqmap in XDG_CACHE_HOME, else .cache/sqmap in HOME; none where all are
  /// unset, or where SQMAP_CACHE_DIR is set to nothing.
  static std::optional<std::filesystem::path> default_folder();

  const std::filesystem::path& folder() const noexcept { return store_.folder(); }

  /// On a hit, `output` holds the bundle afterwards; a file that held it already is left untouched. Files
  /// whose size, times and inode are those of the last time are not read again. Writes a file: hold a
  /// WriteGuard.
  CacheAnswer lookup(const CacheRequest& request) const;

  /// What lookup() would answer now. Writes no output and records nothing; of the cache it removes what is
  /// damaged.
  CacheAnswer peek(const CacheRequest& request) const;

  /// Stores the bundle that was baked to ticket.request.output, after a miss.
  ///
  /// @param side_files   files beside the mesh that its import opened or looked for, also those it missed
  /// @param record_json  an object for whoever hits it; publish only what the key decides: never the
  ///                     outcome of a time limit
  /// Errors: kInvalidMesh when an input changed meanwhile, kInvalidAsset, kFileUnwritable. The output stays
  /// as it is; report the error as a warning.
  Outcome publish(const CacheTicket& ticket, std::span<const std::filesystem::path> side_files,
                  const std::string& record_json) const;

 private:
  struct Found;
  Found find(const CacheRequest& request) const;

  CacheStore store_;
};

}  // namespace sqmap::apps
