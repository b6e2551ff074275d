// SPDX-License-Identifier: GPL-3.0-or-later
#include "records.hpp"

#include <algorithm>
#include <set>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sqmap/asset/version.hpp"

#include "../common/json_text.hpp"

namespace sqmap::apps {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kSchema = "sqmap.bake/1";

Json record_json(const BakeRecord& record) {
  Json json{{"schema", kSchema},
            {"type", "asset"},
            {"input", record.input},
            {"output", record.output},
            {"outcome", !record.error                                ? "ok"
                        : record.error->status == Status::kCancelled ? "cancelled"
                                                                     : "failed"},
            {"seconds", record.seconds}};
  if (record.error) {
    json["error"] = {{"status", static_cast<int>(record.error->status)},
                     {"id", status_name(record.error->status)},
                     {"exit_code", static_cast<int>(exit_for(record.error->status))},
                     {"finding", record.error->finding},
                     {"remedy", record.error->remedy}};
    return json;
  }
  json["parts"] = record.parts;
  json["segments"] = record.segments;
  json["bytes"] = record.bytes;
  json["r_max_m"] = record.r_max_m;
  json["stopped_by"] = record.stopped_by;
  if (const ErrorRow* row = record.finest()) {
    json["eq35_percent"] = row->eq35_percent;
    json["depth_mean_percent"] = row->depth_mean_percent;
    json["misclassified_3_percent"] = row->misclassified_3_percent;
    json["misclassified_05_percent"] = row->misclassified_05_percent;
  }
  json["mesh"] = to_json(record.mesh);
  json["errors"] = to_json(record.errors);
  json["stages"] = Json::array();
  for (const bake::StageTime& time : record.times)
    json["stages"].push_back({{"stage", time.stage}, {"seconds", time.seconds}});
  return json;
}

std::string percent(double value) {
  return value == value ? fmt::format("{:.3f}", value) : "-";  // NaN: not measured
}

}  // namespace

void BakeRecord::describe(const Asset& asset) {
  parts = static_cast<std::uint32_t>(asset.parts.size());
  std::set<std::uint32_t> names;
  for (const Part& part : asset.parts) names.insert(part.segment);
  segments = static_cast<std::uint32_t>(names.size());
  r_max_m = asset.r_max_m;
  mesh = asset.mesh;
  errors = asset.errors;
}

const ErrorRow* BakeRecord::finest() const {
  const ErrorRow* best = nullptr;
  for (const ErrorRow& row : errors)
    if (row.level == 0 && (best == nullptr || row.layer > best->layer)) best = &row;
  return best;
}

struct RecordWriter::Tail {
  Json assets = Json::array();
  std::size_t ok = 0, failed = 0, cancelled = 0;
  bool has_header = false;
};

RecordWriter::RecordWriter(Console& console, const Options& options)
    : console_(console), options_(options), tail_(std::make_unique<Tail>()) {
  options_.name_width = std::clamp<std::size_t>(options_.name_width, 5, 48);
}
RecordWriter::~RecordWriter() = default;

void RecordWriter::add(const BakeRecord& record) {
  if (!record.error) {
    ++tail_->ok;
  } else if (record.error->status == Status::kCancelled) {
    ++tail_->cancelled;
  } else {
    ++tail_->failed;
  }
  switch (options_.format) {
    case RecordFormat::kText:
      if (!options_.quiet) add_text(record);
      break;
    case RecordFormat::kJson:
      tail_->assets.push_back(record_json(record));
      break;
    case RecordFormat::kNdjson:
      console_.out(json_line(record_json(record)));
      break;
  }
}

void RecordWriter::add_text(const BakeRecord& record) {
  if (record.error && (options_.is_single || record.error->status == Status::kCancelled)) return;
  std::string text;
  if (!tail_->has_header) {
    tail_->has_header = true;
    text += fmt::format("{:<{}} {:>5} {:>8} {:>9} {:>9} {:>9} {:<10} {:>8}\n", "asset", options_.name_width,
                        "parts", "segments", "bytes", "eq35 %", "wrong %", "stopped by", "seconds");
  }
  if (record.error) {
    text += fmt::format("{:<{}} {:>5} {:>8} {:>9} {:>9} {:>9} {:<10} {:>8.2f}\n", record.name,
                        options_.name_width, "-", "-", "-", "-", "-", "failed", record.seconds);
  } else {
    const ErrorRow* row = record.finest();
    text += fmt::format("{:<{}} {:>5} {:>8} {:>9} {:>9} {:>9} {:<10} {:>8.2f}\n", record.name,
                        options_.name_width, record.parts, record.segments, record.bytes,
                        row ? percent(row->eq35_percent) : "-",
                        row ? percent(row->misclassified_3_percent) : "-", record.stopped_by, record.seconds);
  }
  if (options_.profile)
    for (const bake::StageTime& time : record.times)
      text += fmt::format("  {:<20} {:>8.3f} s\n", time.stage, time.seconds);
  console_.out(text);
}

void RecordWriter::finish(double seconds) {
  if (options_.format == RecordFormat::kText) return;
  Json summary{{"schema", kSchema},
               {"type", "summary"},
               {"generator", "sqbake"},
               {"generator_version", kVersion},
               {"ok", tail_->ok},
               {"failed", tail_->failed},
               {"cancelled", tail_->cancelled},
               {"seconds", seconds}};
  if (options_.format == RecordFormat::kNdjson) {
    console_.out(json_line(summary));
    return;
  }
  summary["type"] = "run";
  summary["assets"] = std::move(tail_->assets);
  console_.out(json_text(summary));
}

}  // namespace sqmap::apps
