// SPDX-License-Identifier: GPL-3.0-or-later
#include "record_json.hpp"

#include <limits>
#include <stdexcept>

#include <nlohmann/json.hpp>

#include "../common/json_text.hpp"

namespace sqmap::apps {
namespace {

using Json = nlohmann::ordered_json;

Json body_of(const BakeRecord& record) {
  Json json{{"parts", record.parts}, {"segments", record.segments}, {"bytes", record.bytes},
            {"hash", record.hash},   {"r_max_m", record.r_max_m},   {"stopped_by", record.stopped_by}};
  if (const ErrorRow* row = record.finest()) {
    json["eq35_percent"] = row->eq35_percent;
    json["depth_mean_percent"] = row->depth_mean_percent;
    json["misclassified_3_percent"] = row->misclassified_3_percent;
    json["misclassified_05_percent"] = row->misclassified_05_percent;
  }
  json["mesh"] = to_json(record.mesh);
  json["errors"] = to_json(record.errors);
  json["fits"] = Json::array();
  for (const bake::PartFit& fit : record.fits)
    json["fits"].push_back({{"iterations", fit.iterations}, {"stop", bake::fit_stop_name(fit.stop)}});
  json["stages"] = Json::array();
  for (const bake::StageTime& time : record.times)
    json["stages"].push_back({{"stage", time.stage}, {"seconds", time.seconds}});
  return json;
}

double number_or_nan(const Json& json, const char* key) {
  const Json& value = json.at(key);
  return value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>();
}

MeshRecord mesh_from(const Json& json) {
  MeshRecord mesh;
  const auto take = [&](const char* key, std::uint32_t& value) { value = json.at(key).get<std::uint32_t>(); };
  take("source_vertices", mesh.source_vertices);
  take("source_faces", mesh.source_faces);
  take("vertices", mesh.vertices);
  take("faces", mesh.faces);
  take("components", mesh.components);
  take("welded_vertices", mesh.welded_vertices);
  take("degenerate_faces", mesh.degenerate_faces);
  take("duplicate_faces", mesh.duplicate_faces);
  take("flipped_faces", mesh.flipped_faces);
  take("filled_holes", mesh.filled_holes);
  take("boundary_edges", mesh.boundary_edges);
  take("non_manifold_edges", mesh.non_manifold_edges);
  mesh.is_closed = json.at("is_closed").get<bool>();
  mesh.volume_m3 = number_or_nan(json, "volume_m3");
  return mesh;
}

ErrorRow row_from(const Json& json) {
  ErrorRow row;
  row.level = json.at("level").get<std::uint32_t>();
  row.layer = json.at("layer").get<std::uint32_t>();
  row.eq35_percent = number_or_nan(json, "eq35_percent");
  row.depth_mean_percent = number_or_nan(json, "depth_mean_percent");
  row.depth_p95_percent = number_or_nan(json, "depth_p95_percent");
  row.misclassified_3_percent = number_or_nan(json, "misclassified_3_percent");
  row.misclassified_05_percent = number_or_nan(json, "misclassified_05_percent");
  row.samples_3 = json.at("samples_3").get<std::uint32_t>();
  row.samples_05 = json.at("samples_05").get<std::uint32_t>();
  row.samples_depth = json.at("samples_depth").get<std::uint32_t>();
  return row;
}

bake::FitStop stop_from(const std::string& name) {
  using bake::FitStop;
  for (const FitStop stop : {FitStop::kPoint, FitStop::kGain, FitStop::kNoDescent, FitStop::kIterations})
    if (name == bake::fit_stop_name(stop)) return stop;
  throw std::invalid_argument("stop " + name);
}

void take_body(const Json& json, BakeRecord& record) {
  record.parts = json.at("parts").get<std::uint32_t>();
  record.segments = json.at("segments").get<std::uint32_t>();
  record.bytes = json.at("bytes").get<std::uint64_t>();
  record.hash = json.value("hash", "");
  record.r_max_m = json.at("r_max_m").get<double>();
  record.stopped_by = json.at("stopped_by").get<std::string>();
  record.mesh = mesh_from(json.at("mesh"));
  for (const Json& row : json.at("errors")) record.errors.push_back(row_from(row));
  for (const Json& fit : json.at("fits"))
    record.fits.push_back({fit.at("iterations").get<int>(), stop_from(fit.at("stop").get<std::string>())});
  for (const Json& stage : json.at("stages"))
    record.times.push_back({stage.at("stage").get<std::string>(), stage.at("seconds").get<double>()});
}

Verdict verdict_from(const std::string& name) {
  for (std::size_t k = 0; k < kVerdictCount; ++k)
    if (name == verdict_name(static_cast<Verdict>(k))) return static_cast<Verdict>(k);
  throw std::invalid_argument("outcome " + name);
}

BakeRecord record_from(const Json& json) {
  BakeRecord record;
  record.input = json.at("input").get<std::string>();
  record.output = json.at("output").get<std::string>();
  record.verdict = verdict_from(json.at("outcome").get<std::string>());
  record.seconds = json.at("seconds").get<double>();
  record.is_cached = json.at("cached").get<bool>();
  for (const Json& item : json.at("degradations"))
    record.degradations.push_back({item.at("id").get<std::string>(), item.at("finding").get<std::string>()});
  record.warnings = json.at("warnings").get<std::vector<std::string>>();
  if (const auto error = json.find("error"); error != json.end())
    record.error = Error{static_cast<Status>(error->at("status").get<int>()),
                         error->at("finding").get<std::string>(), error->at("remedy").get<std::string>()};
  if (record.has_bundle()) take_body(json, record);
  return record;
}

}  // namespace

std::string record_line(const BakeRecord& record) {
  Json json{{"schema", kBakeSchema},
            {"type", "asset"},
            {"input", json_name(record.input)},
            {"output", json_name(record.output)},
            {"outcome", verdict_name(record.verdict)},
            {"seconds", record.seconds},
            {"cached", record.is_cached}};
  json["degradations"] = Json::array();
  for (const Degradation& item : record.degradations)
    json["degradations"].push_back({{"id", item.id}, {"finding", item.finding}});
  json["warnings"] = record.warnings;
  if (record.error)
    json["error"] = {{"status", static_cast<int>(record.error->status)},
                     {"id", status_name(record.error->status)},
                     {"exit_code", static_cast<int>(exit_of(record))},
                     {"finding", record.error->finding},
                     {"remedy", record.error->remedy}};
  if (record.has_bundle()) json.update(body_of(record));
  return json_line(json);
}

Result<BakeRecord> parse_record(std::string_view line) {
  try {
    return record_from(Json::parse(line));
  } catch (const std::exception& problem) {
    return Error{Status::kBadOption, std::string("no record of an asset: ") + problem.what(), ""};
  }
}

}  // namespace sqmap::apps
