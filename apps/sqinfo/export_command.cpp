// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sqmap/io/bundle.hpp"

#include "../common/choices.hpp"
#include "../common/files.hpp"
#include "../common/glb_writer.hpp"
#include "../common/json_text.hpp"
#include "../common/part_surface.hpp"
#include "../common/source_mesh.hpp"
#include "commands.hpp"
#include "map_image.hpp"
#include "map_statistics.hpp"

namespace sqmap::apps {
namespace {

namespace fs = std::filesystem;

struct ExportArguments {
  fs::path bundle, glb, source, seg, maps;
  std::string labels = "parts";
  std::uint32_t map_level = 0;
};

// The superquadrics must not hide the surfaces inside them.
constexpr float kSuperquadricOpacity = 0.35F;
constexpr GlbScene::Color kSourceColor{0.5F, 0.5F, 0.5F, 1.0F};

Result<std::vector<std::uint8_t>> scene_of(const Asset& asset, const TriangleSurface* source,
                                           std::uint32_t level) {
  GlbScene scene;
  if (source != nullptr) scene.add_mesh(GlbScene::kRoot, "source", *source, kSourceColor);
  const std::size_t shapes = scene.add_group("superquadrics"), surfaces = scene.add_group("surface");
  for (std::size_t i = 0; i < asset.parts.size(); ++i) {
    const Part& part = asset.parts[i];
    const std::string name = fmt::format("part {:02}", i);
    scene.add_mesh(shapes, name, superquadric_surface(part.shape), part_color(i, kSuperquadricOpacity),
                   part.object_from_part);
    scene.add_mesh(surfaces, name, mapped_surface(part, level), part_color(i, 1), part.object_from_part);
  }
  return scene.bytes();
}

Outcome export_glb(Console& console, const Asset& asset, const ExportArguments& arguments) {
  TriangleSurface source;
  if (!arguments.source.empty()) {
    Result<SourceSurface> read = read_source(arguments.source, asset.provenance);
    if (!read) return read.error();
    if (read.value().hash != asset.provenance.source_hash)
      console.warning(fmt::format("{}: not the file the bundle was baked from ({})",
                                  arguments.source.string(), asset.provenance.source_name));
    source = std::move(read).value().surface;
  }
  const Result<std::vector<std::uint8_t>> bytes =
      scene_of(asset, arguments.source.empty() ? nullptr : &source, arguments.map_level);
  if (!bytes) return bytes.error();
  return write_file(arguments.glb, bytes.value());
}

/// One label a line and a face of the input file. A face that repair dropped has no part of its own: it takes
/// the label of the face before it (the first labelled face's at the start), so that every line is a valid
/// label.
std::string segmentation(const Asset& asset, bool by_segment) {
  const auto label = [&](std::uint16_t part) {
    return by_segment ? asset.parts[part].segment : std::uint32_t{part};
  };
  const auto first =
      std::ranges::find_if(asset.face_labels, [](std::uint16_t part) { return part != kNoPart; });
  std::uint32_t previous = first == asset.face_labels.end() ? 0 : label(*first);
  std::string text;
  for (const std::uint16_t part : asset.face_labels) {
    if (part != kNoPart) previous = label(part);
    text += fmt::format("{}\n", previous);
  }
  return text;
}

Outcome export_maps(const Asset& asset, const ExportArguments& arguments) {
  std::error_code code;
  fs::create_directories(arguments.maps, code);
  if (code)
    return Error{Status::kFileUnwritable, fmt::format("{}: {}", arguments.maps.string(), code.message()),
                 "name another folder"};
  using Json = nlohmann::ordered_json;
  Json legend{
      {"schema", "sqmap.maps/1"}, {"pixel", "one map node; eta grows upwards, omega to the right from -pi"},
      {"color_map", "viridis"},   {"unit", "m"},
      {"miss_rgb", kMissColor},   {"start_inside_rgb", kStartInsideColor}};
  legend["maps"] = Json::array();
  for (std::size_t i = 0; i < asset.parts.size(); ++i) {
    const DistanceMap& map = asset.parts[i].map;
    const MapStatistics range = statistics(map);
    const Result<std::vector<std::uint8_t>> png =
        map_png(map, arguments.map_level, range.depth_least_m, range.depth_most_m);
    if (!png) return png.error();
    const std::string name = fmt::format("part_{:02}.png", i);
    if (Outcome written = write_file(arguments.maps / name, png.value()); !written) return written;
    legend["maps"].push_back({{"file", name},
                              {"part", i},
                              {"level", std::min(arguments.map_level, map.level_count - 1)},
                              {"depth_at_0_m", range.depth_least_m},
                              {"depth_at_1_m", range.depth_most_m}});
  }
  return write_file(arguments.maps / "legend.json", json_text(legend));
}

/// An output that is one of the inputs would destroy it.
Outcome check_outputs(const ExportArguments& arguments) {
  if (arguments.glb.empty() && arguments.seg.empty() && arguments.maps.empty())
    return Error{Status::kBadOption, "nothing to export", "give --glb FILE, --seg FILE or --maps DIR"};
  for (const fs::path& output : {arguments.glb, arguments.seg}) {
    for (const fs::path& input : {arguments.bundle, arguments.source}) {
      std::error_code code;
      if (!output.empty() && !input.empty() && fs::equivalent(output, input, code))
        return Error{Status::kBadOption, fmt::format("{}: is an input, too", output.string()),
                     "name another output"};
    }
  }
  return Done{};
}

Exit run_export(Console& console, const ExportArguments& arguments) {
  if (const Outcome ok = check_outputs(arguments); !ok) {
    console.error(ok.error().finding + "; " + ok.error().remedy);
    return exit_for(ok.error().status);
  }
  const Result<Asset> asset = io::read(arguments.bundle);
  if (!asset) return report(console, arguments.bundle, asset.error());
  if (!arguments.glb.empty())
    if (const Outcome done = export_glb(console, asset.value(), arguments); !done)
      return report(console, arguments.glb, done.error());
  if (!arguments.seg.empty())
    if (const Outcome done =
            write_file(arguments.seg, segmentation(asset.value(), arguments.labels == "segments"));
        !done)
      return report(console, arguments.seg, done.error());
  if (!arguments.maps.empty())
    if (const Outcome done = export_maps(asset.value(), arguments); !done)
      return report(console, arguments.maps, done.error());
  return Exit::kOk;
}

}  // namespace

std::function<Exit(Console&)> declare_export(CLI::App& app) {
  const auto args = std::make_shared<ExportArguments>();
  app.description(
      "Writes what can be looked at or scored. The options can be combined.\n"
      "  --glb   binary glTF: source (with --source), superquadrics/part NN, and surface/part NN, the "
      "surface that\n"
      "          each distance map represents\n"
      "  --seg   one label a line for each face of the input file; a face that repair dropped takes the "
      "label of the\n"
      "          face before it\n"
      "  --maps  one false-colour PNG a part and legend.json; white: no surface below, red: covered by a "
      "neighbour\n"
      "\n"
      "Examples:\n"
      "  sqinfo export hand.h5 --glb hand.glb --source hand.off\n"
      "  sqinfo export hand.h5 --seg hand.seg --level segments\n"
      "  sqinfo export hand.h5 --maps pictures/\n");
  app.add_option("BUNDLE", args->bundle, "Bundle file")->required();
  CLI::Option* glb = app.add_option("--glb", args->glb, "Scene to write")->type_name("FILE.glb");
  app.add_option("--source", args->source, "Mesh the bundle was baked from, for the scene")
      ->type_name("MESH")
      ->needs(glb);
  CLI::Option* seg = app.add_option("--seg", args->seg, "Segmentation to write")->type_name("FILE.seg");
  add_words(app, "--level", args->labels, {"parts", "segments"},
            "What a label of --seg numbers: segments (natural parts) or parts (default parts)")
      ->needs(seg);
  app.add_option("--maps", args->maps, "Folder for the pictures")->type_name("DIR");
  app.add_option("--map-level", args->map_level,
                 "Level of the maps for --glb and --maps, 0 the finest (default 0)")
      ->check(CLI::Range(0, 31).description(""))
      ->type_name("L");
  return [args](Console& console) { return run_export(console, *args); };
}

}  // namespace sqmap::apps
