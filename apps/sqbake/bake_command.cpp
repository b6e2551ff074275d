// SPDX-License-Identifier: GPL-3.0-or-later
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "../common/choices.hpp"
#include "../common/files.hpp"
#include "bake_run.hpp"
#include "commands.hpp"
#include "depfile.hpp"
#include "dry_run.hpp"
#include "job_list.hpp"
#include "overwrite.hpp"
#include "plan/shard_jobs.hpp"
#include "report/report_page.hpp"
#include "settings.hpp"
#include "stop_signals.hpp"

namespace sqmap::apps {
namespace {

/// Whether the files that are written beside the bundles may be written where they shall be.
Outcome check_side_outputs(const BakeArguments& arguments, const JobList& list) {
  const std::filesystem::path &report = arguments.report, &depfile = arguments.depfile;
  if (report.empty() && depfile.empty()) return Done{};
  std::vector<std::filesystem::path> read, bundles;
  for (const Job& job : list.jobs) {
    read.push_back(job.input);
    read.insert(read.end(), job.config_files.begin(), job.config_files.end());
    bundles.push_back(job.output);
  }
  if (!report.empty()) {
    if (const Outcome ok = check_page("--report", report, arguments.request.force, bundles); !ok)
      return ok.error();
    if (const Outcome ok = check_apart("--report", report, "an input", read); !ok) return ok.error();
  }
  if (depfile.empty()) return Done{};
  if (const Outcome ok = check_apart("--depfile", depfile, "an input", read); !ok) return ok.error();
  if (const Outcome ok = check_apart("--depfile", depfile, "an output", bundles); !ok) return ok.error();
  if (!report.empty() && is_same_file(depfile, report))
    return Error{Status::kBadOption, fmt::format("--depfile {}: is the report, too", depfile.string()),
                 "name another file"};
  return check_depfile(depfile, arguments.request.force, bundles);
}

/// Limits are kept by ending a worker, and there is none without isolation.
Outcome check_limits(const BakeArguments& arguments) {
  if (!arguments.no_isolation) return Done{};
  for (const char* limit : {"timeout", "memory"}) {
    const auto given = arguments.request.config.command_line.find(limit);
    if (given != arguments.request.config.command_line.end() && given->second != "none")
      return Error{
          Status::kBadOption,
          fmt::format("--no-isolation and --{} exclude each other: a limit ends a worker, and there is none",
                      limit),
          "leave one of them out"};
  }
  return Done{};
}

Outcome write_run_report(const BakeArguments& arguments, std::string_view record_lines) {
  const Result<AssetRecords> records = parse_asset_records(record_lines, "records");
  if (!records) return records.error();
  const JobRequest& request = arguments.request;
  ReportOptions options;
  options.title =
      "sqbake bake " + (request.inputs.empty() ? request.manifest.string() : request.inputs.front());
  const std::string page = report_page(records.value().records, options);
  const WriteGuard guard;
  if (stop_signal() != 0) return Done{};
  return write_file(arguments.report, page);
}

/// Leaves the share that was asked for; where none was, and the meshes were searched for, that of the job
/// array. Who named a mesh in a task of an array has dealt the meshes out already.
Outcome take_shard(Console& console, const BakeArguments& arguments, JobList& list) {
  const auto leave_shard = [&](const Shard& shard) -> Outcome {
    const Result<std::vector<std::uint64_t>> costs = costs_of(console, list, arguments.costs);
    if (!costs) return costs.error();
    keep_shard(list, costs.value(), shard);
    return Done{};
  };
  if (!arguments.shard.empty()) {
    const Result<Shard> shard = parse_shard(arguments.shard);
    if (!shard) return shard.error();
    return leave_shard(shard.value());
  }
  const Result<std::optional<Shard>> shard =
      list.is_searched ? shard_of_job_array() : Result<std::optional<Shard>>(std::nullopt);
  if (!shard) return shard.error();
  if (!shard.value() && !arguments.costs.empty())
    return Error{Status::kBadOption, "--costs decides which mesh is in which shard, and there is none",
                 "add --shard I/N"};
  if (!shard.value() || shard.value()->count == 1) return Done{};
  const std::size_t all = list.jobs.size();
  if (const Outcome ok = leave_shard(*shard.value()); !ok) return ok.error();
  console.insist(
      fmt::format("a task of a job array: bakes --shard {}/{}, {} of {} meshes; --shard 1/1 bakes all",
                  shard.value()->index + 1, shard.value()->count, list.jobs.size(), all));
  return Done{};
}

Exit run_bake(Console& console, const BakeArguments& arguments) {
  console.set_quiet(arguments.quiet);
  if (const auto ok = options_from(arguments.request.config.command_line); !ok)
    return refuse(console, ok.error());
  if (const Outcome ok = check_limits(arguments); !ok) return refuse(console, ok.error());
  Result<JobList> list = list_jobs(arguments.request);
  if (!list) return refuse(console, list.error());
  if (const Outcome ok = take_shard(console, arguments, list.value()); !ok)
    return refuse(console, ok.error());
  if (const Outcome ok = check_side_outputs(arguments, list.value()); !ok) return refuse(console, ok.error());
  if (const Outcome ok = check_folders(list.value(), arguments.request); !ok)
    return refuse(console, ok.error());
  if (arguments.dry_run) {
    print_plan(console, list.value(), arguments);
    return Exit::kOk;
  }
  if (const Outcome ok = prepare_folders(list.value(), arguments.request); !ok)
    return refuse(console, ok.error());
  install_stop_signals();
  const std::vector<Job> jobs = arguments.depfile.empty() ? std::vector<Job>() : list.value().jobs;
  BakeRun bake_run(console, arguments, std::move(list).value());
  const Exit code = bake_run.run();
  if (!arguments.report.empty() && stop_signal() == 0) {
    const Outcome ok = write_run_report(arguments, bake_run.record_lines());
    if (stop_signal() != 0) return static_cast<Exit>(128 + stop_signal());
    if (!ok) {
      const Exit refused = refuse(console, ok.error());
      if (code == Exit::kOk) return refused;
    }
  }
  if (code == Exit::kOk && !arguments.depfile.empty())
    if (const Outcome ok = write_depfile(arguments.depfile, jobs); !ok) return refuse(console, ok.error());
  return code;
}

constexpr const char* kDescription =
    "Cuts each mesh into parts, bounds every part by a superquadric, stores distance maps on it and writes "
    "one\n"
    "bundle per mesh. A folder stands for the meshes in it (off obj ply stl gltf glb dae fbx 3mf), a pattern "
    "in\n"
    "quotes for those that match (* ? [a-z], ** for any folders), @LIST for the inputs in a file, one a "
    "line\n"
    "(@@LIST: paths from the list's folder; @-: standard input).\n"
    "Each mesh is baked in a process of its own: one that fails, hangs or crashes does not stop the others.\n"
    "\n"
    "Examples:\n"
    "  sqbake bake hand.off -o hand.h5\n"
    "  sqbake bake hand.stl -o hand.h5 --unit mm --up y --max-error 0.2mm\n"
    "  sqbake bake models/ --recursive --out-dir bundles/ --quality draft -j 8\n"
    "  sqbake bake 'models/**/*.obj' --out-dir bundles/ --timeout 2m --memory 4G --fallback superquadric\n"
    "  sqbake bake --manifest props.toml --out-dir bundles/ --format ndjson\n"
    "\n"
    "A mesh's own settings stand in hand.off.sqbake.toml or hand.sqbake.toml beside it, those of many in "
    "the\n"
    "nearest sqbake.toml above it; `sqbake config show hand.off` prints what holds for it, and why.\n";

void add_input_options(CLI::App& app, JobRequest& request) {
  app.add_option("INPUT", request.inputs, "Mesh files, folders, patterns and @lists of them");
  app.add_option("--manifest", request.manifest, "TOML file that names meshes, with settings for each")
      ->type_name("FILE.toml");
  app.add_option("-o,--output", request.output, "Bundle to write, for one mesh file")->type_name("FILE.h5");
  app.add_option("--out-dir", request.out_dir, "Folder for the bundles; mirrors the folders of the input")
      ->type_name("DIR");
  app.add_flag("--recursive", request.recursive, "Look below the folders named, too");
  app.add_flag("--keep-extension", request.keep_extension, "Call the bundles NAME.off.h5, not NAME.h5");
  app.add_flag("--force", request.force,
               "Overwrite files that are not sqmap bundles, a --depfile and a --report that is none");
}

void add_run_options(CLI::App& app, BakeArguments& arguments) {
  app.add_option("-j,--jobs", arguments.threads,
                 "Threads of all workers together; 0: as many as this process may use\n"
                 "(default 0). Below GNU make, at most as many as its jobserver grants")
      ->check(CLI::Range(0, 4096).description(""))
      ->type_name("COUNT");
  app.add_flag("-n,--dry-run", arguments.dry_run, "Print what would be baked; write nothing");
  app.add_option("--shard", arguments.shard,
                 "Bake only the I-th of N shares of the meshes, as `sqbake plan` deals them out;\n"
                 "auto: as the job array of Slurm or Kubernetes says, which is also the default for\n"
                 "what a folder, a pattern, a list or a manifest names; 1/1: all")
      ->type_name("I/N");
  app.add_option("--costs", arguments.costs,
                 "With --shard: records of an earlier bake, as of `sqbake plan`; the same in every shard")
      ->type_name("FILE.ndjson");
  app.add_flag("--fail-fast", arguments.fail_fast, "Begin no further mesh once one has failed");
  app.add_flag("--strict", arguments.strict, "A degraded bundle makes the run fail");
  app.add_flag("--verify-determinism", arguments.verify_determinism,
               "Bake each mesh twice, with two numbers of threads; fail where the bytes differ");
  app.add_flag("--no-isolation", arguments.no_isolation,
               "Bake in this process, for debuggers and profilers: one mesh at a time, no limits");
  app.add_option("--cache", arguments.cache,
                 "Folder of finished bundles, which may be shared (default: SQMAP_CACHE_DIR,\n"
                 "else sqmap in XDG_CACHE_HOME or in ~/.cache; none where SQMAP_CACHE_DIR\n"
                 "is set to nothing)")
      ->type_name("DIR");
  app.add_flag("!--no-cache", arguments.use_cache, "Bake all; neither read nor fill the cache");
  app.add_flag("--explain", arguments.explain, "Say why each mesh is baked, or is not; with -n, would be");
  app.add_option("--report", arguments.report, "Write a page of the run, as `sqbake report` makes it")
      ->type_name("FILE.html");
  app.add_option("--depfile", arguments.depfile, "Write the files read, as a rule for make and ninja")
      ->type_name("FILE");
}

void add_output_options(CLI::App& app, BakeArguments& arguments) {
  add_choice<RecordFormat>(
      app, "--format", arguments.format,
      {{"text", RecordFormat::kText}, {"json", RecordFormat::kJson}, {"ndjson", RecordFormat::kNdjson}},
      "Results on stdout: text, json, ndjson (default text)");
  add_choice<When>(app, "--progress", arguments.progress,
                   {{"auto", When::kAuto}, {"always", When::kAlways}, {"never", When::kNever}},
                   "auto: a line on a terminal; always: also one line a stage in logs; never (default auto)");
  CLI::Option* quiet =
      app.add_flag("-q,--quiet", arguments.quiet, "Only errors, and what is degraded; no table");
  app.add_flag("-v,--verbose", arguments.verbose, "Add the time of every stage to the table")
      ->excludes(quiet);
}

}  // namespace

std::function<Exit(Console&)> declare_bake(CLI::App& app) {
  const auto args = std::make_shared<BakeArguments>();
  app.description(kDescription);
  add_input_options(app, args->request);
  add_all_setting_options(app, args->request.config.command_line);
  app.add_option("--config", args->request.config.project,
                 "This project file for all, not the nearest sqbake.toml")
      ->type_name("FILE.toml");
  app.add_flag("!--no-config", args->request.config.use_files, "Read neither project files nor sidecars");
  add_run_options(app, *args);
  add_output_options(app, *args);
  return [args](Console& console) { return run_bake(console, *args); };
}

}  // namespace sqmap::apps
