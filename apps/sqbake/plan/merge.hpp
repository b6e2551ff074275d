// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "sqmap/asset/result.hpp"

#include "../report/asset_records.hpp"

namespace sqmap::apps {

/// An asset that must have a record.
struct PlannedAsset {
  std::string input, output;
};
/// Records of type "plan", from `sqbake plan` or `sqbake bake -n`. `source` names the text in errors.
/// Errors: kInvalidAsset with the number of the line, or where it names no asset.
Result<std::vector<PlannedAsset>> parse_plan(std::string_view text, std::string_view source);

struct MergedRecords {
  std::vector<AssetRecord> records;             ///< one an output; in the plan's order, else sorted by output
  std::vector<std::string> missing;             ///< outputs of the plan without a record
  std::vector<std::string> unplanned;           ///< outputs with a record, but not in the plan
  std::vector<std::string> conflicting;         ///< outputs whose records tell of different bundles
  std::size_t duplicate_count{};                ///< records that another one made unnecessary
  std::map<std::string, std::size_t> outcomes;  ///< of `records`

  /// Every asset has a bundle, and no two runs disagree.
  bool is_complete() const;
};

/// Joins the records of several runs. Of two for the same output, one with a bundle counts more than one
/// without, and the later more than the earlier: a run that was repeated replaces the one that failed. Two
/// records with bundles are a conflict where the hashes of these differ; without hashes, where anything does
/// but times and the use of the cache.
MergedRecords merge_records(std::vector<AssetRecord> records, const std::vector<PlannedAsset>* plan);

}  // namespace sqmap::apps
