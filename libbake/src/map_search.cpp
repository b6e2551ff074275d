// SPDX-License-Identifier: GPL-3.0-or-later
#include "map_search.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <utility>
#include <vector>

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "sqmap/runtime/object.hpp"

#include "measure.hpp"
#include "refine.hpp"

namespace sqmap::bake {

namespace {

// Vertex samples are kept where the surface misses the vertex by this multiple of the error target.
constexpr double kVertexTolerance = 3;
// Shells that finished maps are judged in: points, and half widths as shares of R_max. Of the narrow one's
// points five times as many are on the wrong side. Few points do for objects that are small enough: others
// have maps that are chosen by what points say, and learn them.
constexpr std::uint32_t kFewShellPoints = 16000, kShellPoints = 40000;
constexpr double kShellWidth = 0.03, kNarrowShellWidth = 0.005;
// Maps are drawn at most so often. Each time their target changes by the root of what the worse error is off
// its aim: downwards a little more, and only as long as an error that exceeds its aim falls by a fifth of
// what its target does; once they meet their aims, up or down, until that would change the target by less
// than kSameTarget. Aims are a little less than the target for depth, and 11.2 and 58 times it, as a share of
// R_max, for the share of points on the wrong side in either shell.
constexpr int kMapRounds = 7;
constexpr double kMostStricter = 0.4, kLeastStricter = 0.97;
constexpr double kWorthFinerMaps = 0.2;
constexpr int kMostSteps = 8;  // down to a target that asks for other maps
constexpr double kLoosest = 4, kSameTarget = 0.01;
constexpr double kDepthAim = 0.97, kWrongSides = 11.2, kWrongSidesNear = 58;
// Parts are given coarser maps back up to this share of the aims: chosen by the points that judge it, they
// do a little worse at others.
constexpr double kGivenBack = 0.98;
// Less than this share of all texels is not worth the question.
constexpr double kLeastGivenBack = 0.003;
// Maps that miss their aims by more than this factor are not sharpened, and others only as long as so many
// assets are judged for it.
constexpr double kNearAims = 5;
constexpr std::size_t kMostTrials = 160;
// Of the gain foretold for a finer map where others have become finer before it.
constexpr double kWorthSharpening = 0.5;

/// Errors of an asset, near the surface, over what its target allows: at most 1 where they meet it.
struct Shortfall {
  double depth{}, sides{};
  std::size_t bytes{};  ///< of the object in memory
  double worse() const { return std::max(depth, sides); }
  double excess() const { return std::max(0.0, depth - 1) + std::max(0.0, sides - 1); }
};

/// Points near the surface that maps are judged by.
struct Shells {
  ShellPoints wide, narrow;
};

Result<Shortfall> judge(const Asset& asset, const Shells& shells, double target_m) {
  auto object = runtime::Object::build(asset);
  if (!object) return object.error();
  const ShellError wide = shell_error(object.value(), shells.wide);
  const ShellError narrow = shell_error(object.value(), shells.narrow);
  const double targets = asset.r_max_m / target_m;
  return Shortfall{
      wide.depth_mean_m / (kDepthAim * target_m),
      targets * std::max(wide.misclassified / kWrongSides, narrow.misclassified / kWrongSidesNear),
      object.value().resident_bytes()};
}

/// Gives parts the `coarser` maps they had, those first that save most, as long as neither error rises beyond
/// kGivenBack of what it may be, or where it is: not every part errs less with a finer map.
Result<Shortfall> give_back(Asset& asset, Shortfall now, const std::vector<Part>& coarser,
                            const Shells& shells, double target_m) {
  const auto bits = [](const Part& part) { return 1.0 * part.map.rows * part.map.cols * part.map.bits; };
  const auto saved = [&](std::size_t k) { return bits(asset.parts[k]) - bits(coarser[k]); };
  double all_bits = 0;
  for (const Part& part : asset.parts) all_bits += bits(part);
  std::vector<std::size_t> order(coarser.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t i, std::size_t k) { return saved(i) > saved(k); });
  for (const std::size_t k : order) {
    if (!(saved(k) > kLeastGivenBack * all_bits)) break;
    Part kept = std::move(asset.parts[k]);
    asset.parts[k] = coarser[k];
    asset.sphere = enclosing_sphere(asset.parts);
    auto without = judge(asset, shells, target_m);
    if (!without) return without;
    const Shortfall& then = without.value();
    if (then.depth <= std::max(kGivenBack, now.depth) && then.sides <= std::max(kGivenBack, now.sides) &&
        then.bytes < now.bytes) {
      now = then;
    } else {
      asset.parts[k] = std::move(kept);
    }
  }
  asset.sphere = enclosing_sphere(asset.parts);
  return now;
}

/// One finer map, and what it does.
struct Sharper {
  std::size_t part;
  DistanceMap map;
  double gain, per_byte;  ///< of Shortfall::excess
};

/// What each finer map of a part does alone; best first, by gain a byte, without those that gain nothing.
std::vector<Sharper> sharper_maps(const Asset& asset, const Shortfall& now, const MapDrawer& drawer,
                                  const MeshQueries& queries, const Shells& shells, double target_m) {
  std::vector<Sharper> maps;
  for (std::size_t k = 0; k < asset.parts.size(); ++k)
    for (DistanceMap& map : drawer.finer(k, asset.parts[k])) maps.push_back({k, std::move(map), 0, 0});
  tbb::parallel_for(std::size_t{0}, maps.size(), [&](std::size_t i) {
    Asset other = asset;
    Part& part = other.parts[maps[i].part];
    part.map = maps[i].map;
    add_vertex_samples(part, queries, kVertexTolerance * target_m);
    maps[i].map = part.map;
    // Isolated: while this waits for its own points, it must not begin with another map and its asset.
    const auto then = tbb::this_task_arena::isolate([&] { return judge(other, shells, target_m); });
    if (!then) return;
    maps[i].gain = now.excess() - then.value().excess();
    maps[i].per_byte = maps[i].gain / std::max(1.0, double(then.value().bytes) - double(now.bytes));
  });
  std::erase_if(maps, [](const Sharper& s) { return !(s.gain > 0); });
  std::ranges::stable_sort(maps, std::greater{}, &Sharper::per_byte);
  return maps;
}

/// Where errors are still beyond their aims, makes single maps finer within the byte budget, those first that
/// gain most a byte: all were drawn by what is foretold of them, which is wrong of some.
Result<Drawn> sharpen(Asset& asset, Shortfall now, const MapDrawer& drawer, const MeshQueries& queries,
                      const Shells& shells, const MapTarget& target) {
  std::size_t trials = 0;
  bool over_budget = false;
  const std::size_t sweep = 3 * asset.parts.size();
  while (now.worse() > kAtAims && now.worse() <= kNearAims && trials + sweep <= kMostTrials) {
    std::vector<Sharper> sharper = sharper_maps(asset, now, drawer, queries, shells, target.error_m);
    trials += sweep;
    std::vector<bool> changed(asset.parts.size());
    const double before = now.excess();
    for (Sharper& s : sharper) {
      if (changed[s.part] || now.worse() <= 1 || trials >= kMostTrials) continue;
      std::swap(asset.parts[s.part].map, s.map);
      if (stored_bytes(asset.parts) > static_cast<double>(target.max_bytes)) {
        std::swap(asset.parts[s.part].map, s.map);
        over_budget = true;
        continue;
      }
      const auto then = judge(asset, shells, target.error_m);
      if (!then) return then.error();
      ++trials;
      const double gain = now.excess() - then.value().excess();
      if (gain >= kWorthSharpening * std::min(s.gain, now.excess())) {
        now = then.value();
        changed[s.part] = true;
      } else {
        std::swap(asset.parts[s.part].map, s.map);
      }
    }
    if (!(now.excess() < before)) break;
  }
  return Drawn{now.depth, now.sides, over_budget && now.worse() > kAtAims, now.bytes};
}

bool have_same_texels(const std::vector<Part>& a, const std::vector<Part>& b) {
  return std::ranges::equal(a, b, [](const Part& p, const Part& q) {
    return p.shape == q.shape && p.map.rows == q.map.rows && p.map.cols == q.map.cols &&
           p.map.bits == q.map.bits;
  });
}

}  // namespace

Result<Drawn> draw_maps(Asset& asset, MapDrawer& drawer, std::size_t most_shapes, const MeshQueries& queries,
                        const MapTarget& target, std::size_t small_enough, std::uint64_t seed) {
  const auto shells_of = [&](std::uint32_t points) {
    return Shells{sample_shell(queries, kShellWidth * asset.r_max_m, points, seed),
                  sample_shell(queries, kNarrowShellWidth * asset.r_max_m, points, seed + 1)};
  };
  Shells shells = shells_of(kFewShellPoints);
  const auto finish_and_judge = [&] {
    asset.sphere = enclosing_sphere(asset.parts);
    tbb::parallel_for(std::size_t{0}, asset.parts.size(), [&](std::size_t k) {
      add_vertex_samples(asset.parts[k], queries, kVertexTolerance * target.error_m);
    });
    return judge(asset, shells, target.error_m);
  };
  TexelCost cost = TexelCost::kAll;
  std::vector<Part> best, coarser;
  Shortfall least;
  bool by_budget = false;
  MapTarget asked = target;
  double share = 1;  // of the target before
  double met_m = 0, failed_m = kLoosest * target.error_m;
  for (int round = 0; round < kMapRounds; ++round) {
    const bool had_met = met_m > 0;
    // Maps come in steps: on, down to a target that asks for others.
    const double step = share;
    bool budget_decided = drawer.draw(asset.parts, asked, most_shapes, cost);
    for (int k = 0; k < kMostSteps && round > 0 && !had_met && have_same_texels(asset.parts, best); ++k) {
      asked.error_m *= step;
      share *= step;
      budget_decided = drawer.draw(asset.parts, asked, most_shapes, cost);
    }
    auto judged = finish_and_judge();
    if (round == 0 && judged && judged.value().bytes > small_enough) {
      shells = shells_of(kShellPoints);
      cost = TexelCost::kHeld;
      budget_decided = drawer.draw(asset.parts, asked, most_shapes, cost);
      judged = finish_and_judge();
    }
    if (!judged) return judged.error();
    const Shortfall& now = judged.value();
    const bool meets = now.worse() <= 1;
    const bool was_small = had_met && least.bytes <= target.most_held;
    if (!meets && !was_small && now.bytes > target.most_held)
      return Drawn{now.depth, now.sides, false, now.bytes};
    const auto gains = [share](double here, double before) {
      return before > 1 && here <= (1 - kWorthFinerMaps * (1 - share)) * before;
    };
    const bool is_better =
        had_met ? meets && now.bytes < least.bytes
                : round == 0 || meets || gains(now.depth, least.depth) || gains(now.sides, least.sides);
    if (!had_met && !is_better) break;
    if (is_better) {
      if (!had_met) coarser = std::move(best);
      best = asset.parts;
      least = now;
      by_budget = budget_decided;
    } else if (!meets) {
      coarser = asset.parts;
    }
    if (by_budget && !meets) break;
    const double here_m = asked.error_m;
    (meets ? met_m : failed_m) = here_m;
    // Errors fall faster than their target.
    const double by = 1 / std::sqrt(now.worse());
    asked.error_m *= meets ? by : std::max(kMostStricter, kLeastStricter * by);
    const double between_m = std::sqrt(met_m * failed_m);
    asked.error_m = meets ? std::min(asked.error_m, between_m) : std::max(asked.error_m, between_m);
    share = asked.error_m / here_m;
    if (met_m > 0 && (least.bytes <= small_enough || std::abs(share - 1) < kSameTarget)) break;
  }
  asset.parts = std::move(best);
  asset.sphere = enclosing_sphere(asset.parts);
  if (!by_budget && met_m == 0) return sharpen(asset, least, drawer, queries, shells, target);
  if (by_budget || coarser.empty()) return Drawn{least.depth, least.sides, by_budget, least.bytes};
  auto given = give_back(asset, least, coarser, shells, target.error_m);
  if (!given) return given.error();
  return Drawn{given.value().depth, given.value().sides, by_budget, given.value().bytes};
}

}  // namespace sqmap::bake
