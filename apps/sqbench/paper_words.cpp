// SPDX-License-Identifier: GPL-3.0-or-later
#include "paper_words.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "peer.hpp"

namespace sqmap::bench {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Geometric mean; NaN of nothing.
class GeometricMean {
 public:
  void add(double value) {
    if (!(value > 0)) return;
    log_sum_ += std::log(value);
    ++count_;
  }
  double value() const { return count_ == 0 ? kNan : std::exp(log_sum_ / static_cast<double>(count_)); }

 private:
  double log_sum_{};
  std::size_t count_{};
};

double frame_us(const Results& results, const std::string& model, const std::string& work,
                const std::string& peer) {
  for (const FrameRow& row : results.frames)
    if (row.model == model && row.work == work && row.peer == peer) return row.us.median;
  return kNan;
}

/// One over the other, over the models.
double frame_ratio(const Results& results, const std::string& work, const std::string& peer,
                   const std::string& other) {
  GeometricMean mean;
  for (const ModelRow& model : results.models)
    mean.add(frame_us(results, model.model, work, peer) / frame_us(results, model.model, work, other));
  return mean.value();
}

void add_tree_words(const Results& results, std::vector<std::string>& words) {
  for (const auto& [work, figure] :
       {std::pair{"touching", "11a"}, std::pair{"grasp", "11a"}, std::pair{"costume", "11b"}}) {
    double share[3];
    for (int layer = 1; layer <= 3; ++layer)
      share[layer - 1] =
          100 * frame_ratio(results, work, fmt::format("sqmap-layer{}", layer), kTreeReference);
    if (std::isnan(share[0])) continue;
    std::string lost, won;
    for (const char* peer :
         {"fcl-obb-all-contacts", "fcl-obb-first-contact", "fcl-obb-rebuilt-all-contacts",
          "fcl-kdop18-all-contacts", "fcl-kdop18-first-contact", "bullet-gimpact-all-contacts"}) {
      const double ratio = frame_ratio(results, work, "sqmap-layer3", peer);
      if (std::isnan(ratio)) continue;  // did not take part
      std::string& list = ratio < 1 ? won : lost;
      list += (list.empty() ? "" : ", ") + std::string(peer);
    }
    words.push_back(fmt::format(
        "Fig. {}, {}: layers 1, 2 and 3 cost {:.3g}, {:.3g} and {:.3g} % of the OBB tree that tells all "
        "contacts (the paper prints no values). {}",
        figure, work, share[0], share[1], share[2],
        lost.empty() ? "Layer 3 is faster than all methods here that test triangles: " + won + "."
                     : "Layer 3 loses to methods that test triangles: " + lost + "."));
  }
}

void add_query_words(const Results& results, std::vector<std::string>& words) {
  struct Means {
    double ns{}, error_percent{}, wrong_side_percent{}, wrong_feet_percent{};
    std::size_t count{}, feet{};
  };
  const auto means_of = [&](const std::string& peer) {
    Means means;
    for (const AccuracyRow& row : results.accuracy) {
      if (row.peer != peer || row.shell_percent < 2.9) continue;
      means.ns += row.ns.median;
      means.error_percent += row.mean_error_percent;
      means.wrong_side_percent += row.wrong_side_percent;
      if (!std::isnan(row.wrong_feet_percent))
        means.wrong_feet_percent += row.wrong_feet_percent, ++means.feet;
      ++means.count;
    }
    const auto count = static_cast<double>(std::max<std::size_t>(means.count, 1));
    means.ns /= count, means.error_percent /= count, means.wrong_side_percent /= count;
    means.wrong_feet_percent /= static_cast<double>(std::max<std::size_t>(means.feet, 1));
    return means;
  };
  const Means ours = means_of("sqmap-layer3"), foot = means_of("sqmap-layer2"),
              theirs = means_of("paper-100x200-layer2");
  if (ours.count == 0 || theirs.count == 0) return;
  words.push_back(fmt::format(
      "The paper's query as printed (maps of 100 x 200, layer 2) takes {:.2g} times as long a point of the "
      "+-3 % "
      "shell as sqmap (layer 3); its mean error there is {:.3g} % of R_max against {:.3g} %, it puts {:.3g} "
      "% "
      "of the points on the wrong side against {:.3g} %, and its pyramid search ends at a wrong foot for "
      "{:.3g} % of the points inside a superquadric, against {:.3g} % of ours.",
      theirs.ns / ours.ns, theirs.error_percent, ours.error_percent, theirs.wrong_side_percent,
      ours.wrong_side_percent, theirs.wrong_feet_percent, foot.wrong_feet_percent));
}

/// Jumps, change and direction of each method, means over the models. `name_end`: of the peers' names.
std::string force_of(const Results& results, const char* name_end) {
  std::string text;
  for (const char* peer : {"mesh-normals", "mesh-shaded", "sqmap-layer3", "sqmap-layer3-smoothed",
                           "sqmap-layer3-tracked", kGridOfSlides}) {
    double jumps = 0, change = 0, angle_deg = 0;
    std::size_t models = 0;
    for (const ForceRow& row : results.force)
      if (row.peer == std::string(peer) + name_end)
        jumps += row.jumps_percent, change += row.mean_change_percent, angle_deg += row.direction_error_deg,
            ++models;
    if (models == 0) continue;
    const auto count = static_cast<double>(models);
    text += fmt::format("{}{}: {:.2g} %, {:.3g} %, {:.2g} deg", text.empty() ? "" : "; ", peer, jumps / count,
                        change / count, angle_deg / count);
  }
  return text;
}

/// Fig. 13: the paper says that its smoothed map gives no spikes, and prints no values.
void add_force_words(const Results& results, std::vector<std::string>& words) {
  const std::string text = force_of(results, ""), small = force_of(results, kSmallStepsName);
  if (!text.empty())
    words.push_back(
        "Fig. 13, a point that slides 0.5 % of R_max deep (share of steps whose force changes by more than a "
        "tenth, "
        "mean change, direction off the exact gradient; the paper prints no values): " +
        text + ".");
  if (!small.empty())
    words.push_back("Fig. 13b in steps of about 0.005 % of R_max, the same shares: " + small + ".");
}

/// Each effect over the reaction alone, mean over the models of the differences.
void add_effect_words(const Results& results, std::vector<std::string>& words) {
  const std::string start = "scene, layer 3: reaction";
  std::vector<std::pair<std::string, GeometricMean>> ratios;
  GeometricMean plain_us;
  for (const EffectRow& alone : results.effects) {
    if (alone.variant != start) continue;
    plain_us.add(alone.us.median);
    for (const EffectRow& row : results.effects) {
      if (row.model != alone.model || !row.variant.starts_with(start + ", ")) continue;
      const std::string name = row.variant.substr(start.size() + 2);
      auto it =
          std::find_if(ratios.begin(), ratios.end(), [&](const auto& known) { return known.first == name; });
      if (it == ratios.end()) it = ratios.insert(it, {name, {}});
      it->second.add(row.us.median / alone.us.median);
    }
  }
  if (ratios.empty()) return;
  std::string text;
  for (const auto& [name, ratio] : ratios)
    text += fmt::format("{}{} {:+.2g} %", text.empty() ? "" : ", ", name, 100 * (ratio.value() - 1));
  words.push_back(fmt::format(
      "Effects: a touching frame of a scene in layer 3 with the reaction alone takes {:.3g} us; beside it "
      "take {} "
      "(geometric means over the models). An effect that a scene does not name takes nothing: the test "
      "Scene.UnusedEffectsRunNoInstruction counts as many instructions a frame as a program has that knows "
      "no "
      "effect but the reaction.",
      plain_us.value(), text));
}

/// Fig. 14c and the times of section 7.1.
void add_error_words(const Results& results, std::vector<std::string>& words) {
  std::string measured;
  for (const char* peer : {"paper-100x200-layer2", "sqmap-layer2", "sqmap-layer3"}) {
    GeometricMean mean;
    for (const AccuracyRow& row : results.accuracy)
      if (row.peer == peer && row.shell_percent > 2.9) mean.add(row.mean_error_percent);
    if (!std::isnan(mean.value()))
      measured += fmt::format("{}{} {:.3g} %", measured.empty() ? "" : ", ", peer, mean.value());
  }
  if (!measured.empty())
    words.push_back(
        "Fig. 14c: the paper prints errors of 0.4 to 0.5 %; measured, of signed distances in the +-3 % "
        "shell, geometric mean over the models: " +
        measured + ".");
  double least_s = std::numeric_limits<double>::infinity(), most_s = 0;
  for (const BakeRow& row : results.bake)
    if (row.method == "sqmap" && row.target_percent < 0.06) {
      least_s = std::min(least_s, row.seconds.median);
      most_s = std::max(most_s, row.seconds.median);
    }
  if (most_s > 0)
    words.push_back(fmt::format(
        "Preparing a model to 0.05 % takes {:.2g} to {:.2g} s (the paper prints 4 to 7 s for its models, "
        "on a Pentium 4 of 3 GHz).",
        least_s, most_s));
}

void add_memory_words(const Results& results, std::vector<std::string>& words) {
  const std::vector<MemoryComparison> table = table_1(results);
  if (table.empty() || table.back().is_paper) return;
  const auto printed = std::find_if(table.begin(), table.end(),
                                    [](const MemoryComparison& row) { return row.model == "Scene"; });
  const MemoryComparison& whole = table.back();
  std::string smaller;
  for (const MemoryRow& row : results.memory)
    if (row.model == whole.model && !row.method.starts_with("sqmap") && row.bytes < 1e6 * whole.ours_mb)
      smaller += (smaller.empty() ? "" : ", ") + row.method;
  words.push_back(
      fmt::format("Table 1, all models: the dense grid of floats, {} along the longest axis, takes {:.3g} "
                  "times the memory "
                  "of the paper's maps of 100 x 200 (the "
                  "paper prints {:.3g} for its scene), the adaptive distance field within 0.4 % {:.3g} times "
                  "({:.3g}); sqmap takes "
                  "{:.2g} of the paper's maps. {}",
                  whole.grid_density, whole.grid_mb / whole.paper_map_mb,
                  printed->grid_mb / printed->paper_map_mb, whole.octree_mb / whole.paper_map_mb,
                  printed->octree_mb / printed->paper_map_mb, whole.ours_mb / whole.paper_map_mb,
                  smaller.empty() ? "No setting of a rival takes less than sqmap."
                                  : "sqmap loses in memory alone to " + smaller + "."));
}

}  // namespace

std::vector<MemoryComparison> table_1(const Results& results) {
  std::vector<MemoryComparison> table;
  const auto row_of = [&](const MemoryRow& row) -> MemoryComparison& {
    const auto it = std::find_if(table.begin(), table.end(), [&](const MemoryComparison& known) {
      return known.model == row.model && known.is_paper == row.is_paper;
    });
    if (it != table.end()) return *it;
    table.push_back({row.model, kNan, kNan, kNan, kNan, 0, row.is_paper});
    return table.back();
  };
  for (const MemoryRow& row : results.memory) {
    MemoryComparison& found = row_of(row);
    // Of one family more density is more memory.
    const auto keep_most = [&](double& slot_mb) { slot_mb = std::fmax(slot_mb, row.bytes / 1e6); };
    if (row.method == "DF" || row.family == "grid-float-simd") {
      keep_most(found.grid_mb);
      found.grid_density = std::max(found.grid_density, row.density);
    }
    // 0.4 %: the error that the paper reports of its own method.
    if (row.method == "ADF" || (row.family.starts_with("adf-float") && row.method.ends_with("-0.4")))
      keep_most(found.octree_mb);
    if (row.method == "SQ" || row.method == "paper-100x200-layer2") keep_most(found.paper_map_mb);
    if (row.method == "sqmap-layer3") keep_most(found.ours_mb);
  }
  return table;
}

std::vector<std::string> paper_words(const Results& results) {
  std::vector<std::string> words;
  add_query_words(results, words);
  add_tree_words(results, words);
  add_force_words(results, words);
  add_effect_words(results, words);
  add_error_words(results, words);
  add_memory_words(results, words);
  return words;
}

}  // namespace sqmap::bench
