// SPDX-License-Identifier: GPL-3.0-or-later
#include "dry_run.hpp"

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "../common/json_text.hpp"
#include "../common/printable.hpp"
#include "job_cache.hpp"
#include "record_json.hpp"

namespace sqmap::apps {
namespace {

using Json = nlohmann::ordered_json;

/// Whether a run now would have to bake.
struct Forecast {
  bool is_cached = false;
  std::vector<std::string> reasons;
};

Forecast forecast(const std::optional<BundleCache>& cache, const Job& job) {
  if (!cache) return {false, {kNoCache}};
  CacheAnswer answer = cache->peek(cache_request(job));
  for (std::string& reason : answer.reasons) reason = with_setting_names(std::move(reason));
  return {answer.is_hit && parse_record(answer.record_json), std::move(answer.reasons)};
}

Json plan_json(const Job& job, const std::optional<Forecast>& forecast) {
  Json json{{"schema", kBakeSchema},
            {"type", "plan"},
            {"input", json_name(job.input.string())},
            {"output", json_name(job.output.string())},
            {"input_bytes", job.input_bytes},
            {"settings", Json::object()}};
  for (const auto& [name, value] : job.settings)
    json["settings"][name] = {{"value", value.text}, {"source", value.source}};
  if (forecast) {
    json["cached"] = forecast->is_cached;
    json["reasons"] = forecast->reasons;
  }
  return json;
}

std::string plan_text(const Job& job) {
  std::string text = fmt::format("{} -> {}", job.input.string(), job.output.string());
  for (const auto& [name, value] : job.settings)
    if (value.source != kBuiltIn) text += fmt::format(" {}={}", name, value.text);
  return printable(text) + "\n";
}

}  // namespace

void print_plan(Console& console, const JobList& list, const BakeArguments& arguments) {
  const std::optional<BundleCache> cache = arguments.explain ? open_cache(arguments) : std::nullopt;
  if (arguments.explain && !cache) console.note(kNoCache);
  std::size_t bake_count = 0;
  Json all = Json::array();
  for (const Job& job : list.jobs) {
    std::optional<Forecast> seen;
    if (arguments.explain) seen = forecast(cache, job);
    if (cache)
      for (const std::string& reason : seen->reasons) console.note(job.name + ": " + reason);
    if (!seen || !seen->is_cached) ++bake_count;
    if (arguments.format == RecordFormat::kText) console.out(plan_text(job));
    if (arguments.format == RecordFormat::kNdjson) console.out(json_line(plan_json(job, seen)));
    if (arguments.format == RecordFormat::kJson) all.push_back(plan_json(job, seen));
  }
  if (arguments.format == RecordFormat::kJson)
    console.out(json_text({{"schema", kBakeSchema}, {"type", "plans"}, {"assets", std::move(all)}}));
  if (arguments.explain) console.note(fmt::format("{} of {} would be baked", bake_count, list.jobs.size()));
}

}  // namespace sqmap::apps
