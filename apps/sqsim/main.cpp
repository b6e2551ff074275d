// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <exception>
#include <filesystem>
#include <new>
#include <string>
#include <system_error>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "sqmap/asset/version.hpp"
#include "sqmap/io/bundle.hpp"

#include "../common/console.hpp"
#include "../common/exit_codes.hpp"
#include "../common/source_mesh.hpp"
#include "probe_mesh.hpp"
#include "runs.hpp"

namespace {

namespace fs = std::filesystem;
using namespace sqmap;
using namespace sqmap::apps;

struct Arguments {
  fs::path scene, bundles, meshes;
  double rate_hz = 0, seconds = 0;
  RunOptions run;
};

constexpr const char* kAbout =
    "Runs a scene of superquadric maps at a fixed rate: a probe that is moved by keyframes or hangs on a "
    "spring,\n"
    "or a cloth that falls. Prints how long frames took, and which missed their deadline.\n"
    "\n"
    "Examples:\n"
    "  sqsim samples/scenes/object_recognition.json --bundles build/bundles --meshes build/meshes\n"
    "  sqsim scene.json --fast -o out/\n"
    "  sqsim scene.json --rate 2000 --seconds 60\n";

Error from_scene(const fs::path& scene, const Error& error) {
  const Status status = error.status == Status::kBadOption ? Status::kUnknownFormat : error.status;
  return {status, fmt::format("{}: {}", scene.string(), error.finding), error.remedy};
}

/// Reads the bundles, each once, and the probe's mesh.
Outcome load(const Arguments& arguments, LoadedScene& loaded) {
  const fs::path beside = arguments.scene.parent_path();
  const fs::path bundles = arguments.bundles.empty() ? beside : arguments.bundles,
                 meshes = arguments.meshes.empty() ? beside : arguments.meshes;
  std::vector<std::string> names;
  std::vector<std::size_t> asset_of_object;
  for (const ObjectEntry& object : loaded.file.objects) {
    const auto known = std::find(names.begin(), names.end(), object.bundle);
    asset_of_object.push_back(static_cast<std::size_t>(known - names.begin()));
    if (known != names.end()) continue;
    names.push_back(object.bundle);
    Result<Asset> asset = io::read(bundles / object.bundle);
    if (!asset)
      return Error{asset.error().status, message_for((bundles / object.bundle).string(), asset.error()), ""};
    loaded.assets.push_back(std::move(asset).value());
  }
  for (std::size_t i = 0; i < asset_of_object.size(); ++i) {
    const ObjectEntry& object = loaded.file.objects[i];
    loaded.objects.push_back({object.name, &loaded.assets[asset_of_object[i]], object.placement});
  }
  if (!loaded.file.probe) return Done{};
  const ProbeEntry& probe = *loaded.file.probe;
  if (probe.mesh.empty()) {
    loaded.probe.points_m = probe.points_m;
    return Done{};
  }
  Provenance unit;
  unit.metres_per_unit = probe.scale;
  Result<SourceSurface> mesh = read_source(meshes / probe.mesh, unit);
  if (!mesh) return mesh.error();
  loaded.probe = std::move(mesh).value().surface;
  for (int k = 0; k < probe.subdivisions; ++k) loaded.probe = subdivided(loaded.probe);
  return Done{};
}

Outcome simulate(Console& console, const Arguments& arguments) {
  Result<SceneFile> file = read_scene_file(arguments.scene);
  if (!file) return file.error();
  LoadedScene loaded{std::move(file).value(), {}, {}, {}};
  if (arguments.rate_hz > 0) loaded.file.rate_hz = arguments.rate_hz;
  if (arguments.seconds > 0) loaded.file.seconds = arguments.seconds;
  if (const Outcome ok = load(arguments, loaded); !ok) return ok.error();
  if (!arguments.run.output.empty()) {
    std::error_code code;
    fs::create_directories(arguments.run.output, code);
    if (code)
      return Error{Status::kFileUnwritable,
                   fmt::format("{}: {}", arguments.run.output.string(), code.message()),
                   "name another folder"};
  }
  const Outcome outcome = loaded.file.cloth ? run_cloth(console, loaded, arguments.run)
                                            : run_probe(console, loaded, arguments.run);
  if (!outcome) return from_scene(arguments.scene, outcome.error());
  return Done{};
}

Exit parse_and_run(Console& console, int argc, char** argv) {
  Arguments arguments;
  CLI::App app(kAbout, "sqsim");
  app.set_version_flag("--version",
                       fmt::format("sqsim {} (bundle format {}.{})", kVersion, kFormatMajor, kFormatMinor));
  app.footer(exit_code_table());
  app.get_formatter()->column_width(34);
  app.add_option("SCENE", arguments.scene, "Scene file (samples/scenes/scene.schema.json)")
      ->required()
      ->type_name("");
  app.add_option("--rate", arguments.rate_hz, "Frames a second, instead of the scene's")
      ->check(CLI::Range(1.0, 1e5).description(""))
      ->type_name("HZ");
  app.add_option("--seconds", arguments.seconds, "Simulated time, instead of the scene's")
      ->check(CLI::Range(1e-3, 1e5).description(""))
      ->type_name("S");
  app.add_flag("--fast", arguments.run.is_fast, "Do not wait for the time of the next frame");
  app.add_option(
         "--runs", arguments.run.runs,
         "Repeat a probe's run, and tell each frame's shortest time: what the system takes of one run "
         "is not in it")
      ->check(CLI::Range(1, 1000).description(""))
      ->type_name("N");
  app.add_option("-o,--output", arguments.run.output, "Folder for trace.csv, trace.svg and last_frame.glb")
      ->type_name("DIR");
  app.add_option("--bundles", arguments.bundles, "Where bundles are (default: beside the scene file)")
      ->type_name("DIR");
  app.add_option("--meshes", arguments.meshes, "Where meshes are (default: beside the scene file)")
      ->type_name("DIR");
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    console.out(app.help());
    return Exit::kOk;
  } catch (const CLI::CallForVersion& version) {
    console.out(std::string(version.what()) + "\n");
    return Exit::kOk;
  } catch (const CLI::ParseError& problem) {
    console.error(fmt::format("{}; see `sqsim --help`", problem.what()));
    return Exit::kUsage;
  }
  const Outcome outcome = simulate(console, arguments);
  if (outcome) return Exit::kOk;
  console.error(message_for(arguments.scene.string(), outcome.error()));
  return exit_for(outcome.error().status);
}

}  // namespace

int main(int argc, char** argv) {
  Console console("sqsim");
  Exit code = Exit::kInternal;
  try {
    code = parse_and_run(console, argc, argv);
  } catch (const std::bad_alloc&) {
    console.error("out of memory");
  } catch (const std::exception& problem) {
    console.error(fmt::format("internal error: {}", problem.what()));
  }
  return static_cast<int>(console.finish(code));
}
