// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "asset_records.hpp"

namespace sqmap::apps {

struct ReportOptions {
  std::string title = "sqbake";
  /// At most so many assets are drawn: the worst, then the slowest, then the others in their order.
  std::size_t picture_count = 60;
};

/// In the head of every page: what wrote it.
inline constexpr const char* kPageMark = "<meta name=\"generator\" content=\"sqbake\">";

/// One HTML page that needs no other file and no network: outcomes, failures with their remedies, the largest
/// errors, the slowest assets with their stages, all assets, and pictures of the bundles that can still be
/// read. The same records and bundles give the same page.
std::string report_page(std::span<const AssetRecord> records, const ReportOptions& options);

}  // namespace sqmap::apps
