// SPDX-License-Identifier: GPL-3.0-or-later
//
// A point slides over the object, 0.5 % of R_max deep: how steady is the force that each method answers?
// After the paper's Fig. 13: triangles as they are, shaded triangles [26], the map, the map smoothed; and
// every method of the frames.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "sqmap/runtime/effects/force_model.hpp"
#include "sqmap/runtime/effects/reaction.hpp"
#include "sqmap/runtime/effects/smoothing.hpp"
#include "sqmap/runtime/effects/tracking.hpp"
#include "sqmap/runtime/instance.hpp"

#include "closest.hpp"
#include "paper_words.hpp"
#include "peer_rows.hpp"
#include "suites.hpp"
#include "work.hpp"

namespace sqmap::bench {
namespace {

constexpr double kDepth = 0.005;                        ///< of R_max
constexpr double kJump = 0.1;                           ///< of the mean force
constexpr double kLongestStep = 0.01;                   ///< of R_max; longer steps are no slide
constexpr std::size_t kWayRound = 8000;                 ///< steps of the whole path
constexpr std::size_t kSmallWayRound = 50 * kWayRound;  ///< in small steps, as of a haptic device
constexpr std::size_t kSmallSteps = 4000;               ///< of them, from the middle of the path
constexpr double kLongestSmallStep = 0.0005;            ///< of R_max
constexpr std::size_t kDrawn = 300;                     ///< steps of Fig. 13
/// Of the two effects, in R_max; the same share of an object of 1 m as their defaults.
constexpr double kSmoothing = 0.005, kCatchUp = 1e-4, kLose = 0.01;

/// Points at constant depth where rays from all around towards the centre enter; entries first to last of
/// way_round. Empty slots break the slide: the next entry lies elsewhere.
std::vector<Vec3d> slide(const Model& model, std::size_t first, std::size_t last,
                         std::size_t way_round = kWayRound) {
  const Vec3d centre = 0.5 * (model.low_m + model.high_m);
  std::vector<Vec3d> path;
  for (std::size_t i = first; i < last; ++i) {
    const double t = (static_cast<double>(i) + 0.5) / static_cast<double>(way_round), z = 0.9 * (1 - 2 * t);
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

/// What a method says at one place of the path.
struct Felt {
  Vec3d force_n, normal;
  bool is_answered{};
};

std::vector<Felt> felt_by(const Peer& peer, const std::vector<Vec3d>& path) {
  const Cloud cloud(path);
  Hits hits(cloud.count);
  peer.answer(cloud, {}, hits);
  std::vector<Felt> felt(path.size());
  for (std::size_t i = 0; i < hits.count; ++i)
    felt[cloud.source[hits.point[i]]] = {{hits.force_x_n[i], hits.force_y_n[i], hits.force_z_n[i]},
                                         {hits.normal_x[i], hits.normal_y[i], hits.normal_z[i]},
                                         true};
  return felt;
}

/// The force of a triangle: the depth of the nearest point, along the normal of its face or, shaded, along
/// the mean of its corners' normals, weighted as the point divides the triangle.
std::vector<Felt> felt_by_triangles(const Model& model, const std::vector<Vec3d>& path, bool is_shaded) {
  const Pseudonormals normals(model.mesh);
  std::vector<Felt> felt;
  for (const Vec3d& p : path) {
    const auto nearest = model.oracle->nearest(p);
    const auto& [a, b, c] = model.mesh.faces[nearest.face];
    const Vec3d &pa = model.mesh.vertices_m[a], &pb = model.mesh.vertices_m[b],
                &pc = model.mesh.vertices_m[c];
    const Vec3d area = cross(pb - pa, pc - pa);
    Vec3d normal = normalized(area);
    if (is_shaded) {
      const Vec3d& q = nearest.nearest_m;
      const auto share = [&](const Vec3d& from, const Vec3d& to) {
        return std::max(0.0, dot(cross(from - q, to - q), normal) / norm(area));
      };
      Vec3d sum;
      const std::pair<int, double> corners[] = {{0, share(pb, pc)}, {1, share(pc, pa)}, {2, share(pa, pb)}};
      for (const auto& [corner, weight] : corners)
        sum = sum + weight * normalized(normals.at(nearest.face, corner));
      normal = normalized(sum);
    }
    const double pressure_n =
        kStiffness_n_per_m * std::max(0.0, model.oracle->inside(p) ? nearest.distance_m : 0.0);
    felt.push_back({pressure_n * normal, normal, true});
  }
  return felt;
}

/// One point, frame by frame, through an effect of the runtime and the reaction force.
template <class Effect>
std::vector<Felt> felt_by_effect(const Model& model, const std::vector<Vec3d>& path, Effect effect) {
  const auto object = runtime::Object::build(model.asset);
  if (!object) throw std::runtime_error(object.error().finding);
  const auto instance = runtime::Instance::place(object.value(), runtime::Placement{});
  if (!instance) throw std::runtime_error(instance.error().finding);
  runtime::ForceModel force(effect, runtime::Reaction{kStiffness_n_per_m});
  if (const Outcome ready = force.prepare(1); !ready) throw std::runtime_error(ready.error().finding);
  std::vector<Felt> felt;
  for (const Vec3d& p : path) {
    const Vec3f point_m[] = {cast<float>(p)};
    const runtime::Wrench wrench =
        force.frame({&instance.value(), {runtime::Layer::kThree, 0, 0}}, {.points_m = point_m});
    const Vec3d force_n = cast<double>(wrench.force_n);
    felt.push_back({force_n, normalized(force_n), norm(force_n) > 0});
  }
  return felt;
}

runtime::Smoothing smoothing_of(const Model& model) {
  runtime::Smoothing smoothing;
  smoothing.radius_m = static_cast<float>(kSmoothing * model.r_max_m());
  return smoothing;
}
runtime::Tracking tracking_of(const Model& model) {
  runtime::Tracking tracking;
  tracking.catch_up_m = static_cast<float>(kCatchUp * model.r_max_m());
  tracking.lose_m = static_cast<float>(kLose * model.r_max_m());
  return tracking;
}

bool is_step(const Model& model, const std::vector<Vec3d>& path, std::size_t i, double longest) {
  return i > 0 && norm(path[i] - path[i - 1]) <= longest * model.r_max_m();
}

double angle_deg(const Vec3d& a, const Vec3d& b) {
  return std::atan2(norm(cross(a, b)), dot(a, b)) * 180 / std::numbers::pi;
}

ForceRow summary(const Model& model, const std::string& peer, const std::vector<Vec3d>& path,
                 const std::vector<Felt>& felt, double longest_step) {
  const double mean_n = kStiffness_n_per_m * kDepth * model.r_max_m();
  ForceRow row;
  row.model = model.name;
  row.peer = peer;
  double sum_deg = 0, change = 0;
  std::size_t angles = 0, missing = 0, jumps = 0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (!felt[i].is_answered) {
      ++missing;
    } else {
      const auto nearest = model.oracle->nearest(path[i]);
      sum_deg += angle_deg(felt[i].normal, normalized(nearest.nearest_m - path[i]));
      ++angles;
    }
    if (!is_step(model, path, i, longest_step)) continue;
    const double step = norm(felt[i].force_n - felt[i - 1].force_n) / mean_n;
    ++row.steps;
    change += step;
    if (step > kJump) ++jumps;
    row.worst_jump_percent = std::max(row.worst_jump_percent, 100 * step);
  }
  const auto steps = static_cast<double>(std::max<std::size_t>(row.steps, 1));
  row.jumps_percent = 100 * static_cast<double>(jumps) / steps;
  row.mean_change_percent = 100 * change / steps;
  row.direction_error_deg =
      angles == 0 ? std::numeric_limits<double>::quiet_NaN() : sum_deg / static_cast<double>(angles);
  row.unanswered_percent =
      100 * static_cast<double>(missing) / static_cast<double>(std::max<std::size_t>(path.size(), 1));
  return row;
}

/// The longest unbroken stretch of the path, at most kDrawn steps from its beginning.
std::pair<std::size_t, std::size_t> stretch_to_draw(const Model& model, const std::vector<Vec3d>& path,
                                                    double longest_step) {
  std::size_t begin = 0, best = 0, length = 0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (!is_step(model, path, i, longest_step)) begin = i;
    if (i + 1 - begin > length) best = begin, length = i + 1 - begin;
  }
  return {best, best + std::min(length, kDrawn)};
}

/// Fig. 13a: how the direction turns along the way. Fig. 13b: how the force changes from step to step.
void add_curves(const Model& model, const std::string& curve, const std::vector<Vec3d>& path,
                const std::vector<Felt>& felt, Results& results) {
  const auto [begin, end] = stretch_to_draw(model, path, kLongestStep);
  const double mean_n = kStiffness_n_per_m * kDepth * model.r_max_m();
  CurveRow turn{"13a", model.name, curve, {}, {}}, change{"13b", model.name, curve, {}, {}};
  const Vec3d ahead = normalized(path[end - 1] - path[begin]);
  double way = 0;
  for (std::size_t i = begin; i < end; ++i) {
    if (i > begin) way += 100 * norm(path[i] - path[i - 1]) / model.r_max_m();
    turn.x.push_back(way);
    turn.y.push_back(angle_deg(felt[i].force_n, ahead));
    if (i == begin) continue;
    change.x.push_back(way);
    change.y.push_back(100 * norm(felt[i].force_n - felt[i - 1].force_n) / mean_n);
  }
  results.curves.push_back(std::move(turn));
  results.curves.push_back(std::move(change));
}

/// From the middle of the way, or as near to it as the rays find enough of the object to draw.
std::vector<Vec3d> small_steps(const Model& model, std::size_t steps) {
  for (const double share : {0.5, 0.45, 0.55, 0.4, 0.6, 0.35, 0.65, 0.3, 0.7, 0.25, 0.75, 0.2, 0.8}) {
    const auto middle = static_cast<std::size_t>(share * static_cast<double>(kSmallWayRound));
    std::vector<Vec3d> path = slide(model, middle - steps / 2, middle + steps / 2, kSmallWayRound);
    if (path.empty()) continue;
    const auto [begin, end] = stretch_to_draw(model, path, kLongestSmallStep);
    if (end - begin == kDrawn) return path;
  }
  throw std::runtime_error("no rays towards the centre of " + model.name + " find a stretch of it");
}

/// Fig. 13b once more, in steps as small as those of a haptic device.
void run_small_steps(const SuiteInput& input, const Model& model, bool is_drawn, Results& results) {
  const std::vector<Vec3d> path = small_steps(model, input.is_smoke ? kSmallSteps / 10 : kSmallSteps);
  const double mean_n = kStiffness_n_per_m * kDepth * model.r_max_m();
  const auto [begin, end] = stretch_to_draw(model, path, kLongestSmallStep);
  const auto add = [&, first = begin, last = end](const std::string& peer, const std::vector<Felt>& felt) {
    results.force.push_back(summary(model, peer + kSmallStepsName, path, felt, kLongestSmallStep));
    if (!is_drawn) return;
    CurveRow change{"13b-small", model.name, peer, {}, {}};
    double way = 0;
    for (std::size_t i = first + 1; i < last; ++i) {
      way += 100 * norm(path[i] - path[i - 1]) / model.r_max_m();
      change.x.push_back(way);
      change.y.push_back(100 * norm(felt[i].force_n - felt[i - 1].force_n) / mean_n);
    }
    results.curves.push_back(std::move(change));
  };
  add("mesh-normals", felt_by_triangles(model, path, false));
  add("mesh-shaded", felt_by_triangles(model, path, true));
  add("sqmap-layer3", felt_by(*make_sqmap(model, 3, 0), path));
  add(kGridOfSlides, felt_by(*make_grid(model, GridCode::kInt16Simd, 128), path));
  add("sqmap-layer3-smoothed", felt_by_effect(model, path, smoothing_of(model)));
  add("sqmap-layer3-tracked", felt_by_effect(model, path, tracking_of(model)));
}

}  // namespace

void run_force(const SuiteInput& input, Results& results) {
  for (const Model& model : input.models) {
    input.note(fmt::format("force: {}", model.name));
    const std::vector<Vec3d> path =
        input.is_smoke ? slide(model, kWayRound / 2 - 200, kWayRound / 2 + 200) : slide(model, 0, kWayRound);
    if (path.empty()) throw std::runtime_error("no ray towards the centre of " + model.name + " enters it");
    const auto add = [&](const std::string& peer, const std::vector<Felt>& felt, bool is_drawn) {
      results.force.push_back(summary(model, peer, path, felt, kLongestStep));
      if (is_drawn) add_curves(model, peer, path, felt, results);
    };
    const bool is_first = &model == &input.models.front();
    add("mesh-normals", felt_by_triangles(model, path, false), is_first);
    add("mesh-shaded", felt_by_triangles(model, path, true), is_first);
    for (const Entrant& entrant : frame_entrants(model, input.is_smoke))
      add(entrant.id, felt_by(*build_peer(entrant, model, results).peer, path),
          is_first && (entrant.id == "sqmap-layer3" || entrant.id == kGridOfSlides));
    add("sqmap-layer3-smoothed", felt_by_effect(model, path, smoothing_of(model)), is_first);
    add("sqmap-layer3-tracked", felt_by_effect(model, path, tracking_of(model)), is_first);
    run_small_steps(input, model, is_first, results);
  }
}

}  // namespace sqmap::bench
