// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

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

}  // namespace

Outcome run_probe(Console& console, const LoadedScene& loaded, const RunOptions& options) {
  const ProbeEntry& entry = *loaded.file.probe;
  std::vector<runtime::SceneObject> objects;
  for (const DrawnObject& object : loaded.objects) objects.push_back({object.asset, object.placement});
  runtime::Probe probe =
      entry.mesh.empty() ? runtime::Probe{entry.points_m} : probe_of(loaded.probe, entry.zone_m);
  const std::size_t points = probe.points_m.size();
  Result<runtime::Scene> built = runtime::Scene::build(objects, std::move(probe), loaded.file.options);
  if (!built) return built.error();
  runtime::Scene& scene = built.value();

  const double rate_hz = loaded.file.rate_hz, step_s = 1 / rate_hz;
  const auto frames = static_cast<std::size_t>(std::llround(loaded.file.seconds * rate_hz));
  std::vector<TraceRow> rows(std::max<std::size_t>(frames, 1));
  std::optional<CoupledProbe> coupled;
  if (entry.coupling) coupled.emplace(*entry.coupling, pose_at(entry.keyframes, 0));

  FrameClock clock(rate_hz, options.is_fast);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    TraceRow& row = rows[i];
    row.time_s = static_cast<double>(i) * step_s;
    clock.begin();
    const Pose handle = pose_at(entry.keyframes, row.time_s);
    row.pose = coupled ? coupled->pose() : handle;
    const runtime::FrameResult result =
        scene.frame(row.pose, row.pose.translation_m, static_cast<float>(step_s));
    if (coupled)
      coupled->step(handle, cast<double>(result.wrench.force_n), cast<double>(result.wrench.torque_nm),
                    step_s);
    row.force_n = result.wrench.force_n;
    row.torque_nm = result.wrench.torque_nm;
    row.contacts = result.inside;
    row.layer = static_cast<int>(result.layer);
    row.microseconds = clock.end();
    for (std::size_t k = 0; k < objects.size(); ++k)
      for (const runtime::Contact& contact : scene.contacts(k))
        row.deepest_m = std::max(row.deepest_m, static_cast<double>(contact.depth_m));
  }

  std::vector<double> microseconds;
  std::size_t touching = 0;
  double deepest_m = 0;
  for (const TraceRow& row : rows) {
    microseconds.push_back(row.microseconds);
    touching += row.contacts > 0 ? 1 : 0;
    deepest_m = std::max(deepest_m, row.deepest_m);
  }
  const Jumps jumps = force_jumps(rows);
  console.out(fmt::format("{} objects of {} parts, {:.1f} KiB; probe of {} points; {} frames at {} Hz{}\n",
                          loaded.objects.size(), scene.part_count(),
                          static_cast<double>(scene.resident_bytes()) / 1024, points, rows.size(), rate_hz,
                          options.is_fast ? ", not waited for" : ""));
  console.out(latency_text(microseconds));
  console.out(fmt::format("missed deadlines: {} ({} of them begun late by the system)\n", clock.missed(),
                          clock.overslept()));
  console.out(fmt::format(
      "in contact: {} frames, at most {:.1f} mm deep; force jumps > 10 %: {} of {} steps in contact\n",
      touching, 1e3 * deepest_m, jumps.jumps, jumps.steps));
  return options.output.empty() ? Outcome(Done{}) : write_outputs(loaded, rows, options.output);
}

}  // namespace sqmap::apps
