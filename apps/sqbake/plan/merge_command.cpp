// SPDX-License-Identifier: GPL-3.0-or-later
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "../../common/files.hpp"
#include "../../common/json_text.hpp"
#include "../commands.hpp"
#include "../overwrite.hpp"
#include "../report/report_page.hpp"
#include "merge.hpp"

namespace sqmap::apps {
namespace {

using Json = nlohmann::ordered_json;

struct MergeArguments {
  std::vector<std::filesystem::path> records;
  std::filesystem::path plan, output, report;
  bool force = false;
};

struct ReadRecords {
  std::vector<AssetRecord> records;
  std::vector<std::string> unfinished;  ///< files whose runs were stopped before they could sum up
};

Result<ReadRecords> read_records(Console& console, const std::vector<std::filesystem::path>& files) {
  ReadRecords all;
  for (const std::filesystem::path& file : files) {
    Result<AssetRecords> records = read_asset_records(file);
    if (!records) return records.error();
    if (records.value().is_cut_off)
      console.warning(fmt::format("{}: the last record is cut off and left out", file.string()));
    if (!records.value().has_summary) all.unfinished.push_back(file.string());
    for (AssetRecord& record : records.value().records) all.records.push_back(std::move(record));
  }
  return all;
}

std::string merged_text(const MergedRecords& merged, const std::vector<std::string>& unfinished) {
  std::string text;
  for (const AssetRecord& record : merged.records) text += record.line + "\n";
  Json summary{{"schema", "sqmap.merge/1"}, {"type", "summary"}};
  for (const auto& [outcome, count] : merged.outcomes) summary["outcomes"][outcome] = count;
  summary["missing"] = merged.missing;
  summary["unplanned"] = merged.unplanned;
  summary["conflicting"] = merged.conflicting;
  summary["unfinished"] = unfinished;
  summary["duplicates"] = merged.duplicate_count;
  return text + json_line(summary);
}

/// Whether the files to write may be written: none is an input, and what they replace a merge has made.
Outcome check_outputs(const MergeArguments& arguments) {
  const std::filesystem::path &output = arguments.output, &report = arguments.report;
  std::vector<std::filesystem::path> read = arguments.records;
  if (!arguments.plan.empty()) read.push_back(arguments.plan);
  const bool has_file = !output.empty() && output != "-";
  if (has_file) {
    Outcome ok = check_apart("-o", output, "an input", read);
    if (ok) ok = check_merged("-o", output, arguments.force);
    if (!ok) return ok.error();
  }
  if (report.empty()) return Done{};
  if (const Outcome ok = check_apart("--report", report, "an input", read); !ok) return ok.error();
  if (has_file)
    if (const Outcome ok = check_apart("--report", report, "the output", {&output, 1}); !ok)
      return ok.error();
  return check_page("--report", report, arguments.force);
}

Exit run_merge(Console& console, const MergeArguments& arguments) {
  if (const Outcome ok = check_outputs(arguments); !ok) return refuse(console, ok.error());
  std::optional<std::vector<PlannedAsset>> plan;
  if (!arguments.plan.empty()) {
    const Result<std::vector<std::uint8_t>> bytes = read_file(arguments.plan, kLargestRecords_bytes);
    if (!bytes) return refuse(console, bytes.error());
    Result<std::vector<PlannedAsset>> parsed = parse_plan(as_text(bytes.value()), arguments.plan.string());
    if (!parsed) return refuse(console, parsed.error());
    plan = std::move(parsed).value();
  }
  Result<ReadRecords> read = read_records(console, arguments.records);
  if (!read) return refuse(console, read.error());
  auto& [records, unfinished] = read.value();
  if (records.empty() && !plan)
    return refuse(console, {Status::kInvalidAsset,
                            "no record of an asset in " + arguments.records.front().string() +
                                (arguments.records.size() > 1 ? " and the other files" : ""),
                            "give what `sqbake bake --format ndjson` wrote"});
  const MergedRecords merged = merge_records(std::move(records), plan ? &*plan : nullptr);
  // A plan tells whether anything is missing; else what these runs had still to do is not known.
  const bool is_complete = merged.is_complete() && (plan || unfinished.empty());

  if (!is_complete)
    for (const std::string& file : unfinished)
      console.warning(file + ": has no summary; its run was stopped, or goes on");
  for (const std::string& output : merged.missing) console.error(output + ": no record; run its shard again");
  for (const std::string& output : merged.conflicting)
    console.error(output + ": two runs made different bundles; bake it again, with one version of sqbake");
  for (const std::string& output : merged.unplanned)
    console.warning(output + ": has a record, but is not in the plan");
  std::size_t cancelled_count = 0;
  for (const AssetRecord& record : merged.records) {
    if (record.has_bundle()) continue;
    // A run that is stopped early leaves thousands of these, and they would hide what failed.
    if (record.outcome == "cancelled" && cancelled_count++ > 0) continue;
    console.error(fmt::format("{}: {}: {}", record.input, record.outcome, record.finding));
  }
  if (cancelled_count > 1)
    console.error(fmt::format("{} more were cancelled; run their shards again", cancelled_count - 1));

  const std::string text = merged_text(merged, unfinished);
  if (arguments.output.empty() || arguments.output == "-") {
    console.out(text);
  } else if (const Outcome written = write_file(arguments.output, text); !written) {
    return refuse(console, written.error());
  }
  if (!arguments.report.empty())
    if (const Outcome written = write_file(arguments.report, report_page(merged.records, {})); !written)
      return refuse(console, written.error());
  return is_complete ? Exit::kOk : Exit::kSomeFailed;
}

}  // namespace

std::function<Exit(Console&)> declare_merge(CLI::App& app) {
  const auto args = std::make_shared<MergeArguments>();
  app.description(
      "Joins the records of several runs, such as the shards of one: one record a bundle, the best and "
      "latest. Says\n"
      "which assets of the plan have none, and for which two runs disagree; then, or where an asset has no "
      "bundle,\n"
      "it exits with 1. Without a plan, it also does where a run has not come to its end.\n"
      "\n"
      "Examples:\n"
      "  sqbake merge shard-*.ndjson -o all.ndjson --plan plan.ndjson --report all.html\n");
  app.add_option("RECORDS", args->records, "What `sqbake bake --format ndjson` wrote, the oldest first")
      ->required();
  app.add_option("-o,--output", args->output, "Joined records (default: standard output)")
      ->type_name("FILE.ndjson");
  app.add_option("--plan", args->plan, "What `sqbake plan --format ndjson` wrote: all that must be there")
      ->type_name("FILE.ndjson");
  app.add_option("--report", args->report, "Also write the page that `sqbake report` makes")
      ->type_name("FILE.html");
  app.add_flag("--force", args->force, "Overwrite files that no merge has made, too");
  return [args](Console& console) { return run_merge(console, *args); };
}

}  // namespace sqmap::apps
