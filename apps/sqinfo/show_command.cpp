// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sqmap/io/bundle.hpp"
#include "sqmap/runtime/object.hpp"

#include "../common/choices.hpp"
#include "../common/files.hpp"
#include "../common/json_text.hpp"
#include "certainty_share.hpp"
#include "commands.hpp"
#include "map_statistics.hpp"

namespace sqmap::apps {
namespace {

using Json = nlohmann::ordered_json;

/// Everything `show` prints, gathered once for both formats.
struct BundleFacts {
  std::string path;
  Asset asset;
  std::vector<io::StoredBytes> datasets;
  std::uint64_t file_bytes{};
  std::size_t resident_bytes{};
  std::size_t segment_count{};
  std::optional<CertaintyShare> certainty;  ///< where every part has bounds
};

Result<BundleFacts> gather(const std::filesystem::path& path) {
  Result<Asset> asset = io::read(path);
  if (!asset) return asset.error();
  const Result<std::vector<std::uint8_t>> bytes = read_file(path, io::ReadLimits{}.max_file_bytes);
  if (!bytes) return bytes.error();
  Result<std::vector<io::StoredBytes>> datasets = io::stored_bytes(bytes.value());
  if (!datasets) return datasets.error();
  const Result<runtime::Object> object = runtime::Object::build(asset.value());
  if (!object) return object.error();

  BundleFacts facts;
  facts.path = path.string();
  facts.asset = std::move(asset).value();
  facts.datasets = std::move(datasets).value();
  facts.file_bytes = bytes.value().size();
  facts.resident_bytes = object.value().resident_bytes();
  facts.certainty = certainty_share(facts.asset, object.value());
  std::set<std::uint32_t> segments;
  for (const Part& part : facts.asset.parts) segments.insert(part.segment);
  facts.segment_count = segments.size();
  return facts;
}

/// Volume of a part over its superquadric's: 1 is a perfect fit.
double fill(const Part& part) { return part.volume_m3 / volume_m3(part.shape); }

/// By which a bent part's axis turns from end to end.
double axis_turn_deg(const Superquadric& shape) {
  return 2 * shape.bend.curvature() * shape.semi_axes_m.z * 180 / std::numbers::pi;
}

Json to_json(const Vec3d& v) { return Json::array({v.x, v.y, v.z}); }

Json part_json(const Part& part) {
  const MapStatistics map = statistics(part.map);
  const Quaternion& q = part.object_from_part.orientation;
  return {{"segment", part.segment},
          {"reason", reason_name(part.reason)},
          {"semi_axes_m", to_json(part.shape.semi_axes_m)},
          {"e1", part.shape.e1},
          {"e2", part.shape.e2},
          {"taper", part.shape.taper},
          {"bend_per_m", Json::array({part.shape.bend.x, part.shape.bend.y})},
          {"orientation_wxyz", Json::array({q.w, q.x, q.y, q.z})},
          {"translation_m", to_json(part.object_from_part.translation_m)},
          {"sphere", {{"centre_m", to_json(part.sphere.centre_m)}, {"radius_m", part.sphere.radius_m}}},
          {"vertex_count", part.vertex_count},
          {"face_count", part.face_count},
          {"volume_m3", part.volume_m3},
          {"superquadric_volume_m3", volume_m3(part.shape)},
          {"map",
           {{"rows", part.map.rows},
            {"cols", part.map.cols},
            {"level_count", part.map.level_count},
            {"bits", part.map.bits},
            {"depth_step_m", part.map.depth_step_m},
            {"hits", map.hits},
            {"misses", map.misses},
            {"start_inside", map.start_inside},
            {"crossings", part.map.crossings.size()},
            {"vertex_samples", part.map.vertex_samples.size()},
            {"depth_least_m", map.depth_least_m},
            {"depth_mean_m", map.depth_mean_m},
            {"depth_most_m", map.depth_most_m},
            {"packed_bytes", map.packed_bytes}}}};
}

Json options_json(const std::string& text) {
  Json options = Json::parse(text, nullptr, false);
  return options.is_discarded() ? Json(text) : options;
}

std::string json_report(const BundleFacts& facts) {
  const Asset& asset = facts.asset;
  const Provenance& origin = asset.provenance;
  Json json{{"schema", "sqmap.show/1"},
            {"bundle", facts.path},
            {"file_bytes", facts.file_bytes},
            {"resident_bytes", facts.resident_bytes},
            {"r_max_m", asset.r_max_m},
            {"sphere", {{"centre_m", to_json(asset.sphere.centre_m)}, {"radius_m", asset.sphere.radius_m}}},
            {"segment_count", facts.segment_count},
            {"provenance",
             {{"generator", origin.generator},
              {"generator_version", origin.generator_version},
              {"source_name", origin.source_name},
              {"source_hash", origin.source_hash},
              {"metres_per_unit", origin.metres_per_unit},
              {"up_axis", origin.up_axis},
              {"options", options_json(origin.options_json)}}},
            {"mesh", apps::to_json(asset.mesh)},
            {"face_label_count", asset.face_labels.size()}};
  if (facts.certainty)
    json["bounds"] = {{"bytes", facts.certainty->bytes},
                      {"tolerance_m", facts.certainty->tolerance_m},
                      {"surely_outside_percent", facts.certainty->outside_percent},
                      {"surely_inside_percent", facts.certainty->inside_percent}};
  json["parts"] = Json::array();
  for (const Part& part : asset.parts) json["parts"].push_back(part_json(part));
  json["errors"] = apps::to_json(asset.errors);
  json["datasets"] = Json::array();
  for (const io::StoredBytes& each : facts.datasets)
    json["datasets"].push_back(
        {{"name", each.name}, {"stored_bytes", each.stored}, {"decoded_bytes", each.decoded}});
  return json_text(json);
}

std::string parts_table(const Asset& asset) {
  std::string text = fmt::format(
      "\nparts: K tapers, turn is by how many degrees the axis is bent from end to end, fill is the part's "
      "volume over its superquadric's; depths are in % of R_max, over the nodes that hit\n"
      "{:>4} {:>7} {:<17} {:>6} {:>9} {:>9} {:>9} {:>5} {:>5} {:>5} {:>4} {:>5} {:>9} {:>2} {:>4} {:>6} "
      "{:>7} "
      "{:>6} "
      "{:>6} {:>7}\n",
      "part", "segment", "reason", "faces", "a1 m", "a2 m", "a3 m", "e1", "e2", "K", "turn", "fill", "map",
      "lv", "bits", "miss %", "seam %", "mean %", "max %", "bytes");
  for (std::size_t i = 0; i < asset.parts.size(); ++i) {
    const Part& part = asset.parts[i];
    const MapStatistics map = statistics(part.map);
    const double nodes = static_cast<double>(part.map.code.size());
    text += fmt::format(
        "{:>4} {:>7} {:<17} {:>6} {:>9.4g} {:>9.4g} {:>9.4g} {:>5.2f} {:>5.2f} {:>5.2f} {:>4.0f} {:>5.2f} "
        "{:>9} {:>2} "
        "{:>4} "
        "{:>6.1f} "
        "{:>7.1f} {:>6.2f} {:>6.2f} {:>7}\n",
        i, part.segment, reason_name(part.reason), part.face_count, part.shape.semi_axes_m.x,
        part.shape.semi_axes_m.y, part.shape.semi_axes_m.z, part.shape.e1, part.shape.e2, part.shape.taper,
        axis_turn_deg(part.shape), fill(part), fmt::format("{}x{}", part.map.rows, part.map.cols),
        part.map.level_count, part.map.bits, 100 * static_cast<double>(map.misses) / nodes,
        100 * static_cast<double>(map.start_inside) / nodes, 100 * map.depth_mean_m / asset.r_max_m,
        100 * map.depth_most_m / asset.r_max_m, map.packed_bytes);
  }
  return text;
}

std::string errors_table(const std::vector<ErrorRow>& errors) {
  if (errors.empty()) return "\nerrors: not measured\n";
  const auto number = [](double value) {
    return value == value ? fmt::format("{:.4f}", value) : "-";
  };  // NaN
  std::string text = fmt::format(
      "\nerrors against the exact mesh, as the baker measured them: lengths in % of R_max, wrong answers in "
      "% of points\n"
      "{:>5} {:>5} {:>9} {:>11} {:>10} {:>14} {:>16} {:>8}\n",
      "level", "layer", "eq35 %", "depth mean", "depth p95", "wrong in 3 %", "wrong in 0.5 %", "samples");
  for (const ErrorRow& row : errors)
    text +=
        fmt::format("{:>5} {:>5} {:>9} {:>11} {:>10} {:>14} {:>16} {:>8}\n", row.level, row.layer,
                    number(row.eq35_percent), number(row.depth_mean_percent), number(row.depth_p95_percent),
                    number(row.misclassified_3_percent), number(row.misclassified_05_percent), row.samples_3);
  return text;
}

std::string text_report(const BundleFacts& facts) {
  const Asset& asset = facts.asset;
  const Provenance& origin = asset.provenance;
  const MeshRecord& mesh = asset.mesh;
  std::string text = fmt::format(
      "{}: sqmap bundle, {} parts in {} segments\n"
      "  bytes      {} on disk, {} in memory once loaded\n"
      "  object     R_max {:.6g} m, bounding sphere of {:.6g} m at ({:.4g}, {:.4g}, {:.4g}) m\n"
      "  source     {}, XXH3-128 {}\n"
      "  units      1 unit of the source = {:g} m, {} up\n"
      "  mesh       {} vertices, {} faces as read; {} and {} as baked, {} components, {}, {:.6g} m3\n"
      "  repair     {} welded, {} degenerate, {} duplicate, {} flipped, {} holes filled, {} open edges, {} "
      "non-manifold\n"
      "  made by    {} {}\n"
      "  options    {}\n",
      facts.path, asset.parts.size(), facts.segment_count, facts.file_bytes, facts.resident_bytes,
      asset.r_max_m, asset.sphere.radius_m, asset.sphere.centre_m.x, asset.sphere.centre_m.y,
      asset.sphere.centre_m.z, origin.source_name, origin.source_hash, origin.metres_per_unit, origin.up_axis,
      mesh.source_vertices, mesh.source_faces, mesh.vertices, mesh.faces, mesh.components,
      mesh.is_closed ? "closed" : "open", mesh.volume_m3, mesh.welded_vertices, mesh.degenerate_faces,
      mesh.duplicate_faces, mesh.flipped_faces, mesh.filled_holes, mesh.boundary_edges,
      mesh.non_manifold_edges, origin.generator, origin.generator_version, origin.options_json);
  if (const Json options = options_json(origin.options_json); options.contains("fallback"))
    text += fmt::format(
        "  degraded   fallback ({}): one for the whole mesh, which could not be baked as the options say\n",
        options["fallback"].is_string() ? options["fallback"].get<std::string>()
                                        : options["fallback"].dump());
  if (facts.certainty)
    text += fmt::format(
        "  bounds     {} bytes in memory; of the superquadrics' volume {:.1f} % is surely outside, {:.1f} % "
        "surely inside, within {:.2g} m\n",
        facts.certainty->bytes, facts.certainty->outside_percent, facts.certainty->inside_percent,
        facts.certainty->tolerance_m);
  text += parts_table(asset) + errors_table(asset.errors);
  text += fmt::format("\nstored: bytes in the file, and as declared\n");
  std::uint64_t stored = 0, decoded = 0;
  for (const io::StoredBytes& each : facts.datasets) {
    text += fmt::format("{:>9} {:>9}  {}\n", each.stored, each.decoded, each.name);
    stored += each.stored;
    decoded += each.decoded;
  }
  text += fmt::format("{:>9} {:>9}  all datasets; the file adds {} bytes of structure\n", stored, decoded,
                      facts.file_bytes - std::min(facts.file_bytes, stored));
  return text;
}

struct ShowArguments {
  std::filesystem::path bundle;
  std::string format = "text";
};

Exit run_show(Console& console, const ShowArguments& arguments) {
  const Result<BundleFacts> facts = gather(arguments.bundle);
  if (!facts) return report(console, arguments.bundle, facts.error());
  console.out(arguments.format == "json" ? json_report(facts.value()) : text_report(facts.value()));
  return Exit::kOk;
}

}  // namespace

std::function<Exit(Console&)> declare_show(CLI::App& app) {
  const auto args = std::make_shared<ShowArguments>();
  app.description(
      "Prints what a bundle holds: origin, options, mesh record, every part with its superquadric and map, "
      "measured\n"
      "errors by level and layer, and bytes by dataset.\n"
      "\n"
      "Examples:\n"
      "  sqinfo show hand.h5\n"
      "  sqinfo show hand.h5 --format json\n");
  app.add_option("BUNDLE", args->bundle, "Bundle file")->required();
  add_words(app, "--format", args->format, {"text", "json"}, "text or json (default text)");
  return [args](Console& console) { return run_show(console, *args); };
}

}  // namespace sqmap::apps
