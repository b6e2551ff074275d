// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "sqmap/asset/result.hpp"

#include "asset_records.hpp"

namespace sqmap::apps {

struct ReportOptions {
  std::string title = "sqbake";
  /// At most so many assets are drawn: the worst, then the slowest, then the others in their order.
  std::size_t picture_count = 60;
};

/// One HTML page that needs no other file and no network: outcomes, failures with their remedies, the largest
/// errors, the slowest assets with their stages, all assets, and pictures of the bundles that can still be
/// read. The same records and bundles give the same page.
std::string report_page(std::span<const AssetRecord> records, const ReportOptions& options);

/// Writes the page of NDJSON records, as `sqbake bake --format ndjson` prints them.
/// Errors: kInvalidAsset, kFileUnwritable.
Outcome write_report(std::string_view ndjson, const std::filesystem::path& file,
                     const ReportOptions& options);

}  // namespace sqmap::apps
