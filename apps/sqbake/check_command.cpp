// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sqmap/bake/mesh.hpp"

#include "../common/choices.hpp"
#include "../common/confinement.hpp"
#include "../common/json_text.hpp"
#include "commands.hpp"
#include "mesh_size.hpp"
#include "settings.hpp"

namespace sqmap::apps {
namespace {

struct CheckArguments {
  std::filesystem::path input;
  SettingTexts settings;
  std::string format = "text";
};

std::string text_report(const std::string& input, const bake::SourceMesh& source, const MeshRecord& record) {
  std::string text = fmt::format(
      "{}\n"
      "  as read             {} vertices, {} faces, {} triangles\n"
      "  repaired            {} vertices, {} triangles in {} component{}\n"
      "  size                {:.6g} m across, volume {:.6g} m3\n",
      input, record.source_vertices, source.source_face_count, source.mesh.faces.size(), record.vertices,
      record.faces, record.components, record.components == 1 ? "" : "s", diagonal_m(source.mesh),
      record.volume_m3);
  const auto row = [&](const char* what, std::uint32_t count, const char* meaning) {
    if (count > 0) text += fmt::format("  {:<19} {} {}\n", what, count, meaning);
  };
  row("welded", record.welded_vertices, "vertices that repeat another one's place");
  row("degenerate", record.degenerate_faces, "faces without area, dropped");
  row("duplicate", record.duplicate_faces, "faces that repeat another one, dropped");
  row("flipped", record.flipped_faces, "faces turned to agree with their neighbours and point outwards");
  row("filled", record.filled_holes, "holes closed");
  row("open", record.boundary_edges, "edges with one face only");
  row("non-manifold", record.non_manifold_edges, "edges with more than two faces");
  text += record.is_closed
              ? "  closed              yes: every edge has two faces\n"
              : "  closed              no: inside means a winding number above 1/2, which is vague near "
                "the holes\n";
  return text;
}

Exit run_check(Console& console, const CheckArguments& arguments) {
  const std::string input = arguments.input.string();
  const Result<AssetOptions> options = options_from(arguments.settings);
  if (!options) return refuse(console, input, options.error());
  const Result<bake::SourceMesh> source = bake::read_mesh(arguments.input, options.value().bake.read);
  if (!source) return refuse(console, input, source.error());
  if (const auto warning = size_warning(source.value().mesh)) console.warning(input + ": " + *warning);
  const Result<bake::PreparedMesh> prepared =
      bake::check_and_repair(source.value(), options.value().bake.repair);
  if (!prepared) return refuse(console, input, prepared.error());
  const MeshRecord& record = prepared.value().record;
  if (arguments.format == "text") {
    console.out(text_report(input, source.value(), record));
  } else {
    nlohmann::ordered_json json{{"schema", "sqmap.check/1"},
                                {"input", input},
                                {"source_hash", source.value().hash},
                                {"source_triangles", source.value().mesh.faces.size()},
                                {"diagonal_m", diagonal_m(source.value().mesh)},
                                {"mesh", to_json(record)}};
    console.out(json_text(json));
  }
  return Exit::kOk;
}

}  // namespace

std::function<Exit(Console&)> declare_check(CLI::App& app) {
  const auto args = std::make_shared<CheckArguments>();
  app.description(
      "Reads a mesh as `sqbake bake` would and says what is wrong with it and what repair does about it. "
      "Writes\n"
      "nothing.\n"
      "\n"
      "Examples:\n"
      "  sqbake check hand.off\n"
      "  sqbake check scan.stl --unit mm --repair none --format json\n");
  app.add_option("INPUT", args->input, "Mesh file")->required();
  constexpr std::array<std::string_view, 3> kMeshSettings{"unit", "up", "repair"};
  add_setting_options(app, kMeshSettings, args->settings);
  add_words(app, "--format", args->format, {"text", "json"}, "text or json (default text)");
  return [args](Console& console) {
    return run_confined(console, {{.heap_bytes = physical_memory_bytes(), .may_start_threads = true},
                                  args->input.string(),
                                  "report this with the mesh",
                                  [&](Console& child) { return run_check(child, *args); }});
  };
}

}  // namespace sqmap::apps
