// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sqmap/asset/result.hpp"

#include "store.hpp"

namespace sqmap::apps {

struct CacheStatistics {
  std::uint64_t results{}, objects{}, outputs{};       ///< files of each kind
  std::uint64_t bytes{};                               ///< of all of them
  std::uint64_t temporary_files{};                     ///< being written, or left behind by a crash
  std::optional<std::chrono::seconds> oldest, newest;  ///< since a result was last of use
};

struct CacheVerification {
  std::uint64_t results{}, objects{};  ///< looked at
  std::vector<std::string> damaged;    ///< what was wrong, one line each; these files are gone now, but for
  std::uint64_t refused{};             ///< these, which could not be removed
};

struct CollectLimits {
  std::optional<std::uint64_t> max_bytes;
  std::optional<std::chrono::seconds> max_age;  ///< since a result was last of use
};

struct CacheCollection {
  std::uint64_t removed_results{}, removed_objects{}, removed_outputs{}, removed_temporary_files{};
  std::uint64_t refused{};  ///< files that should go, but could not be removed
  std::uint64_t bytes_before{}, bytes_after{};
};

// A cache that is in use may change meanwhile: a file that vanishes is passed over.
// Errors of all three: kFileMissing, kFileUnreadable.

Result<CacheStatistics> cache_statistics(const CacheStore& store);

/// Reads everything; removes results that cannot be read or whose bundle is missing, and bundles whose bytes
/// are not those of their name.
Result<CacheVerification> verify_cache(const CacheStore& store);

/// Removes what was of no use for too long, then the longest unused results until the rest fits, each with
/// its bundle when no other result names that. Temporary files and bundles that no result ever named go only
/// when they are older than an hour: somebody may be writing them.
Result<CacheCollection> collect_cache(const CacheStore& store, const CollectLimits& limits);

}  // namespace sqmap::apps
