// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "sqmap/runtime/budget.hpp"
#include "sqmap/runtime/scene.hpp"

#include "../common/files.hpp"
#include "frame_clock.hpp"
#include "latency.hpp"
#include "motion.hpp"
#include "probe_mesh.hpp"
#include "runs.hpp"
#include "trace.hpp"

namespace sqmap::apps {
namespace {

Outcome write_outputs(const LoadedScene& scene, const std::vector<TraceRow>& rows,
                      const std::filesystem::path& folder) {
  if (Outcome ok = write_file(folder / "trace.csv", trace_csv(rows)); !ok) return ok;
  if (Outcome ok = write_file(folder / "trace.svg", trace_svg(rows, "sqsim: probe")); !ok) return ok;
  const auto glb = picture_glb(scene.objects, "probe", moved(scene.probe, rows.back().pose));
  if (!glb) return glb.error();
  return write_file(folder / "last_frame.glb", glb.value());
}

/// What a run comes to besides its rows.
struct RunReport {
  FrameClock clock;
  std::vector<double> processor_us;  ///< of each frame
  std::size_t part_count{}, resident_bytes{};
};

/// Runs the scene once, from its start, into `rows`.
Result<RunReport> run_once(const LoadedScene& loaded, const runtime::Probe& probe, bool is_fast,
                           std::span<TraceRow> rows) {
  const ProbeEntry& entry = *loaded.file.probe;
  std::vector<runtime::SceneObject> objects;
  for (const DrawnObject& object : loaded.objects) objects.push_back({object.asset, object.placement});
  Result<runtime::Scene> built = runtime::Scene::build(objects, probe, loaded.file.options);
  if (!built) return built.error();
  runtime::Scene& scene = built.value();

  const double step_s = 1 / loaded.file.rate_hz;
  std::optional<CoupledProbe> coupled;
  if (entry.coupling) coupled.emplace(*entry.coupling, pose_at(entry.keyframes, 0));
  const std::optional<BudgetEntry>& allowed = loaded.file.budget;
  runtime::WorkRate rate;

  std::vector<double> processor_us;
  processor_us.reserve(rows.size());
  FrameClock clock(loaded.file.rate_hz, is_fast);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    TraceRow& row = rows[i];
    row.time_s = static_cast<double>(i) * step_s;
    clock.begin();
    const Pose handle = pose_at(entry.keyframes, row.time_s);
    row.pose = coupled ? coupled->pose() : handle;
    runtime::WorkBudget budget;
    if (allowed)
      budget.units = allowed->microseconds > 0 ? rate.units_for(allowed->microseconds) : allowed->units;
    const Vec3d& about_m = row.pose.translation_m;
    const runtime::FrameResult result =
        allowed ? scene.frame(row.pose, about_m, static_cast<float>(step_s), budget)
                : scene.frame(row.pose, about_m, static_cast<float>(step_s));
    if (coupled)
      coupled->step(handle, cast<double>(result.wrench.force_n), cast<double>(result.wrench.torque_nm),
                    step_s);
    row.force_n = result.wrench.force_n;
    row.torque_nm = result.wrench.torque_nm;
    row.contacts = result.inside;
    row.layer = static_cast<int>(result.layer);
    row.work_units = budget.spent;
    row.microseconds = clock.end();
    processor_us.push_back(clock.processor_us());
    rate.learn(budget.spent, row.microseconds);
    for (std::size_t k = 0; k < objects.size(); ++k)
      for (const runtime::Contact& contact : scene.contacts(k))
        row.deepest_m = std::max(row.deepest_m, static_cast<double>(contact.depth_m));
  }
  return RunReport{clock, std::move(processor_us), scene.part_count(), scene.resident_bytes()};
}

/// How many frames had to do with which layer.
std::string budget_text(const BudgetEntry& budget, std::span<const TraceRow> rows) {
  std::size_t frames[4] = {};
  std::uint64_t most = 0;
  for (const TraceRow& row : rows) {
    ++frames[static_cast<std::size_t>(row.layer)];
    most = std::max(most, row.work_units);
  }
  return fmt::format(
      "budget of {}: first contact by layer 1 in {} frames, 2 in {}, 3 in {}; most work {} units\n",
      budget.microseconds > 0 ? fmt::format("{} us", budget.microseconds)
                              : fmt::format("{} units", budget.units),
      frames[1], frames[2], frames[3], most);
}

}  // namespace

Outcome run_probe(Console& console, const LoadedScene& loaded, const RunOptions& options) {
  const ProbeEntry& entry = *loaded.file.probe;
  const runtime::Probe probe =
      entry.mesh.empty() ? runtime::Probe{entry.points_m} : probe_of(loaded.probe, entry.zone_m);
  const double rate_hz = loaded.file.rate_hz;
  const auto frames = static_cast<std::size_t>(std::llround(loaded.file.seconds * rate_hz));
  std::vector<TraceRow> rows(std::max<std::size_t>(frames, 1));
  const Result<RunReport> report = run_once(loaded, probe, options.is_fast, rows);
  if (!report) return report.error();

  std::vector<double> microseconds;
  std::size_t touching = 0;
  double deepest_m = 0;
  for (const TraceRow& row : rows) {
    microseconds.push_back(row.microseconds);
    touching += row.contacts > 0 ? 1 : 0;
    deepest_m = std::max(deepest_m, row.deepest_m);
  }
  const RunReport& run = report.value();
  console.out(fmt::format("{} objects of {} parts, {:.1f} KiB; probe of {} points; {} frames at {} Hz{}\n",
                          loaded.objects.size(), run.part_count,
                          static_cast<double>(run.resident_bytes) / 1024, probe.points_m.size(), rows.size(),
                          rate_hz, options.is_fast ? ", not waited for" : ""));
  console.out(latency_text(microseconds));
  std::vector<double> touching_us;
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (rows[i].contacts > 0) touching_us.push_back(run.processor_us[i]);
  console.out(fmt::format("of the processor alone: {}; in contact: {}\n", percentiles_text(run.processor_us),
                          percentiles_text(touching_us)));
  console.out(missed_text(run.clock));
  if (options.runs > 1) {
    std::vector<TraceRow> again(rows.size());
    for (int k = 1; k < options.runs; ++k) {
      std::ranges::fill(again, TraceRow{});
      const Result<RunReport> repeated = run_once(loaded, probe, true, again);
      if (!repeated) return repeated.error();
      for (std::size_t i = 0; i < again.size(); ++i)
        microseconds[i] = std::min(microseconds[i], again[i].microseconds);
    }
    console.out(fmt::format("each frame's shortest time in {} runs: {}\n", options.runs,
                            percentiles_text(microseconds)));
  }
  if (loaded.file.budget) console.out(budget_text(*loaded.file.budget, rows));
  const Jumps jumps = force_jumps(rows);
  console.out(fmt::format(
      "in contact: {} frames, at most {:.1f} mm deep; force jumps > 10 %: {} of {} steps in contact, {} of "
      "them "
      "above {} N; largest change {:.2f} N\n",
      touching, 1e3 * deepest_m, jumps.jumps, jumps.steps, jumps.firm_jumps, kFirm_n, jumps.most_n));
  return options.output.empty() ? Outcome(Done{}) : write_outputs(loaded, rows, options.output);
}

}  // namespace sqmap::apps
