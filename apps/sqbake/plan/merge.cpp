// SPDX-License-Identifier: GPL-3.0-or-later
#include "merge.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace sqmap::apps {
namespace {

using Json = nlohmann::json;

/// What two runs must agree on that tell of no hash.
Json lasting(const AssetRecord& record) {
  Json json = Json::parse(record.line, nullptr, false);
  for (const char* name : {"seconds", "cached", "stages", "warnings", "hash"}) json.erase(name);
  return json;
}

bool tell_of_one_bundle(const AssetRecord& a, const AssetRecord& b) {
  if (!a.hash.empty() && !b.hash.empty()) return a.hash == b.hash;
  return lasting(a) == lasting(b);
}

}  // namespace

Result<std::vector<PlannedAsset>> parse_plan(std::string_view text, std::string_view source) {
  std::vector<PlannedAsset> plan;
  for (std::size_t start = 0, line = 1; start < text.size(); ++line) {
    const std::size_t end = std::min(text.find('\n', start), text.size());
    const Json json = Json::parse(text.substr(start, end - start), nullptr, false);
    start = end + 1;
    const auto word = [&](const char* name) {
      const auto found = json.is_object() ? json.find(name) : json.end();
      return json.is_object() && found != json.end() && found->is_string() ? found->get<std::string>() : "";
    };
    if (word("type") != "plan" || word("output").empty())
      return Error{Status::kInvalidAsset, fmt::format("{}:{}: no record of a plan", source, line),
                   "give what `sqbake plan --format ndjson` wrote"};
    plan.push_back({word("input"), word("output")});
  }
  if (plan.empty())
    return Error{Status::kInvalidAsset, fmt::format("{}: names no asset", source),
                 "give what `sqbake plan --format ndjson` wrote"};
  return plan;
}

bool MergedRecords::is_complete() const {
  return missing.empty() && conflicting.empty() &&
         std::ranges::all_of(records, [](const AssetRecord& record) { return record.has_bundle(); });
}

MergedRecords merge_records(std::vector<AssetRecord> records, const std::vector<PlannedAsset>* plan) {
  MergedRecords merged;
  std::map<std::string, AssetRecord> by_output;
  std::set<std::string> conflicting;
  for (AssetRecord& record : records) {
    const auto [entry, is_new] = by_output.try_emplace(record.output, record);
    if (is_new) continue;
    ++merged.duplicate_count;
    AssetRecord& held = entry->second;
    if (held.has_bundle() && record.has_bundle() && !tell_of_one_bundle(held, record))
      conflicting.insert(record.output);
    if (record.has_bundle() || !held.has_bundle()) held = std::move(record);
  }
  merged.conflicting.assign(conflicting.begin(), conflicting.end());

  std::set<std::string> planned;
  if (plan != nullptr) {
    for (const PlannedAsset& asset : *plan) {
      if (!planned.insert(asset.output).second) continue;
      const auto found = by_output.find(asset.output);
      if (found == by_output.end()) {
        merged.missing.push_back(asset.output);
      } else {
        merged.records.push_back(std::move(found->second));
      }
    }
  }
  for (auto& [output, record] : by_output) {
    if (planned.contains(output)) continue;
    if (plan != nullptr) merged.unplanned.push_back(output);
    merged.records.push_back(std::move(record));
  }
  for (const AssetRecord& record : merged.records) ++merged.outcomes[record.outcome];
  return merged;
}

}  // namespace sqmap::apps
