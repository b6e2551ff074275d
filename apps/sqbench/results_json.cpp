// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sqmap/asset/version.hpp"

#include "results.hpp"
#include "work.hpp"

namespace sqmap::bench {
namespace {

using Json = nlohmann::ordered_json;

Json to_json(const Spread& s) { return {{"median", s.median}, {"lower", s.lower}, {"upper", s.upper}}; }

Json to_json(const Machine& m) {
  return {{"cpu", m.cpu},
          {"cores", m.cores},
          {"kernel", m.kernel},
          {"compiler", m.compiler},
          {"instruction_set", m.instruction_set},
          {"libraries", m.libraries},
          {"is_pinned", m.is_pinned}};
}
Json to_json(const ModelRow& r) {
  return {{"model", r.model}, {"vertices", r.vertices},         {"faces", r.faces},
          {"parts", r.parts}, {"bundle_bytes", r.bundle_bytes}, {"r_max_m", r.r_max_m}};
}
Json to_json(const PeerRow& r) {
  return {{"model", r.model},
          {"peer", r.peer},
          {"family", r.family},
          {"bytes", r.bytes},
          {"build_s", r.build_s},
          {"stated_error_percent", r.stated_error_percent},
          {"stated_for", r.stated_is_mean ? "mean" : "every point"}};
}
Json to_json(const WorkRow& r) {
  return {{"model", r.model},
          {"work", r.work},
          {"poses", r.poses},
          {"probe_points", r.probe_points},
          {"contacts_mean", r.contacts_mean},
          {"near_mean", r.near_mean},
          {"deepest_percent", r.deepest_percent},
          {"nearest_percent", r.nearest_percent}};
}
Json to_json(const FrameRow& r) {
  return {{"model", r.model},    {"work", r.work},
          {"peer", r.peer},      {"answers_mean", r.answers_mean},
          {"us", to_json(r.us)}, {"ratio", to_json(r.ratio)}};
}
Json to_json(const AccuracyRow& r) {
  return {{"model", r.model},
          {"peer", r.peer},
          {"shell_percent", r.shell_percent},
          {"points", r.points},
          {"answered_inside_percent", r.answered_inside_percent},
          {"answered_outside_percent", r.answered_outside_percent},
          {"mean_error_percent", r.mean_error_percent},
          {"p95_error_percent", r.p95_error_percent},
          {"max_error_percent", r.max_error_percent},
          {"wrong_side_percent", r.wrong_side_percent},
          {"wrong_feet_percent", r.wrong_feet_percent},
          {"normal_mean_deg", r.normal_mean_deg},
          {"ns", to_json(r.ns)}};
}
Json to_json(const MemoryRow& r) {
  return {{"model", r.model},       {"method", r.method}, {"bytes", r.bytes},
          {"is_paper", r.is_paper}, {"family", r.family}, {"density", r.density}};
}
Json to_json(const BakeRow& r) {
  return {{"model", r.model},     {"method", r.method}, {"target_percent", r.target_percent},
          {"seconds", r.seconds}, {"bytes", r.bytes},   {"eq35_percent", r.eq35_percent},
          {"parts", r.parts}};
}
Json to_json(const ForceRow& r) {
  return {{"model", r.model},
          {"peer", r.peer},
          {"steps", r.steps},
          {"jumps_percent", r.jumps_percent},
          {"worst_jump_percent", r.worst_jump_percent},
          {"mean_change_percent", r.mean_change_percent},
          {"direction_error_deg", r.direction_error_deg},
          {"unanswered_percent", r.unanswered_percent}};
}
Json to_json(const EffectRow& r) {
  return {{"model", r.model}, {"variant", r.variant}, {"us", to_json(r.us)}};
}
Json to_json(const BudgetRow& r) {
  return {{"model", r.model},
          {"family", r.family},
          {"peer", r.peer},
          {"budget_bytes", r.budget_bytes},
          {"bytes", r.bytes},
          {"mean_error_percent", r.mean_error_percent},
          {"depth_error_percent", r.depth_error_percent},
          {"wrong_side_percent", r.wrong_side_percent},
          {"answered_percent", r.answered_percent},
          {"normal_mean_deg", r.normal_mean_deg},
          {"us", to_json(r.us)}};
}
Json to_json(const CurveRow& r) {
  return {{"figure", r.figure}, {"model", r.model}, {"curve", r.curve}, {"x", r.x}, {"y", r.y}};
}
Json to_json(const CheckRow& r) {
  return {{"model", r.model}, {"peer", r.peer},       {"claim", r.claim},
          {"found", r.found}, {"allowed", r.allowed}, {"holds", r.holds}};
}

template <class Row>
Json rows(const std::vector<Row>& rows) {
  Json array = Json::array();
  for (const Row& row : rows) array.push_back(to_json(row));
  return array;
}

/// To six digits: more are noise in every time, and no error is told to a millionth.
void round_numbers(Json& json) {
  if (json.is_structured())
    for (auto& item : json) round_numbers(item);
  if (json.is_number_float() && std::isfinite(json.get<double>()))
    json = std::stod(fmt::format("{:.6g}", json.get<double>()));
}

Json whole(const Results& r) {
  Json json{{"schema", "sqmap.bench/1"},
            {"program", std::string("sqbench ") + kVersion},
            {"command", r.command},
            {"smoke", r.is_smoke},
            {"seed", kSeed},
            {"machine", to_json(r.machine)},
            {"models", rows(r.models)},
            {"peers", rows(r.peers)},
            {"works", rows(r.works)},
            {"frames", rows(r.frames)},
            {"accuracy", rows(r.accuracy)},
            {"memory", rows(r.memory)},
            {"bake", rows(r.bake)},
            {"force", rows(r.force)},
            {"effects", rows(r.effects)},
            {"budgets", rows(r.budgets)},
            {"curves", rows(r.curves)},
            {"checks", rows(r.checks)}};
  round_numbers(json);
  return json;
}

/// A line a row: as small as can be compared by eye.
std::string text_of(const Json& json) {
  std::string text = "{\n";
  for (const auto& [name, value] : json.items()) {
    text += (text.size() > 2 ? ",\n" : "") + Json(name).dump() + ": ";
    if (!value.is_array() || value.empty()) {
      text += value.dump();
      continue;
    }
    text += "[\n";
    for (const Json& row : value) text += (&row == &value.front() ? " " : ",\n ") + row.dump();
    text += "\n]";
  }
  return text + "\n}\n";
}

std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

void csv_lines(const std::string& table, const Json& row, std::string& text) {
  const auto name = [&](const char* key) {
    return row.contains(key) ? csv_field(row[key].get<std::string>()) : std::string();
  };
  const std::string peer = row.contains("method")    ? name("method")
                           : row.contains("variant") ? name("variant")
                           : row.contains("curve")   ? name("curve")
                                                     : name("peer");
  std::string work = row.contains("claim")    ? name("claim")
                     : row.contains("figure") ? name("figure")
                                              : name("work");
  if (row.contains("shell_percent")) work = fmt::format("shell {} %", row["shell_percent"].get<double>());
  const auto line = [&](const std::string& quantity, const Json& value) {
    if (value.is_number() || value.is_boolean())
      text += fmt::format("{},{},{},{},{},{}\n", table, name("model"), work, peer, quantity, value.dump());
  };
  for (const auto& [key, value] : row.items()) {
    if (!value.is_structured()) line(key, value);
    if (value.is_structured())
      for (const auto& [part, number] : value.items()) line(fmt::format("{}.{}", key, part), number);
  }
}

}  // namespace

std::string results_json(const Results& results) { return text_of(whole(results)); }

std::string results_csv(const Results& results) {
  std::string text = "table,model,work,peer,quantity,value\n";
  const Json json = whole(results);
  for (const auto& [table, rows] : json.items())
    if (rows.is_array())
      for (const Json& row : rows) csv_lines(table, row, text);
  return text;
}

}  // namespace sqmap::bench
