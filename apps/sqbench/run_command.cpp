// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <ctime>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "../common/files.hpp"
#include "commands.hpp"
#include "page_files.hpp"
#include "suites.hpp"
#include "timing.hpp"

namespace sqmap::apps {
namespace {

constexpr std::array<bench::Suite, 8> kSuites{{
    {"frames", "whole frames: the probe touching, far and grasping, against each object", bench::run_frames},
    {"accuracy", "errors and time a point, in shells around the surface, at every setting",
     bench::run_accuracy},
    {"memory", "resident bytes, beside the paper's Table 1", bench::run_memory},
    {"bake", "what preparing an object costs for each accuracy", bench::run_bake},
    {"force", "jumps of the force as a point slides over the object", bench::run_force},
    {"budget", "errors and frames of every method in 8 to 128 KB an object", bench::run_budget},
    {"size", "frames as the object and the probe grow", bench::run_size},
    {"effects", "what each output and option of the runtime adds to a frame", bench::run_effects},
}};

struct RunArguments {
  std::string suite;
  std::vector<std::filesystem::path> meshes;
  std::filesystem::path bundles = "build/bundles", probe = "build/meshes/hand.off", out;
  bool is_smoke = false;

  /// Those of build/meshes where none is named. Two show that all runs.
  void choose_meshes() {
    if (!meshes.empty()) return;
    for (const char* name : {"elephant", "camel", "hand", "armadillo", "lion", "dino"})
      if (!is_smoke || meshes.size() < 2) meshes.push_back(std::string("build/meshes/") + name + ".off");
  }

  /// The line that repeats this run, without folders that differ from machine to machine.
  std::string command() const {
    std::string line = "sqbench run " + suite + " --meshes";
    for (const auto& mesh : meshes) line += " " + mesh.filename().string();
    return line + " --probe " + probe.filename().string() + (is_smoke ? " --smoke" : "");
  }
};

/// The page is drawn from what the file says, so that it cannot say more.
Exit write_all(Console& console, const std::filesystem::path& folder, const bench::Results& results) {
  const std::string text = bench::results_json(results);
  Result<bench::Results> told = bench::results_from_json(text);
  if (!told) return report(console, folder / "results.json", told.error());
  told.value().drawings = results.drawings;
  const Exit drawn = write_page(console, folder, told.value());
  if (drawn != Exit::kOk) return drawn;
  if (const Outcome written = write_file(folder / "results.json", text); !written)
    return report(console, folder / "results.json", written.error());
  return Exit::kOk;
}

Exit run_suites(Console& console, const RunArguments& arguments) {
  bench::SuiteInput input;
  input.is_smoke = arguments.is_smoke;
  input.note = [&](const std::string& text) { console.note(text); };
  const Result<bake::Mesh> probe = bench::read_probe(arguments.probe);
  if (!probe) return report(console, arguments.probe, probe.error());
  input.probe = probe.value();
  bench::Results results;
  results.command = arguments.command();
  results.is_smoke = arguments.is_smoke;
  for (const auto& mesh : arguments.meshes) {
    Result<bench::Model> model = bench::read_model(mesh, arguments.bundles);
    if (!model) return report(console, mesh, model.error());
    const bench::Model& read = model.value();
    results.models.push_back({read.name, read.mesh.vertices_m.size(), read.mesh.faces.size(),
                              read.asset.parts.size(), read.bundle_bytes, read.r_max_m()});
    input.models.push_back(std::move(model.value()));
  }
  results.machine = bench::this_machine(bench::pin_thread());
  for (const bench::Suite& suite : kSuites) {
    if (arguments.suite != "all" && arguments.suite != suite.name) continue;
    const std::clock_t start = std::clock();
    suite.run(input, results);
    console.note(fmt::format("{}: done, {:.1f} s of processor time", suite.name,
                             static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC));
    // After each, so that hours are not lost to what befalls a later one.
    const Exit written = write_all(console, arguments.out, results);
    if (written != Exit::kOk) return written;
  }
  console.out(fmt::format("the page is {}\n", (arguments.out / "index.html").string()));
  std::size_t broken = 0;
  for (const bench::CheckRow& check : results.checks) {
    if (check.holds) continue;
    ++broken;
    console.error(fmt::format("{}, {}: {}: found {:.4g}, allowed {:.4g}", check.model, check.peer,
                              check.claim, check.found, check.allowed));
  }
  return broken == 0 ? Exit::kOk : Exit::kSomeFailed;
}

}  // namespace

std::function<Exit(Console&)> declare_run(CLI::App& app) {
  const auto args = std::make_shared<RunArguments>();
  std::string suites;
  std::vector<std::string> names{"all"};
  for (const bench::Suite& suite : kSuites) {
    suites += fmt::format("  {:9} {}\n", suite.name, suite.summary);
    names.emplace_back(suite.name);
  }
  app.description(
      "Measures sqmap and its rivals on the same points, holds every answer against the exact mesh, and "
      "writes\n"
      "results.json, results.csv, pictures (SVG) and a page that reads offline, index.html. Exit code 1 when "
      "an\n"
      "answer is farther from the truth than its method states.\n"
      "\n"
      "Suites:\n" +
      suites +
      "  all       each of them in turn\n"
      "\n"
      "Examples:\n"
      "  sqbench run frames -o build/bench\n"
      "  sqbench run accuracy --meshes build/meshes/elephant.off --bundles build/bundles -o build/bench\n"
      "  sqbench run all --smoke -o build/smoke\n");
  app.add_option("SUITE", args->suite, "One of those above, or all")
      ->required()
      ->check(CLI::IsMember(names).description(""));
  app.add_option("--meshes", args->meshes, "Objects (default: six of build/meshes, with --smoke two)")
      ->type_name("FILE...");
  app.add_option("--bundles", args->bundles, "Folder of their bundles, STEM.h5 (default build/bundles)")
      ->type_name("DIR");
  app.add_option("--probe", args->probe, "Mesh of the moving body (default build/meshes/hand.off)")
      ->type_name("FILE");
  app.add_option("-o,--out", args->out, "Folder for the results")->required()->type_name("DIR");
  app.add_flag("--smoke", args->is_smoke,
               "A few poses and points, under a minute: shows that all runs, times mean little");
  return [args](Console& console) {
    args->choose_meshes();
    return run_suites(console, *args);
  };
}

}  // namespace sqmap::apps
