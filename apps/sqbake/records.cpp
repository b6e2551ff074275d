// SPDX-License-Identifier: GPL-3.0-or-later
#include "records.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sqmap/asset/version.hpp"

#include "../common/json_text.hpp"
#include "../common/printable.hpp"
#include "record_json.hpp"

namespace sqmap::apps {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::array<const char*, kVerdictCount> kVerdictNames{"ok",     "degraded", "failed",   "timeout",
                                                               "memory", "crashed",  "cancelled"};

std::string percent(double value) {
  return value == value ? fmt::format("{:.3f}", value) : "-";  // NaN: not measured
}

}  // namespace

const char* verdict_name(Verdict verdict) noexcept {
  return kVerdictNames[static_cast<std::size_t>(verdict)];
}

Exit exit_of(const BakeRecord& record) noexcept {
  switch (record.verdict) {
    case Verdict::kOk:
    case Verdict::kDegraded:
      return Exit::kOk;
    case Verdict::kTimeout:
    case Verdict::kMemory:
      return Exit::kLimit;
    case Verdict::kCrashed:
      return Exit::kCrashed;
    case Verdict::kFailed:
    case Verdict::kCancelled:
      break;
  }
  return record.error ? exit_for(record.error->status) : Exit::kInternal;
}

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
};

RecordWriter::RecordWriter(Console& console, const Options& options)
    : console_(console), options_(options), tail_(std::make_unique<Tail>()) {
  options_.name_width = std::clamp<std::size_t>(options_.name_width, 5, 48);
}
RecordWriter::~RecordWriter() = default;

void RecordWriter::add(const BakeRecord& record) {
  ++counts_[static_cast<std::size_t>(record.verdict)];
  if (record.is_cached) ++cached_;
  switch (options_.format) {
    case RecordFormat::kText:
      if (!options_.quiet) add_text(record);
      break;
    case RecordFormat::kJson:
      tail_->assets.push_back(Json::parse(record_line(record)));
      break;
    case RecordFormat::kNdjson:
      console_.out(record_line(record));
      break;
  }
}

void RecordWriter::add_text(const BakeRecord& record) {
  if (!record.has_bundle() && (options_.is_single || record.verdict == Verdict::kCancelled)) return;
  const std::string name = printable(record.name);
  std::string text;
  if (!has_header_) {
    has_header_ = true;
    text += fmt::format("{:<{}} {:>5} {:>8} {:>9} {:>9} {:>9} {:<10} {:>8}\n", "asset", options_.name_width,
                        "parts", "segments", "bytes", "eq35 %", "wrong %", "stopped by", "seconds");
  }
  if (!record.has_bundle()) {
    text += fmt::format("{:<{}} {:>5} {:>8} {:>9} {:>9} {:>9} {:<10} {:>8.2f}\n", name, options_.name_width,
                        "-", "-", "-", "-", "-", verdict_name(record.verdict), record.seconds);
  } else {
    const ErrorRow* row = record.finest();
    text += fmt::format("{:<{}} {:>5} {:>8} {:>9} {:>9} {:>9} {:<10} {:>8}\n", name, options_.name_width,
                        record.parts, record.segments, record.bytes, row ? percent(row->eq35_percent) : "-",
                        row ? percent(row->misclassified_3_percent) : "-", record.stopped_by,
                        record.is_cached ? "cached" : fmt::format("{:.2f}", record.seconds));
  }
  if (options_.profile)
    for (const bake::StageTime& time : record.times)
      text += fmt::format("  {:<20} {:>8.3f} s\n", time.stage, time.seconds);
  console_.out(text);
}

void RecordWriter::finish(double seconds) {
  if (options_.format == RecordFormat::kText) return;
  Json summary{
      {"schema", kBakeSchema}, {"type", "summary"}, {"generator", "sqbake"}, {"generator_version", kVersion}};
  for (std::size_t k = 0; k < kVerdictCount; ++k) summary[kVerdictNames[k]] = counts_[k];
  summary["cached"] = cached_;
  summary["seconds"] = seconds;
  if (options_.format == RecordFormat::kNdjson) {
    console_.out(json_line(summary));
    return;
  }
  summary["type"] = "run";
  summary["assets"] = std::move(tail_->assets);
  console_.out(json_text(summary));
}

}  // namespace sqmap::apps
