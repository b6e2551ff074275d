// SPDX-License-Identifier: GPL-3.0-or-later
//
// A point slides over the object, 0.5 % of R_max deep: how steady is the force that each method answers?
// After the paper's Fig. 13b, which plots the change of force from frame to frame.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>

#include "peer_rows.hpp"
#include "suites.hpp"
#include "work.hpp"

namespace sqmap::bench {
namespace {

constexpr double kDepth = 0.005;  ///< of R_max
constexpr double kJump = 0.1;     ///< of the mean force

/// Points at constant depth where rays from all around towards the centre enter. Empty slots break the slide:
/// the next entry lies elsewhere.
std::vector<Vec3d> slide(const Model& model, std::size_t count) {
  const Vec3d centre = 0.5 * (model.low_m + model.high_m);
  std::vector<Vec3d> path;
  for (std::size_t i = 0; i < count; ++i) {
    const double t = (static_cast<double>(i) + 0.5) / static_cast<double>(count), z = 0.9 * (1 - 2 * t);
    const double angle = 2 * std::numbers::pi * 3 * t, r = std::sqrt(1 - z * z);
    const Vec3d direction{r * std::cos(angle), r * std::sin(angle), z};
    double out_m = norm(model.high_m - model.low_m);
    double d = 0;
    for (int step = 0; step < 200 && out_m > 0; ++step) {  // the distance is a safe step
      d = model.oracle->signed_distance(centre + out_m * direction) + kDepth * model.r_max_m();
      if (d < 1e-7 * model.r_max_m()) break;
      out_m -= d;
    }
    if (out_m > 0 && d < 1e-5 * model.r_max_m())
      path.push_back(cast<double>(cast<float>(centre + out_m * direction)));
  }
  return path;
}

ForceRow follow(const Model& model, const BuiltPeer& built, const Cloud& cloud,
                const std::vector<Vec3d>& path) {
  Hits hits(cloud.count);
  built.peer->answer(cloud, {}, hits);
  std::vector<Vec3d> force(path.size()), normal(path.size());
  std::vector<bool> is_answered(path.size());
  for (std::size_t i = 0; i < hits.count; ++i) {
    const std::uint32_t at = cloud.source[hits.point[i]];
    force[at] = {hits.force_x_n[i], hits.force_y_n[i], hits.force_z_n[i]};
    normal[at] = {hits.normal_x[i], hits.normal_y[i], hits.normal_z[i]};
    is_answered[at] = true;
  }
  const double mean_n = kStiffness_n_per_m * kDepth * model.r_max_m();
  const double longest_m = 0.01 * model.r_max_m();  // longer steps are no slide
  ForceRow row{model.name, built.entrant.id};
  double angle_rad = 0, change = 0;
  std::size_t angles = 0, missing = 0, jumps = 0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (!is_answered[i]) {
      ++missing;
    } else {
      const auto nearest = model.oracle->nearest(path[i]);
      const Vec3d truth = normalized(nearest.nearest_m - path[i]);
      angle_rad += std::atan2(norm(cross(normal[i], truth)), dot(normal[i], truth));
      ++angles;
    }
    if (i == 0 || norm(path[i] - path[i - 1]) > longest_m) continue;
    const double step = norm(force[i] - force[i - 1]) / mean_n;
    ++row.steps;
    change += step;
    if (step > kJump) ++jumps;
    row.worst_jump_percent = std::max(row.worst_jump_percent, 100 * step);
  }
  const auto steps = static_cast<double>(std::max<std::size_t>(row.steps, 1));
  row.jumps_percent = 100 * static_cast<double>(jumps) / steps;
  row.mean_change_percent = 100 * change / steps;
  row.direction_error_deg = angles == 0 ? std::numeric_limits<double>::quiet_NaN()
                                        : angle_rad / static_cast<double>(angles) * 180 / std::numbers::pi;
  row.unanswered_percent =
      100 * static_cast<double>(missing) / static_cast<double>(std::max<std::size_t>(path.size(), 1));
  return row;
}

}  // namespace

void run_force(const SuiteInput& input, Results& results) {
  for (const Model& model : input.models) {
    input.note(fmt::format("force: {}", model.name));
    const std::vector<Vec3d> path = slide(model, input.is_smoke ? 400 : 8000);
    const Cloud cloud(path);
    for (const Entrant& entrant : frame_entrants(input.is_smoke))
      results.force.push_back(follow(model, build_peer(entrant, model, results), cloud, path));
  }
}

}  // namespace sqmap::bench
