// SPDX-License-Identifier: GPL-3.0-or-later
#include "asset_records.hpp"

#include <charconv>
#include <optional>
#include <system_error>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "../../common/files.hpp"
#include "../bake_schema.hpp"

namespace sqmap::apps {
namespace {

using Json = nlohmann::json;

const Json& member(const Json& json, const char* name) {
  static const Json kNone;
  const auto found = json.is_object() ? json.find(name) : json.end();
  return found == json.end() ? kNone : *found;
}

std::string text(const Json& json, const char* name) {
  const Json& value = member(json, name);
  return value.is_string() ? value.get<std::string>() : "";
}

double number(const Json& json, const char* name) {
  const Json& value = member(json, name);
  return value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
}

std::optional<unsigned> number_behind(std::string_view prefix, std::string_view text) {
  text.remove_prefix(prefix.size());
  unsigned value = 0;
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
  return problem == std::errc() && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

std::uint64_t count(const Json& json, const char* name) {
  const Json& value = member(json, name);
  return value.is_number_unsigned() ? value.get<std::uint64_t>() : 0;
}

AssetRecord record_of(const Json& json, std::string_view line) {
  AssetRecord record;
  record.line = line;
  record.input = text(json, "input");
  record.output = text(json, "output");
  record.outcome = text(json, "outcome");
  record.hash = text(json, "hash");
  const Json& cached = member(json, "cached");
  record.is_cached = cached.is_boolean() && cached.get<bool>();
  record.seconds = number(json, "seconds");
  record.finding = text(member(json, "error"), "finding");
  record.remedy = text(member(json, "error"), "remedy");
  for (const Json& item : member(json, "degradations")) record.remarks.push_back(text(item, "finding"));
  for (const Json& item : member(json, "warnings"))
    if (item.is_string()) record.remarks.push_back(item.get<std::string>());
  record.parts = count(json, "parts");
  record.bytes = count(json, "bytes");
  record.faces = count(member(json, "mesh"), "faces");
  record.r_max_m = number(json, "r_max_m");
  record.eq35_percent = number(json, "eq35_percent");
  record.depth_mean_percent = number(json, "depth_mean_percent");
  record.wrong_percent = number(json, "misclassified_3_percent");
  for (const Json& stage : member(json, "stages"))
    record.stages.emplace_back(text(stage, "stage"), number(stage, "seconds"));
  return record;
}

}  // namespace

Result<AssetRecords> parse_asset_records(std::string_view all, std::string_view source) {
  AssetRecords result;
  for (std::size_t start = 0, number_of_line = 1; start < all.size(); ++number_of_line) {
    const std::size_t end = all.find('\n', start);
    if (end == std::string_view::npos) {
      result.is_cut_off = true;
      result.has_summary = false;
      break;
    }
    const std::string_view line = all.substr(start, end - start);
    start = end + 1;
    if (line.find_first_not_of(" \t\r") == std::string_view::npos) continue;
    const Json json = Json::parse(line, nullptr, false);
    const std::string schema = text(json, "schema");
    if (!schema.starts_with("sqmap."))
      return Error{Status::kInvalidAsset,
                   fmt::format("{}:{}: no record of sqbake, must be an object with a schema sqmap.*", source,
                               number_of_line),
                   "give what `sqbake bake --format ndjson` wrote"};
    result.has_summary = text(json, "type") == "summary";
    if (!schema.starts_with(kBakeSchemaName)) continue;
    if (const std::optional<unsigned> version = number_behind(kBakeSchemaName, schema);
        !version || *version > kBakeSchemaVersion)
      return Error{Status::kUnsupportedVersion,
                   fmt::format("{}:{}: a record of {}, this sqbake knows versions up to {}", source,
                               number_of_line, schema, kBakeSchemaVersion),
                   "use the sqbake that wrote it, or a newer one"};
    if (text(json, "type") != "asset") continue;
    AssetRecord record = record_of(json, line);
    if (record.input.empty() || record.output.empty() || record.outcome.empty())
      return Error{Status::kInvalidAsset,
                   fmt::format("{}:{}: the record of an asset without input, output or outcome", source,
                               number_of_line),
                   "give what `sqbake bake --format ndjson` wrote"};
    result.records.push_back(std::move(record));
  }
  return result;
}

Result<AssetRecords> read_asset_records(const std::filesystem::path& file) {
  const Result<std::vector<std::uint8_t>> bytes =
      file == "-" ? read_stdin(kLargestRecords_bytes) : read_file(file, kLargestRecords_bytes);
  if (!bytes) return bytes.error();
  return parse_asset_records(as_text(bytes.value()), file.string());
}

}  // namespace sqmap::apps
