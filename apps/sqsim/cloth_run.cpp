// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "sqmap/runtime/body.hpp"
#include "sqmap/runtime/contact.hpp"
#include "sqmap/runtime/instance.hpp"

#include "../common/files.hpp"
#include "cloth.hpp"
#include "frame_clock.hpp"
#include "latency.hpp"
#include "runs.hpp"
#include "trace.hpp"

namespace sqmap::apps {
namespace {

/// The objects, the cloth as a body that deforms, and room for the contacts of a frame.
struct Obstacles {
  std::deque<runtime::Object> objects;  // instances keep their addresses
  std::vector<runtime::Instance> instances;
  std::optional<runtime::PointBody> nodes;
  std::vector<runtime::Contact> contacts;
};

Outcome build(const LoadedScene& loaded, Obstacles& obstacles) {
  for (const DrawnObject& drawn : loaded.objects) {
    Result<runtime::Object> object = runtime::Object::build(*drawn.asset);
    if (!object) return object.error();
    obstacles.objects.push_back(std::move(object).value());
    const Result<runtime::Instance> instance =
        runtime::Instance::place(obstacles.objects.back(), drawn.placement);
    if (!instance) return instance.error();
    obstacles.instances.push_back(instance.value());
  }
  return Done{};
}

struct Collided {
  std::uint32_t contacts{};
  double deepest_m{};
  Vec3d impulse_n_s;  ///< on the cloth
};

Collided collide(Cloth& cloth, Obstacles& obstacles, const ClothEntry& entry,
                 const runtime::QueryOptions& query) {
  Collided result;
  const auto thickness_m = static_cast<float>(entry.thickness_m);
  for (const runtime::Instance& instance : obstacles.instances) {
    if (!obstacles.nodes->refit(cloth.nodes_m())) break;  // a node that is not finite
    const std::size_t found =
        instance.contacts(*obstacles.nodes, {}, obstacles.contacts, {query, thickness_m});
    for (const runtime::Contact& contact : std::span(obstacles.contacts).first(found)) {
      // Beside a seam: inside, depth unknown.
      const bool is_unknown = contact.depth_m == 0 && contact.surface_m == contact.position_m;
      const Vec3d impulse_n_s =
          is_unknown ? cloth.put_back(contact.point)
                     : cloth.push_out(contact.point, entry.thickness_m + static_cast<double>(contact.depth_m),
                                      cast<double>(contact.normal), entry.friction);
      result.impulse_n_s = result.impulse_n_s + impulse_n_s;
      result.deepest_m = std::max(result.deepest_m, static_cast<double>(contact.depth_m));
    }
    result.contacts += static_cast<std::uint32_t>(found);
  }
  return result;
}

Vec3d centre_of(std::span<const Vec3f> nodes_m) {
  Vec3d sum;
  for (const Vec3f& p : nodes_m) sum = sum + cast<double>(p);
  return (1 / static_cast<double>(nodes_m.size())) * sum;
}

}  // namespace

Outcome run_cloth(Console& console, const LoadedScene& loaded, const RunOptions& options) {
  using Clock = std::chrono::steady_clock;
  const ClothEntry& entry = *loaded.file.cloth;
  Obstacles obstacles;
  if (Outcome ok = build(loaded, obstacles); !ok) return ok;
  Cloth cloth(entry);
  runtime::QueryOptions query = loaded.file.options.query;
  query.edge_length_m = static_cast<float>(entry.edge_m / (entry.nodes_along_edge - 1));
  Result<runtime::PointBody> nodes = runtime::PointBody::build(cloth.nodes_m());
  if (!nodes) return nodes.error();
  obstacles.nodes.emplace(std::move(nodes).value());
  obstacles.contacts.resize(cloth.nodes_m().size());

  const double step_s = 1 / loaded.file.rate_hz;
  const auto frames = static_cast<std::size_t>(std::llround(loaded.file.seconds * loaded.file.rate_hz));
  std::vector<TraceRow> rows(std::max<std::size_t>(frames, 1));
  std::vector<double> whole_us, processor_us, ours_us;
  whole_us.reserve(rows.size());
  processor_us.reserve(rows.size());
  ours_us.reserve(rows.size());
  FrameClock clock(loaded.file.rate_hz, options.is_fast);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    clock.begin();
    cloth.step(step_s);
    const Clock::time_point fallen = Clock::now();
    const Collided collided = collide(cloth, obstacles, entry, query);
    ours_us.push_back(std::chrono::duration<double, std::micro>(Clock::now() - fallen).count());
    whole_us.push_back(clock.end());
    processor_us.push_back(clock.processor_us());
    rows[i] = {static_cast<double>(i + 1) * step_s,
               {{}, centre_of(cloth.nodes_m())},
               cast<float>((1 / step_s) * collided.impulse_n_s),
               {},
               collided.contacts,
               static_cast<int>(loaded.file.options.query.layer),
               ours_us.back(),
               collided.deepest_m};
  }
  console.out(fmt::format("cloth of {} nodes, {} frames at {} Hz{}\n", cloth.nodes_m().size(), rows.size(),
                          loaded.file.rate_hz, options.is_fast ? ", not waited for" : ""));
  console.out("collision alone:\n" + latency_text(ours_us));
  console.out(fmt::format("with Bullet's cloth: {}; of the processor alone: {}\n", percentiles_text(whole_us),
                          percentiles_text(processor_us)));
  console.out(missed_text(clock));
  console.out(
      fmt::format("last frame: {} of {} nodes in contact\n", rows.back().contacts, cloth.nodes_m().size()));
  if (options.output.empty()) return Done{};
  if (Outcome ok = write_file(options.output / "trace.csv", trace_csv(rows)); !ok) return ok;
  if (Outcome ok = write_file(options.output / "trace.svg", trace_svg(rows, "sqsim: cloth")); !ok) return ok;
  const auto glb = picture_glb(loaded.objects, "cloth", cloth.surface());
  if (!glb) return glb.error();
  return write_file(options.output / "last_frame.glb", glb.value());
}

}  // namespace sqmap::apps
