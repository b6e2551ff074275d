// SPDX-License-Identifier: GPL-3.0-or-later
//
// Random points around the surface: how wrong each method is, at every setting, and what a point costs.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "peer_rows.hpp"
#include "suites.hpp"
#include "timing.hpp"
#include "union_oracle.hpp"
#include "work.hpp"

namespace sqmap::bench {
namespace {

constexpr double kUncovered_percent = 1;   ///< HACD leaves out corners of its hulls
constexpr double kStandIn_percent = 0.02;  ///< Bullet takes faces for one whose normals differ by 2.5 degrees
constexpr double kNormalFrom = 0.001;  ///< of R_max: closer to the surface a direction is decided by rounding

/// Where solids stand for the mesh: the answers must be distances to them, and the mesh lie in them.
void check_stand_in(const Model& model, const BuiltPeer& built, const Shell& shell, const Cloud& cloud,
                    const Hits& hits, Results& results) {
  const UnionOracle solids(built.peer->stands_for());
  constexpr std::size_t kSampled = 1000;
  double error_m = 0, swapped_error_m = 0, out_m = 0, count = 0;
  for (std::size_t i = 0; i < hits.count; i += hits.count / kSampled + 1) {
    const double exact_m = solids.signed_distance(shell.points_m[cloud.source[hits.point[i]]]);
    error_m += std::abs(hits.distance_m[i] - exact_m);
    swapped_error_m += std::abs(hits.distance_m[i] + exact_m);
    ++count;
  }
  for (const Vec3d& v_m : model.mesh.vertices_m) out_m = std::max(out_m, solids.signed_distance(v_m));
  const auto add = [&](const char* claim, double found_m, double allowed_percent, bool is_control) {
    const double found = 100 * found_m / model.r_max_m();
    results.checks.push_back({model.name, built.entrant.id, claim, found, allowed_percent,
                              (found <= allowed_percent) != is_control});
  };
  count = std::max(count, 1.0);
  add("mean error against what stands for the mesh, percent of R_max", error_m / count, kStandIn_percent,
      false);
  add("answers with the sides swapped break it: mean error against what stands for the mesh, percent of "
      "R_max",
      swapped_error_m / count, kStandIn_percent, true);
  add("how far the mesh reaches out of what stands for it, percent of R_max", out_m, kUncovered_percent,
      false);
}

/// A stated mean must be one that wrong answers miss: those of the same peer with inside and outside swapped.
void check_statement(const Model& model, const BuiltPeer& built, const Shell& shell, const Cloud& cloud,
                     Results& results) {
  const StatedError stated = built.peer->stated_error();
  if (!stated.is_mean) return;  // a bound for every point, known without asking one
  Hits hits(cloud.count);
  built.peer->answer(cloud, {}, hits);
  if (!built.peer->stands_for().empty()) {
    check_stand_in(model, built, shell, cloud, hits, results);
    return;  // the mean is of what stands for the mesh: it may be as large as the distances themselves
  }
  double sum_m = 0;
  for (std::size_t i = 0; i < hits.count; ++i)
    sum_m += std::abs(hits.distance_m[i] + shell.distance_m[cloud.source[hits.point[i]]]);
  const double wrong =
      100 * sum_m / (static_cast<double>(std::max<std::size_t>(hits.count, 1)) * model.r_max_m());
  results.checks.push_back(
      {model.name, built.entrant.id,
       "answers with the sides swapped break the statement: mean error, percent of R_max", wrong,
       stated.percent, wrong > stated.percent});
}

AccuracyRow compare(const Model& model, const BuiltPeer& built, const Shell& shell, const Cloud& cloud,
                    Hits& hits) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  built.peer->answer(cloud, {}, hits);
  const std::size_t count = shell.points_m.size();
  std::vector<double> told_m(count, kNan);
  std::vector<Vec3d> normal(count);
  for (std::size_t i = 0; i < hits.count; ++i) {
    const std::uint32_t source = cloud.source[hits.point[i]];
    told_m[source] = hits.distance_m[i];
    normal[source] = {hits.normal_x[i], hits.normal_y[i], hits.normal_z[i]};
  }
  std::vector<std::uint8_t> sides;
  const bool knows_sides = built.peer->sides(cloud, {}, sides);
  std::vector<bool> told_inside(count);
  for (std::size_t i = 0; i < count; ++i)
    told_inside[cloud.source[i]] = knows_sides ? sides[i] != 0 : told_m[cloud.source[i]] < 0;
  std::vector<double> errors;
  std::size_t inside = 0, inside_answered = 0, outside_answered = 0, wrong = 0, angles = 0;
  double sum = 0, angle_sum_rad = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double truth_m = shell.distance_m[i];
    const bool is_answered = !std::isnan(told_m[i]);
    if (truth_m < 0) ++inside;
    if ((truth_m < 0) != told_inside[i]) ++wrong;
    if (!is_answered) continue;
    ++(truth_m < 0 ? inside_answered : outside_answered);
    errors.push_back(100 * std::abs(told_m[i] - truth_m) / model.r_max_m());
    sum += errors.back();
    if (std::abs(truth_m) <= kNormalFrom * model.r_max_m() || !(norm(normal[i]) > 0)) continue;
    angle_sum_rad += std::atan2(norm(cross(normal[i], shell.normal[i])), dot(normal[i], shell.normal[i]));
    ++angles;
  }
  std::sort(errors.begin(), errors.end());
  const auto share = [](std::size_t part, std::size_t whole) {
    return whole == 0 ? kNan : 100 * static_cast<double>(part) / static_cast<double>(whole);
  };
  AccuracyRow row;
  row.model = model.name;
  row.peer = built.entrant.id;
  row.shell_percent = 100 * shell.share;
  row.points = count;
  row.answered_inside_percent = share(inside_answered, inside);
  row.answered_outside_percent = share(outside_answered, count - inside);
  row.mean_error_percent = errors.empty() ? kNan : sum / static_cast<double>(errors.size());
  row.p95_error_percent = errors.empty() ? kNan : errors[errors.size() * 95 / 100];
  row.max_error_percent = errors.empty() ? kNan : errors.back();
  row.wrong_side_percent = share(wrong, count);
  row.wrong_feet_percent = built.peer->wrong_feet_percent(cloud);
  row.normal_mean_deg =
      angles == 0 ? kNan : angle_sum_rad / static_cast<double>(angles) * 180 / std::numbers::pi;
  return row;
}

void run_shell(const SuiteInput& input, const Model& model, const std::vector<BuiltPeer>& peers, double share,
               Results& results) {
  input.note(fmt::format("accuracy: {}, +-{} % shell", model.name, 100 * share));
  const Shell shell = make_shell(model, share, input.is_smoke ? 2000 : 20000);
  const Cloud cloud(shell.points_m);
  Hits hits(cloud.count);
  std::vector<AccuracyRow> rows;
  std::vector<Contestant> contestants;
  for (const BuiltPeer& built : peers) {
    rows.push_back(compare(model, built, shell, cloud, hits));
    if (share == kBand) {
      const AccuracyRow& row = rows.back();
      const StatedError stated = built.peer->stated_error();
      const double found = stated.is_mean ? row.mean_error_percent : row.max_error_percent;
      results.checks.push_back({model.name, built.entrant.id,
                                fmt::format("{} distance error in the shell, percent of R_max",
                                            stated.is_mean ? "mean" : "greatest"),
                                found, stated.percent, found <= stated.percent});
      check_statement(model, built, shell, cloud, results);
    }
    contestants.push_back({built.entrant.id, [&](std::size_t) {
                             built.peer->answer(cloud, {}, hits);
                             return hits.count;
                           }});
  }
  const std::vector<Timing> timings = measure(contestants, 1, input.is_smoke ? 3 : 11);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i].ns = timings[i].spread(1e9 / static_cast<double>(cloud.count));
    results.accuracy.push_back(rows[i]);
  }
}

/// Fig. 14c: one line a density of the paper's maps, from its layer 2 over ever more subdivisions in layer 3;
/// and ours, one a level of the maps, from layer 2
/// to layer 3.
void run_performance(const SuiteInput& input, const Model& model, Results& results) {
  input.note(fmt::format("accuracy: {}, performance and error", model.name));
  const Shell shell = make_shell(model, kBand, input.is_smoke ? 1000 : 10000);
  const Cloud cloud(shell.points_m);
  Hits hits(cloud.count);
  constexpr unsigned kFinest = 200;  // rows, subdivisions included
  std::vector<CurveRow> rows;
  std::vector<std::pair<std::size_t, std::unique_ptr<Peer>>> peers;  // and their curves
  const auto add_curve = [&](std::string name) {
    rows.push_back({"14c", model.name, std::move(name), {}, {}});
  };
  for (const unsigned density : {25U, 50U, 100U, 200U}) {
    if (input.is_smoke && density > 25) break;
    add_curve(fmt::format("paper's query, {} x {}", density, 2 * density));
    for (unsigned subdivisions = 0; density << subdivisions <= (input.is_smoke ? 50 : kFinest);
         ++subdivisions)
      peers.emplace_back(rows.size() - 1, make_paper(model, density, 2 * density, subdivisions));
  }
  std::uint32_t levels = 1;
  for (const Part& part : model.asset.parts) levels = std::max(levels, part.map.level_count);
  for (unsigned level = 0; level < levels; ++level) {
    add_curve(fmt::format("sqmap level {}, layers 2 to 3", level));
    for (const int layer : {2, 3}) peers.emplace_back(rows.size() - 1, make_sqmap(model, layer, level));
  }
  std::vector<Contestant> contestants;
  for (const auto& [row, peer] : peers)
    contestants.push_back({"", [&, one = peer.get()](std::size_t) {
                             one->answer(cloud, {}, hits);
                             return hits.count;
                           }});
  const std::vector<Timing> timings = measure(contestants, 1, input.is_smoke ? 3 : 11);
  for (std::size_t i = 0; i < peers.size(); ++i) {
    auto& [at, peer] = peers[i];
    rows[at].add(compare(model, {{}, std::move(peer)}, shell, cloud, hits).mean_error_percent,
                 timings[i].rate(1e-6 * static_cast<double>(cloud.count)));
  }
  for (CurveRow& row : rows) results.curves.push_back(std::move(row));
}

}  // namespace

void run_accuracy(const SuiteInput& input, Results& results) {
  for (const Model& model : input.models) {
    std::vector<BuiltPeer> peers;
    for (const Entrant& entrant : accuracy_entrants(model, input.is_smoke))
      peers.push_back(build_peer(entrant, model, results));
    for (const double share : {kBand, 0.005}) run_shell(input, model, peers, share, results);
  }
  if (!input.models.empty()) run_performance(input, input.models.front(), results);
}

}  // namespace sqmap::bench
