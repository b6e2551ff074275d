// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sqmap/asset/result.hpp"

namespace sqmap::apps {

/// What reports and merges need of one record of `sqbake bake --format ndjson`.
struct AssetRecord {
  std::string line;  ///< the record itself, without its line feed
  std::string input, output, outcome;
  std::string hash;  ///< of the bundle; empty in records of older versions
  bool is_cached = false;
  double seconds{};
  std::string finding, remedy;       ///< of a failure
  std::vector<std::string> remarks;  ///< why it is degraded, warnings
  std::uint64_t parts{}, bytes{}, faces{};
  double r_max_m = std::numeric_limits<double>::quiet_NaN();
  /// Of the finest level and highest layer, in percent of R_max or of points; NaN where nothing was measured.
  double eq35_percent = r_max_m, depth_mean_percent = r_max_m, wrong_percent = r_max_m;
  std::vector<std::pair<std::string, double>> stages;  ///< seconds by stage

  bool has_bundle() const { return outcome == "ok" || outcome == "degraded"; }
};

struct AssetRecords {
  std::vector<AssetRecord> records;
  bool is_cut_off = false;   ///< the last line has no end: its writer was killed; it is left out
  bool has_summary = false;  ///< the last line is a summary: the run came to its end
};

/// The asset records of an NDJSON text; other records (summaries) are passed over. `source` names it in
/// errors. Errors: kInvalidAsset or, for records of a later version, kUnsupportedVersion, with the number of
/// the line.
Result<AssetRecords> parse_asset_records(std::string_view text, std::string_view source);

/// Room for the records of some 500,000 meshes.
inline constexpr std::uint64_t kLargestRecords_bytes = std::uint64_t{1} << 30;

/// Those of a file; "-" is standard input. Errors: kFileMissing, kFileUnreadable, kInvalidAsset,
/// kUnsupportedVersion.
Result<AssetRecords> read_asset_records(const std::filesystem::path& file);

}  // namespace sqmap::apps
