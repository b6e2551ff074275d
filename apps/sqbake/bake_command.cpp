// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "sqmap/bake/bake.hpp"
#include "sqmap/io/bundle.hpp"

#include "commands.hpp"
#include "job_list.hpp"
#include "mesh_options.hpp"
#include "progress_board.hpp"
#include "quantities.hpp"
#include "records.hpp"
#include "stop_signals.hpp"
#include "worker_pool.hpp"

namespace sqmap::apps {
namespace {

using Clock = std::chrono::steady_clock;

struct BakeArguments {
  JobRequest request;
  MeshOptions mesh;
  std::optional<ErrorTarget> max_error;
  bake::BakeOptions bake;
  unsigned threads = 0;
  RecordFormat format = RecordFormat::kText;
  When progress = When::kAuto;
  bool quiet = false;
  bool verbose = false;
};

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// One run of the subcommand: bakes jobs side by side, reports them in their order.
class BakeRun {
 public:
  BakeRun(Console& console, const BakeArguments& arguments, JobList list)
      : console_(console),
        arguments_(arguments),
        list_(std::move(list)),
        board_(console, arguments.quiet ? When::kNever : arguments.progress, board_items(list_)),
        writer_(console, writer_options(arguments, list_)),
        records_(list_.jobs.size()) {}

  Exit run();

 private:
  static std::vector<ProgressBoard::Item> board_items(const JobList& list);
  static RecordWriter::Options writer_options(const BakeArguments& arguments, const JobList& list);

  BakeRecord bake_one(std::size_t index);
  std::optional<Error> bake_into(BakeRecord& record, std::size_t index);
  void hand_in(std::size_t index, BakeRecord record);
  Exit exit_code() const;

  Console& console_;
  const BakeArguments& arguments_;
  JobList list_;
  ProgressBoard board_;
  RecordWriter writer_;
  std::vector<std::optional<BakeRecord>> records_;  ///< finished, not yet reported
  std::size_t reported_ = 0;
  std::size_t failed_ = 0, cancelled_ = 0;
  std::optional<Status> last_failure_;
  std::mutex mutex_;
};

std::vector<ProgressBoard::Item> BakeRun::board_items(const JobList& list) {
  std::vector<ProgressBoard::Item> items;
  for (const Job& job : list.jobs) items.push_back({job.name, job.input_bytes});
  return items;
}

RecordWriter::Options BakeRun::writer_options(const BakeArguments& arguments, const JobList& list) {
  std::size_t width = 0;
  for (const Job& job : list.jobs) width = std::max(width, job.name.size());
  return {arguments.format, arguments.quiet, arguments.verbose, list.single_file, width};
}

/// The bake's options for one mesh: a target given as a length becomes a share of R_max.
bake::BakeOptions options_for(const BakeArguments& arguments, const bake::SourceMesh& source) {
  bake::BakeOptions options = arguments.bake;
  options.read = arguments.mesh.read;
  options.repair = arguments.mesh.repair;
  if (!arguments.max_error) return options;
  options.max_error_percent = arguments.max_error->percent;
  // R_max is known only after repair; the diagonal is never shorter, so the target is never looser than
  // asked.
  if (arguments.max_error->length_m > 0)
    options.max_error_percent =
        std::min(100.0, 100 * arguments.max_error->length_m / diagonal_m(source.mesh));
  return options;
}

std::optional<Error> BakeRun::bake_into(BakeRecord& record, std::size_t index) {
  const Job& job = list_.jobs[index];
  bake::Progress progress;
  progress.report = [&](std::string_view stage, double fraction) { board_.at(index, stage, fraction); };
  progress.cancelled = [] { return stop_signal() != 0; };

  progress.at("read", 0);
  const Clock::time_point read_start = Clock::now();
  const Result<bake::SourceMesh> source = bake::read_mesh(job.input, arguments_.mesh.read);
  if (!source) return source.error();
  const double read_s = seconds_since(read_start);
  if (const auto warning = size_warning(source.value().mesh)) console_.warning(job.name + ": " + *warning);

  Result<bake::BakeResult> result =
      bake::bake(source.value(), options_for(arguments_, source.value()), progress);
  if (!result) return result.error();
  record.describe(result.value().asset);
  record.stopped_by = result.value().stopped_by;

  progress.at("write", 0);
  const Clock::time_point write_start = Clock::now();
  {
    const WriteGuard guard;
    if (stop_signal() != 0) return Error{Status::kCancelled, "stopped before the bundle was written", ""};
    if (const Outcome written = io::write(result.value().asset, job.output); !written) return written.error();
  }
  record.times.push_back({"read", read_s});
  for (bake::StageTime& time : result.value().times) record.times.push_back(std::move(time));
  record.times.push_back({"write", seconds_since(write_start)});
  std::error_code code;
  record.bytes = std::filesystem::file_size(job.output, code);
  return std::nullopt;
}

BakeRecord BakeRun::bake_one(std::size_t index) {
  const Job& job = list_.jobs[index];
  BakeRecord record;
  record.input = job.input.string();
  record.output = job.output.string();
  record.name = job.name;
  const Clock::time_point start = Clock::now();
  if (stop_signal() != 0) {
    record.error = Error{Status::kCancelled, "stopped before it began", ""};
  } else {
    try {
      record.error = bake_into(record, index);
    } catch (const std::bad_alloc&) {
      record.error =
          Error{Status::kBakeFailed, "out of memory", "bake fewer assets at once (-j), or a smaller mesh"};
    } catch (const std::exception& problem) {
      record.error = Error{Status::kBakeFailed, std::string("internal error: ") + problem.what(), ""};
    }
  }
  record.seconds = seconds_since(start);
  return record;
}

void BakeRun::hand_in(std::size_t index, BakeRecord record) {
  board_.finished(index);
  const std::scoped_lock lock(mutex_);
  records_[index] = std::move(record);
  for (; reported_ < records_.size() && records_[reported_]; ++reported_) {
    BakeRecord& next = *records_[reported_];
    if (next.error && next.error->status == Status::kCancelled) {
      ++cancelled_;
    } else if (next.error) {
      ++failed_;
      last_failure_ = next.error->status;
      console_.error(message_for(next.input, *next.error));
    }
    writer_.add(next);
    next = {};  // the slot stays engaged; its contents are no longer needed
  }
}

Exit BakeRun::exit_code() const {
  if (const int signal = stop_signal(); signal != 0) return static_cast<Exit>(128 + signal);
  if (failed_ == 0) return Exit::kOk;
  return list_.single_file ? exit_for(*last_failure_) : Exit::kSomeFailed;
}

Exit BakeRun::run() {
  const Clock::time_point start = Clock::now();
  const unsigned threads = arguments_.threads != 0 ? arguments_.threads : available_threads();
  run_jobs(list_.jobs.size(), threads, [&](std::size_t index) { hand_in(index, bake_one(index)); });
  writer_.finish(seconds_since(start));
  if (!list_.single_file || cancelled_ > 0) {
    const std::size_t baked = list_.jobs.size() - failed_ - cancelled_;
    std::string summary = fmt::format("{} of {} baked", baked, list_.jobs.size());
    if (failed_ > 0) summary += fmt::format(", {} failed", failed_);
    if (cancelled_ > 0) summary += fmt::format(", {} stopped", cancelled_);
    console_.note(summary + fmt::format(" in {:.1f} s", seconds_since(start)));
  }
  return exit_code();
}

Exit run_bake(Console& console, const BakeArguments& arguments) {
  const auto refuse = [&](const Error& error) {
    console.error(error.remedy.empty() ? error.finding : error.finding + "; " + error.remedy);
    return exit_for(error.status);
  };
  console.set_quiet(arguments.quiet);
  if (const Outcome ok = arguments.bake.check(); !ok) return refuse(ok.error());
  Result<JobList> list = list_jobs(arguments.request);
  if (!list) return refuse(list.error());
  if (const Outcome ok = prepare_folders(list.value(), arguments.request); !ok) return refuse(ok.error());
  install_stop_signals();
  return BakeRun(console, arguments, std::move(list).value()).run();
}

/// Adds an option whose text `parse` turns into a value or an Error.
template <class Parse, class Store>
CLI::Option* add_parsed(CLI::App& app, const std::string& name, Parse parse, Store store,
                        const std::string& text) {
  return app.add_option_function<std::string>(
      name,
      [name, parse, store](const std::string& given) {
        const auto value = parse(given);
        if (!value) throw CLI::ValidationError(name, value.error().finding);
        store(value.value());
      },
      text);
}

constexpr const char* kDescription =
    "Cuts each mesh into parts, bounds every part by a superquadric, stores distance maps on it and writes "
    "one\n"
    "bundle per mesh. A folder stands for the meshes in it (off obj ply stl gltf glb dae fbx 3mf). With "
    "several\n"
    "inputs, one that fails does not stop the others.\n"
    "\n"
    "Examples:\n"
    "  sqbake bake hand.off -o hand.h5\n"
    "  sqbake bake hand.stl -o hand.h5 --unit mm --up y --max-error 0.2mm\n"
    "  sqbake bake models/ --recursive --out-dir bundles/ --max-bytes 64K -j 8\n"
    "  sqbake bake a.off b.off --out-dir bundles/ --format ndjson\n";

}  // namespace

std::function<Exit(Console&)> declare_bake(CLI::App& app) {
  const auto args = std::make_shared<BakeArguments>();
  const bake::BakeOptions& defaults = args->bake;
  app.description(kDescription);
  app.add_option("INPUT", args->request.inputs, "Mesh files and folders of them")->required();
  app.add_option("-o,--output", args->request.output, "Bundle to write, for one mesh file")
      ->type_name("FILE.h5");
  app.add_option("--out-dir", args->request.out_dir,
                 "Folder for the bundles; mirrors the folders of the input")
      ->type_name("DIR");
  app.add_flag("--recursive", args->request.recursive, "Look below the folders named, too");
  app.add_flag("--keep-extension", args->request.keep_extension, "Call the bundles NAME.off.h5, not NAME.h5");
  app.add_flag("--force", args->request.force, "Overwrite files that are not sqmap bundles");
  add_parsed(
      app, "--max-error", parse_error_target, [args](const ErrorTarget& target) { args->max_error = target; },
      fmt::format("Stop refining at this mean error of eq. 35: a percentage of R_max, the\n"
                  "largest distance between two vertices, or a length such as 0.2mm\n"
                  "(default {}%)",
                  defaults.max_error_percent))
      ->type_name("PCT|LENGTH");
  app.add_option("--max-parts", args->bake.max_parts,
                 fmt::format("Use at most this many parts (default {})", defaults.max_parts))
      ->type_name("COUNT");
  add_parsed(
      app, "--max-bytes", parse_bytes, [args](std::uint64_t bytes) { args->bake.max_bytes = bytes; },
      fmt::format("Encoded size of the maps, about; K and M are 1024 and 1024 * 1024 (default {}K)",
                  defaults.max_bytes / 1024))
      ->type_name("BYTES");
  add_mesh_options(app, args->mesh);
  app.add_option("-j,--jobs", args->threads, "Threads; 0: as many as this process may use (default 0)")
      ->check(CLI::Range(0, 4096).description(""))
      ->type_name("COUNT");
  app.add_option("--format", args->format, "Results on stdout: text, json, ndjson (default text)")
      ->transform(
          CLI::CheckedTransformer(std::map<std::string, RecordFormat>{{"text", RecordFormat::kText},
                                                                      {"json", RecordFormat::kJson},
                                                                      {"ndjson", RecordFormat::kNdjson}})
              .description(""))
      ->type_name("FORMAT");
  app.add_option("--progress", args->progress,
                 "auto: a line on a terminal; always: also one line a stage in logs; never (default auto)")
      ->transform(CLI::CheckedTransformer(std::map<std::string, When>{{"auto", When::kAuto},
                                                                      {"always", When::kAlways},
                                                                      {"never", When::kNever}})
                      .description(""))
      ->type_name("WHEN");
  CLI::Option* quiet = app.add_flag("-q,--quiet", args->quiet, "Errors only; no table");
  app.add_flag("-v,--verbose", args->verbose, "Add the time of every stage to the table")->excludes(quiet);
  return [args](Console& console) { return run_bake(console, *args); };
}

}  // namespace sqmap::apps
