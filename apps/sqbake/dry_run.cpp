// SPDX-License-Identifier: GPL-3.0-or-later
#include "dry_run.hpp"

#include <string>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "../common/json_text.hpp"
#include "../common/printable.hpp"
#include "record_json.hpp"

namespace sqmap::apps {
namespace {

using Json = nlohmann::ordered_json;

Json plan_json(const Job& job) {
  Json json{{"schema", kBakeSchema},          {"type", "plan"},
            {"input", job.input.string()},    {"output", job.output.string()},
            {"input_bytes", job.input_bytes}, {"settings", Json::object()}};
  for (const auto& [name, value] : job.settings)
    json["settings"][name] = {{"value", value.text}, {"source", value.source}};
  return json;
}

std::string plan_text(const Job& job) {
  std::string text = fmt::format("{} -> {}", job.input.string(), job.output.string());
  for (const auto& [name, value] : job.settings)
    if (value.source != kBuiltIn) text += fmt::format(" {}={}", name, value.text);
  return printable(text) + "\n";
}

}  // namespace

void print_plan(Console& console, const JobList& list, RecordFormat format) {
  Json all = Json::array();
  for (const Job& job : list.jobs) {
    if (format == RecordFormat::kText) console.out(plan_text(job));
    if (format == RecordFormat::kNdjson) console.out(json_line(plan_json(job)));
    if (format == RecordFormat::kJson) all.push_back(plan_json(job));
  }
  if (format == RecordFormat::kJson)
    console.out(json_text({{"schema", kBakeSchema}, {"type", "plans"}, {"assets", std::move(all)}}));
}

}  // namespace sqmap::apps
