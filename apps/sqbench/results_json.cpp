// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sqmap/asset/version.hpp"

#include "results.hpp"
#include "work.hpp"

namespace sqmap::bench {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kSchema = "sqmap.bench/1";

// What a row holds, once for writing and for reading: `visit` takes a name and what it names,
// `visit.optional` what results of before it was told lack.
template <class Visit>
void fields(Spread& s, Visit& visit) {
  visit("median", s.median);
  visit("lower", s.lower);
  visit("upper", s.upper);
  visit.optional("count", s.count);
}
template <class Visit>
void fields(Machine& m, Visit& visit) {
  visit("cpu", m.cpu);
  visit("cores", m.cores);
  visit("kernel", m.kernel);
  visit("compiler", m.compiler);
  visit("instruction_set", m.instruction_set);
  visit("libraries", m.libraries);
  visit("is_pinned", m.is_pinned);
}
template <class Visit>
void fields(ModelRow& r, Visit& visit) {
  visit("model", r.model);
  visit("vertices", r.vertices);
  visit("faces", r.faces);
  visit("parts", r.parts);
  visit("bundle_bytes", r.bundle_bytes);
  visit("r_max_m", r.r_max_m);
}
template <class Visit>
void fields(PeerRow& r, Visit& visit) {
  visit("model", r.model);
  visit("peer", r.peer);
  visit("family", r.family);
  visit("bytes", r.bytes);
  visit("build_s", r.build_s.median);
  visit.optional("build_s_spread", r.build_s);
  visit("stated_error_percent", r.stated_error_percent);
  std::string stated_for = r.stated_is_mean ? "mean" : "every point";
  visit("stated_for", stated_for);
  r.stated_is_mean = stated_for == "mean";
}
template <class Visit>
void fields(WorkRow& r, Visit& visit) {
  visit("model", r.model);
  visit("work", r.work);
  visit("poses", r.poses);
  visit("probe_points", r.probe_points);
  visit("contacts_mean", r.contacts_mean);
  visit("near_mean", r.near_mean);
  visit("deepest_percent", r.deepest_percent);
  visit("nearest_percent", r.nearest_percent);
}
template <class Visit>
void fields(FrameRow& r, Visit& visit) {
  visit("model", r.model);
  visit("work", r.work);
  visit("peer", r.peer);
  visit("answers_mean", r.answers_mean);
  visit("us", r.us);
  visit("ratio", r.ratio);
}
template <class Visit>
void fields(AccuracyRow& r, Visit& visit) {
  visit("model", r.model);
  visit("peer", r.peer);
  visit("shell_percent", r.shell_percent);
  visit("points", r.points);
  visit("answered_inside_percent", r.answered_inside_percent);
  visit("answered_outside_percent", r.answered_outside_percent);
  visit("mean_error_percent", r.mean_error_percent);
  visit("p95_error_percent", r.p95_error_percent);
  visit("max_error_percent", r.max_error_percent);
  visit("wrong_side_percent", r.wrong_side_percent);
  visit("wrong_feet_percent", r.wrong_feet_percent);
  visit("normal_mean_deg", r.normal_mean_deg);
  visit("ns", r.ns);
}
template <class Visit>
void fields(MemoryRow& r, Visit& visit) {
  visit("model", r.model);
  visit("method", r.method);
  visit("bytes", r.bytes);
  visit("is_paper", r.is_paper);
  visit("family", r.family);
  visit("density", r.density);
}
template <class Visit>
void fields(BakeRow& r, Visit& visit) {
  visit("model", r.model);
  visit("method", r.method);
  visit("target_percent", r.target_percent);
  visit("seconds", r.seconds.median);
  visit.optional("seconds_spread", r.seconds);
  visit("bytes", r.bytes);
  visit("eq35_percent", r.eq35_percent);
  visit("parts", r.parts);
}
template <class Visit>
void fields(ForceRow& r, Visit& visit) {
  visit("model", r.model);
  visit("peer", r.peer);
  visit("steps", r.steps);
  visit("jumps_percent", r.jumps_percent);
  visit("worst_jump_percent", r.worst_jump_percent);
  visit("mean_change_percent", r.mean_change_percent);
  visit("direction_error_deg", r.direction_error_deg);
  visit("unanswered_percent", r.unanswered_percent);
}
template <class Visit>
void fields(EffectRow& r, Visit& visit) {
  visit("model", r.model);
  visit("variant", r.variant);
  visit("us", r.us);
}
template <class Visit>
void fields(BudgetRow& r, Visit& visit) {
  visit("model", r.model);
  visit("family", r.family);
  visit("peer", r.peer);
  visit("budget_bytes", r.budget_bytes);
  visit("bytes", r.bytes);
  visit("mean_error_percent", r.mean_error_percent);
  visit("depth_error_percent", r.depth_error_percent);
  visit("wrong_side_percent", r.wrong_side_percent);
  visit("answered_percent", r.answered_percent);
  visit("normal_mean_deg", r.normal_mean_deg);
  visit("us", r.us);
}
template <class Visit>
void fields(CurveRow& r, Visit& visit) {
  visit("figure", r.figure);
  visit("model", r.model);
  visit("curve", r.curve);
  visit("x", r.x);
  visit("y", r.y);
  visit.optional("y_spread", r.y_spread);
}
template <class Visit>
void fields(CheckRow& r, Visit& visit) {
  visit("model", r.model);
  visit("peer", r.peer);
  visit("claim", r.claim);
  visit("found", r.found);
  visit("allowed", r.allowed);
  visit("holds", r.holds);
}
template <class Visit>
void fields(Results& r, Visit& visit) {
  visit("command", r.command);
  visit("smoke", r.is_smoke);
  visit("machine", r.machine);
  visit("models", r.models);
  visit("peers", r.peers);
  visit("works", r.works);
  visit("frames", r.frames);
  visit("accuracy", r.accuracy);
  visit("memory", r.memory);
  visit("bake", r.bake);
  visit("force", r.force);
  visit("effects", r.effects);
  visit("budgets", r.budgets);
  visit("curves", r.curves);
  visit("checks", r.checks);
}

/// Numbers and words; all else is a row.
template <class T>
constexpr bool kIsPlain = std::is_arithmetic_v<T> || std::is_same_v<T, std::string>;

bool is_told(std::size_t count) { return count > 0; }
bool is_told(const Spread& spread) { return is_told(spread.count); }
bool is_told(const std::vector<Spread>& spreads) { return !spreads.empty(); }

struct Writer {
  Json json;
  template <class T>
  void operator()(const char* name, T& value) {
    json[name] = written(value);
  }
  template <class T>
  void optional(const char* name, T& value) {
    if (is_told(value)) (*this)(name, value);
  }
  template <class T>
  static Json written(T& value) {
    if constexpr (kIsPlain<T>) {
      return value;
    } else {
      Writer writer;
      fields(value, writer);
      return std::move(writer.json);
    }
  }
  template <class T>
  static Json written(std::vector<T>& values) {
    Json array = Json::array();
    for (T& value : values) array.push_back(written(value));
    return array;
  }
};

/// Throws what the JSON library throws where a name is missing or of another type.
struct Reader {
  const Json& json;
  template <class T>
  void operator()(const char* name, T& value) {
    read(json.at(name), value);
  }
  template <class T>
  void optional(const char* name, T& value) {
    if (json.contains(name)) (*this)(name, value);
  }
  template <class T>
  static void read(const Json& from, T& value) {
    if constexpr (std::is_same_v<T, double>) {  // what is not a number is null
      value = from.is_null() ? std::numeric_limits<double>::quiet_NaN() : from.get<double>();
    } else if constexpr (kIsPlain<T>) {
      value = from.get<T>();
    } else {
      Reader reader{from};
      fields(value, reader);
    }
  }
  template <class T>
  static void read(const Json& from, std::vector<T>& values) {
    values.clear();
    for (const Json& item : from) read(item, values.emplace_back());
  }
};

/// To six digits: more are noise in every time, and no error is told to a millionth.
void round_numbers(Json& json) {
  if (json.is_structured())
    for (auto& item : json) round_numbers(item);
  if (json.is_number_float() && std::isfinite(json.get<double>()))
    json = std::stod(fmt::format("{:.6g}", json.get<double>()));
}

Json whole(Results results) {
  Json json{{"schema", kSchema}, {"program", std::string("sqbench ") + kVersion}};
  const Json content = Writer::written(results);
  for (const auto& [name, value] : content.items()) {
    json[name] = value;
    if (name == "smoke") json["seed"] = kSeed;
  }
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

/// A line each for the numbers in `value`, with what leads to them joined to `start` by dots.
void csv_values(const std::string& start, const Json& value, std::string& text) {
  if (value.is_number() || value.is_boolean()) text += fmt::format("{},{}\n", start, value.dump());
  if (value.is_structured())
    for (const auto& [part, inner] : value.items())
      csv_values(fmt::format("{}.{}", start, part), inner, text);
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
  if (row.contains("budget_bytes")) work = fmt::format("{} bytes", row["budget_bytes"].get<double>());
  if (row.contains("target_percent") && row["target_percent"].is_number())
    work = fmt::format("target {} %", row["target_percent"].get<double>());
  const std::string start = fmt::format("{},{},{},{},", table, name("model"), work, peer);
  for (const auto& [key, value] : row.items()) csv_values(start + key, value, text);
}

}  // namespace

std::string results_json(const Results& results) { return text_of(whole(results)); }

Result<Results> results_from_json(std::string_view text) {
  const Json json = Json::parse(text, nullptr, false);
  if (json.is_discarded())
    return Error{Status::kUnknownFormat, "is no JSON", "name the results.json of a run"};
  if (!json.is_object() || json.value("schema", Json()) != kSchema)
    return Error{Status::kUnknownFormat, fmt::format("is no result file of sqbench (schema {})", kSchema),
                 "name the results.json of a run"};
  Results results;
  try {
    Reader::read(json, results);
  } catch (const Json::exception& problem) {
    return Error{Status::kUnknownFormat, fmt::format("does not fit its schema: {}", problem.what()), {}};
  }
  return results;
}

std::string results_csv(const Results& results) {
  std::string text = "table,model,work,peer,quantity,value\n";
  const Json json = whole(results);
  for (const auto& [table, rows] : json.items())
    if (rows.is_array())
      for (const Json& row : rows) csv_lines(table, row, text);
  return text;
}

}  // namespace sqmap::bench
