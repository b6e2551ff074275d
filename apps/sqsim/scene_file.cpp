// SPDX-License-Identifier: Apache-2.0
#include "scene_file.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "../common/files.hpp"

namespace sqmap::apps {
namespace {

using Json = nlohmann::json;
using runtime::Layer;

constexpr std::uint64_t kMaxSceneBytes = 16 << 20;
constexpr double kMostMetres = 1e6;

/// Insertions, deletions and changes that make one word the other.
std::size_t edits(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t change = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({row[j] + 1, diagonal + 1, change});
    }
  }
  return row.back();
}

std::string nearest(std::string_view word, const std::vector<std::string>& known) {
  const auto best = std::ranges::min_element(known, {}, [&](const std::string& k) { return edits(word, k); });
  return best == known.end() ? std::string() : *best;
}

/// Reads one object of the file. The first thing that is wrong is kept; later reads give defaults. Every key
/// that is asked for is known; finish() complains about the others.
class Reader {
 public:
  Reader(const Json& json, std::string where, std::optional<std::string>& problem)
      : json_(json), where_(std::move(where)), problem_(problem) {
    if (!json.is_object()) fail("", "must be an object");
  }

  bool has(const char* key) {
    known_.emplace_back(key);
    return json_.is_object() && json_.contains(key);
  }
  double number(const char* key, double initial, double least, double most) {
    if (!has(key)) return initial;
    const Json& value = json_[key];
    if (!value.is_number()) return fail(key, "must be a number"), initial;
    const double number = value.get<double>();
    if (!(number >= least && number <= most))
      return fail(key, fmt::format("= {}, must be in [{}, {}]", number, least, most)), initial;
    return number;
  }
  int whole(const char* key, int initial, int least, int most) {
    const double value = number(key, initial, least, most);
    if (value != std::floor(value)) fail(key, "must be a whole number");
    return static_cast<int>(value);
  }
  bool flag(const char* key) {
    if (!has(key)) return false;
    if (!json_[key].is_boolean()) return fail(key, "must be true or false"), false;
    return json_[key].get<bool>();
  }
  std::string text(const char* key) {
    if (!has(key)) return {};
    if (!json_[key].is_string()) return fail(key, "must be a text"), "";
    return json_[key].get<std::string>();
  }
  Vec3d vector(const char* key) {
    const std::vector<double> v = numbers(key, 3);
    return v.empty() ? Vec3d{} : Vec3d{v[0], v[1], v[2]};
  }
  Quaternion orientation(const char* key) {
    const std::vector<double> v = numbers(key, 4);
    if (v.empty()) return {};
    const double length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2] + v[3] * v[3]);
    if (!(length > 1e-9)) return fail(key, "must not be zero"), Quaternion{};
    return {v[0] / length, v[1] / length, v[2] / length, v[3] / length};
  }
  /// Calls `read(json, where)` for each element of an array.
  template <class Read>
  void each(const char* key, std::size_t least, Read read) {
    if (!has(key) || !json_[key].is_array() || json_[key].size() < least)
      return fail(key, fmt::format("must be an array of at least {}", least));
    for (std::size_t i = 0; i < json_[key].size(); ++i)
      read(json_[key][i], fmt::format("{}.{}[{}]", where_, key, i));
  }
  template <class Read>
  void object(const char* key, Read read) {
    if (has(key)) read(json_[key], where_ + "." + key);
  }
  void require(const char* key) {
    if (!has(key)) fail(key, "is missing");
  }
  void fail(std::string_view key, const std::string& what) {
    if (!problem_) problem_ = fmt::format("{}{}{} {}", where_, key.empty() ? "" : ".", key, what);
  }
  void finish() {
    if (!json_.is_object()) return;
    for (const auto& [key, value] : json_.items())
      if (std::ranges::find(known_, key) == known_.end())
        fail(key, fmt::format("is no key of a scene file; the nearest is \"{}\"", nearest(key, known_)));
  }

 private:
  std::vector<double> numbers(const char* key, std::size_t count) {
    if (!has(key)) return {};
    const Json& value = json_[key];
    std::vector<double> result;
    if (value.is_array() && value.size() == count)
      for (const Json& x : value)
        if (x.is_number() && std::abs(x.get<double>()) <= kMostMetres) result.push_back(x.get<double>());
    if (result.size() != count) {
      fail(key, fmt::format("must be an array of {} numbers in [{}, {}]", count, -kMostMetres, kMostMetres));
      return {};
    }
    return result;
  }

  const Json& json_;
  std::string where_;
  std::optional<std::string>& problem_;
  std::vector<std::string> known_;
};

using Problem = std::optional<std::string>;

ObjectEntry read_object(const Json& json, const std::string& where, Problem& problem) {
  Reader reader(json, where, problem);
  ObjectEntry entry;
  entry.name = reader.text("name");
  reader.require("bundle");
  entry.bundle = reader.text("bundle");
  entry.placement.world_from_object = {reader.orientation("orientation_wxyz"), reader.vector("position_m")};
  entry.placement.scale = reader.number("scale", 1, 1e-6, 1e6);
  entry.placement.mirrored = reader.flag("mirrored");
  if (entry.name.empty()) entry.name = std::filesystem::path(entry.bundle).stem().string();
  reader.finish();
  return entry;
}

Coupling read_coupling(const Json& json, const std::string& where, Problem& problem) {
  Reader reader(json, where, problem);
  Coupling c;
  c.mass_kg = reader.number("mass_kg", c.mass_kg, 1e-4, 1e3);
  c.stiffness_n_per_m = reader.number("stiffness_n_per_m", c.stiffness_n_per_m, 0, 1e6);
  c.damping_n_s_per_m = reader.number("damping_n_s_per_m", c.damping_n_s_per_m, 0, 1e5);
  c.inertia_kg_m2 = reader.number("inertia_kg_m2", c.inertia_kg_m2, 1e-8, 1e3);
  c.stiffness_nm_per_rad = reader.number("stiffness_nm_per_rad", c.stiffness_nm_per_rad, 0, 1e5);
  c.damping_nm_s_per_rad = reader.number("damping_nm_s_per_rad", c.damping_nm_s_per_rad, 0, 1e5);
  reader.finish();
  return c;
}

ProbeEntry read_probe(const Json& json, const std::string& where, Problem& problem) {
  Reader reader(json, where, problem);
  ProbeEntry probe;
  probe.mesh = reader.text("mesh");
  if (reader.has("points_m"))
    reader.each("points_m", 1, [&](const Json& point, const std::string& at) {
      const Json wrapped{{"point", point}};
      Reader one(wrapped, at, problem);
      probe.points_m.push_back(cast<float>(one.vector("point")));
    });
  if (probe.mesh.empty() == probe.points_m.empty()) reader.fail("", "must have either mesh or points_m");
  probe.scale = reader.number("scale", 1, 1e-6, 1e6);
  probe.subdivisions = reader.whole("subdivisions", 0, 0, 4);
  probe.zone_m = reader.number("zone_m", 0, 0, kMostMetres);
  reader.each("keyframes", 1, [&](const Json& frame, const std::string& at) {
    Reader one(frame, at, problem);
    Keyframe key{one.number("time_s", 0, 0, 1e6),
                 {one.orientation("orientation_wxyz"), one.vector("position_m")}};
    if (!probe.keyframes.empty() && !(key.time_s > probe.keyframes.back().time_s))
      one.fail("time_s", "must be later than that of the keyframe before");
    probe.keyframes.push_back(key);
    one.finish();
  });
  reader.object("coupling", [&](const Json& coupling, const std::string& at) {
    probe.coupling = read_coupling(coupling, at, problem);
  });
  reader.finish();
  return probe;
}

ClothEntry read_cloth(const Json& json, const std::string& where, Problem& problem) {
  Reader reader(json, where, problem);
  ClothEntry cloth;
  cloth.centre_m = reader.vector("centre_m");
  cloth.edge_m = reader.number("edge_m", cloth.edge_m, 1e-3, kMostMetres);
  cloth.nodes_along_edge = reader.whole("nodes_along_edge", cloth.nodes_along_edge, 2, 201);
  cloth.mass_kg = reader.number("mass_kg", cloth.mass_kg, 1e-4, 1e3);
  cloth.thickness_m = reader.number("thickness_m", cloth.thickness_m, 0, 1);
  cloth.friction = reader.number("friction", cloth.friction, 0, 1);
  reader.finish();
  return cloth;
}

std::vector<runtime::EffectChoice> read_effects(const Json& json, const std::string& where,
                                                Problem& problem) {
  Reader reader(json, where, problem);
  std::vector<runtime::EffectChoice> choices;
  for (const runtime::EffectInfo& info : runtime::effect_table())
    reader.object(info.name, [&](const Json& values, const std::string& at) {
      Reader one(values, at, problem);
      runtime::EffectChoice choice{info.name, {}};
      for (const auto& p : info.parameters) {
        const double value = p.is_whole ? one.whole(p.name, static_cast<int>(p.initial),
                                                    static_cast<int>(p.least), static_cast<int>(p.most))
                                        : one.number(p.name, p.initial, p.least, p.most);
        choice.values.emplace_back(p.name, static_cast<float>(value));
      }
      one.finish();
      choices.push_back(std::move(choice));
    });
  reader.finish();
  return choices;
}

void read_query(const Json& json, const std::string& where, runtime::QueryOptions& query, Problem& problem) {
  Reader reader(json, where, problem);
  query.layer = static_cast<Layer>(reader.whole("layer", 0, 0, 3));
  query.level = static_cast<std::uint32_t>(reader.whole("level", 0, 0, 31));
  reader.finish();
}

BudgetEntry read_budget(const Json& json, const std::string& where, Problem& problem) {
  Reader reader(json, where, problem);
  BudgetEntry budget;
  if (reader.has("microseconds") == reader.has("units"))
    reader.fail("", "must have either microseconds or units");
  budget.microseconds = reader.number("microseconds", 0, 1, 1e6);
  budget.units = static_cast<std::uint64_t>(reader.whole("units", 0, 0, 1000000000));
  reader.finish();
  return budget;
}

SceneFile read_scene(const Json& json, Problem& problem) {
  Reader reader(json, "scene", problem);
  SceneFile scene;
  reader.require("schema");
  if (const std::string schema = reader.text("schema"); schema != "sqmap.scene/1")
    reader.fail("schema", fmt::format("= \"{}\", must be \"sqmap.scene/1\"", schema));
  reader.text("description");
  scene.rate_hz = reader.number("rate_hz", scene.rate_hz, 1, 1e5);
  scene.seconds = reader.number("seconds", scene.seconds, 1e-3, 1e5);
  reader.object("query", [&](const Json& query, const std::string& at) {
    read_query(query, at, scene.options.query, problem);
  });
  reader.object("budget", [&](const Json& budget, const std::string& at) {
    scene.budget = read_budget(budget, at, problem);
  });
  reader.each("objects", 1, [&](const Json& object, const std::string& at) {
    scene.objects.push_back(read_object(object, at, problem));
  });
  reader.object("probe", [&](const Json& probe, const std::string& at) {
    scene.probe = read_probe(probe, at, problem);
  });
  reader.object("cloth", [&](const Json& cloth, const std::string& at) {
    scene.cloth = read_cloth(cloth, at, problem);
  });
  if (scene.probe.has_value() == scene.cloth.has_value()) reader.fail("", "must have either probe or cloth");
  reader.object("effects", [&](const Json& effects, const std::string& at) {
    scene.options.effects = read_effects(effects, at, problem);
  });
  if (scene.cloth && !scene.options.effects.empty())
    reader.fail("effects", "belong to a probe; a cloth has its friction");
  if (scene.cloth && scene.budget) reader.fail("budget", "belongs to a probe");
  reader.finish();
  return scene;
}

}  // namespace

Result<SceneFile> read_scene_file(const std::filesystem::path& path) {
  const Result<std::vector<std::uint8_t>> bytes = read_file(path, kMaxSceneBytes);
  if (!bytes) return bytes.error();
  const std::string name = path.string();
  const Json json = Json::parse(bytes.value().begin(), bytes.value().end(), nullptr, false);
  if (json.is_discarded())
    return Error{Status::kUnknownFormat, fmt::format("{}: not a JSON file", name),
                 "samples/scenes holds examples, scene.schema.json the rules"};
  Problem problem;
  SceneFile scene = read_scene(json, problem);
  if (problem)
    return Error{Status::kUnknownFormat, fmt::format("{}: {}", name, *problem),
                 "samples/scenes/scene.schema.json lists what a scene file may hold"};
  return scene;
}

}  // namespace sqmap::apps
