// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "paper_words.hpp"
#include "peer.hpp"
#include "results.hpp"
#include "svg.hpp"

namespace sqmap::bench {
namespace {

/// Exact methods would stretch the logarithmic axis by decades.
constexpr double kLeastError_percent = 0.001;

bool is_ours(const std::string& peer) { return peer.starts_with("sqmap"); }

const PeerRow* find_peer(const Results& results, const std::string& model, const std::string& peer) {
  const auto it = std::find_if(results.peers.begin(), results.peers.end(),
                               [&](const PeerRow& row) { return row.model == model && row.peer == peer; });
  return it == results.peers.end() ? nullptr : &*it;
}

/// Series in the order in which their families first occur.
class SeriesByFamily {
 public:
  void add(const std::string& family, Disc disc) {
    if (!(disc.x > 0) || !(disc.y > 0))
      return;  // NaN, or no error at all: has no place on a logarithmic axis
    auto it =
        std::find_if(series.begin(), series.end(), [&](const Series& one) { return one.name == family; });
    if (it == series.end()) it = series.insert(it, {family, {}});
    it->discs.push_back(std::move(disc));
  }
  std::vector<Series> series;
};

void add_accuracy(const Results& results, std::vector<Picture>& pictures) {
  for (const ModelRow& model : results.models) {
    for (const double shell : {3.0, 0.5}) {
      SeriesByFamily time, size, angle;
      for (const AccuracyRow& row : results.accuracy) {
        if (row.model != model.model || std::abs(row.shell_percent - shell) > 1e-9) continue;
        const PeerRow* peer = find_peer(results, row.model, row.peer);
        if (peer == nullptr) continue;
        const auto bytes = static_cast<double>(peer->bytes);
        const std::string label =
            fmt::format("{}: {:.3g} %, {:.3g} ns a point, {:.3g} KB, normals {:.2g} deg", row.peer,
                        row.mean_error_percent, row.ns.median, bytes / kKilobyte, row.normal_mean_deg);
        const double shown_percent = std::max(row.mean_error_percent, kLeastError_percent);
        time.add(peer->family, {shown_percent, row.ns.median, bytes, label, row.ns.lower, row.ns.upper});
        size.add(peer->family, {shown_percent, bytes / kKilobyte, bytes, label});
        angle.add(peer->family, {std::max(row.normal_mean_deg, 0.1), bytes / kKilobyte, bytes, label});
      }
      if (time.series.empty()) continue;
      const std::string name = fmt::format("{}-{}", model.model, shell == 3.0 ? "3" : "05");
      const std::string where = fmt::format("{}, +-{} % shell", model.model, shell);
      const std::string error =
          fmt::format("mean distance error of the points answered, % of R_max; below {} drawn there",
                      kLeastError_percent);
      pictures.push_back(
          {"time-" + name, where + ": time and error",
           scatter_svg(where + ": what accuracy costs in time", error, "ns a point", time.series)});
      if (shell != 3.0) continue;
      pictures.push_back(
          {"size-" + name, where + ": memory and error",
           scatter_svg(where + ": what accuracy costs in memory", error, "KB resident", size.series)});
      pictures.push_back(
          {"normals-" + name, where + ": memory and normals",
           scatter_svg(where + ": what good normals cost in memory",
                       "mean angle to the true normal of the points answered, degrees; below 0.1 drawn there",
                       "KB resident", angle.series)});
    }
  }
}

/// Geometric means over the models of what has a row for each of them.
class Means {
 public:
  void add(const std::string& name, const std::string& family, double x, double y, double bytes) {
    if (!(x > 0) || !(y > 0) || !(bytes > 0)) return;
    auto it = std::find_if(sums_.begin(), sums_.end(), [&](const Sum& sum) { return sum.name == name; });
    if (it == sums_.end()) it = sums_.insert(it, {name, family, 0, 0, 0, 0});
    it->x += std::log(x), it->y += std::log(y), it->bytes += std::log(bytes);
    ++it->count;
  }
  std::vector<Series> series(std::size_t models, const char* x_unit, const char* y_unit) const {
    SeriesByFamily by_family;
    for (const Sum& sum : sums_) {
      if (sum.count != models) continue;
      const auto mean = [&](double value) { return std::exp(value / static_cast<double>(sum.count)); };
      by_family.add(sum.family, {mean(sum.x), mean(sum.y), mean(sum.bytes),
                                 fmt::format("{}: {:.3g} {}, {:.3g} {}, {:.3g} KB", sum.name, mean(sum.x),
                                             x_unit, mean(sum.y), y_unit, mean(sum.bytes) / kKilobyte)});
    }
    return by_family.series;
  }

 private:
  struct Sum {
    std::string name, family;
    double x, y, bytes;
    std::size_t count;
  };
  std::vector<Sum> sums_;
};

/// All methods from coarse to fine, over all models.
void add_means(const Results& results, std::vector<Picture>& pictures) {
  Means time, angle, budget;
  for (const AccuracyRow& row : results.accuracy) {
    const PeerRow* peer = find_peer(results, row.model, row.peer);
    if (row.shell_percent < 2.9 || peer == nullptr) continue;
    const auto bytes = static_cast<double>(peer->bytes);
    time.add(row.peer, peer->family, std::max(row.mean_error_percent, kLeastError_percent), row.ns.median,
             bytes);
    angle.add(row.peer, peer->family, std::max(row.normal_mean_deg, 0.1), bytes / kKilobyte, bytes);
  }
  for (const BudgetRow& row : results.budgets)
    budget.add(fmt::format("{} in {:g} KB", row.family, row.budget_bytes / kKilobyte), row.family,
               row.mean_error_percent, row.us.median, static_cast<double>(row.bytes));
  const auto add = [&](const char* name, const std::string& title, const std::string& x, const char* y,
                       const std::vector<Series>& series) {
    if (!series.empty()) pictures.push_back({name, title, scatter_svg(title, x, y, series)});
  };
  const std::size_t models = results.models.size();
  add("pareto-time", "What accuracy costs in time and memory: geometric mean over the models",
      fmt::format("mean error of the points answered in the +-3 % shell, % of R_max; below {} drawn there",
                  kLeastError_percent),
      "ns a point", time.series(models, "%", "ns a point"));
  add("pareto-normals", "What good normals cost in memory: geometric mean over the models",
      "mean angle to the true normal of the points answered, degrees; below 0.1 drawn there", "KB resident",
      angle.series(models, "deg", "KB"));
  add("budget", "8 to 128 KB an object: error near contact and frame, geometric mean over the models",
      "mean error of the points answered within 1 % of the surface, % of R_max",
      "microseconds a touching frame", budget.series(models, "%", "us a frame"));
}

/// Geometric mean over the models; the line spans the least and the greatest of them.
std::vector<Bar> bars_over_models(const std::vector<std::pair<std::string, double>>& values) {
  std::vector<Bar> bars;
  std::map<std::string, std::size_t> count;
  for (const auto& [name, value] : values) {
    if (!(value > 0)) continue;
    auto it = std::find_if(bars.begin(), bars.end(), [n = name](const Bar& bar) { return bar.name == n; });
    if (it == bars.end()) it = bars.insert(it, {name, 0, value, value, is_ours(name)});
    it->value += std::log(value);
    it->lower = std::min(it->lower, value);
    it->upper = std::max(it->upper, value);
    ++count[name];
  }
  for (Bar& bar : bars) bar.value = std::exp(bar.value / static_cast<double>(count[bar.name]));
  std::stable_sort(bars.begin(), bars.end(), [](const Bar& a, const Bar& b) { return a.value < b.value; });
  return bars;
}

constexpr const char* kSpan = "; line: from the least model to the greatest";

void add_frames(const Results& results, std::vector<Picture>& pictures) {
  for (const char* work : {"touching", "far", "grasp", "costume", "scene"}) {
    std::vector<std::pair<std::string, double>> values;
    std::set<std::string> models;
    for (const FrameRow& row : results.frames) {
      if (row.work != work) continue;
      values.emplace_back(row.peer, row.us.median);
      models.insert(row.model);
    }
    if (values.empty()) continue;
    const std::string title = models.size() > 1
                                  ? fmt::format("A frame, {}: geometric mean over the models", work)
                                  : fmt::format("A frame, {}: {}", work, *models.begin());
    pictures.push_back({fmt::format("frames-{}", work), title,
                        bars_svg(title, fmt::format("microseconds{}", models.size() > 1 ? kSpan : ""),
                                 bars_over_models(values))});
  }
}

/// Fig. 11 of the paper: ours as a share of the OBB tree, all contacts.
void add_shares_of_tree(const Results& results, std::vector<Picture>& pictures) {
  for (const auto& [name, figure] :
       {std::pair{"touching", "11a"}, std::pair{"grasp", "11a"}, std::pair{"costume", "11b"}}) {
    const char* work = name;  // a binding cannot be captured
    std::vector<std::pair<std::string, double>> values;
    for (const ModelRow& model : results.models) {
      const auto us_of = [&](const std::string& peer) {
        const auto it = std::find_if(results.frames.begin(), results.frames.end(), [&](const FrameRow& row) {
          return row.model == model.model && row.work == work && row.peer == peer;
        });
        return it == results.frames.end() ? std::numeric_limits<double>::quiet_NaN() : it->us.median;
      };
      const double tree_us = us_of(kTreeReference);
      for (const char* peer : {"sqmap-layer1", "sqmap-layer2", "sqmap-layer3", "fcl-obb-first-contact",
                               "fcl-kdop18-all-contacts", "fcl-kdop18-first-contact",
                               "bullet-gimpact-all-contacts", "fcl-obb-rebuilt-all-contacts",
                               "grid-int16-128-simd", "grid-int16-128-simd-culled", "bricks-8bit-128-simd"})
        values.emplace_back(peer, 100 * us_of(peer) / tree_us);
    }
    const std::vector<Bar> bars = bars_over_models(values);
    if (bars.empty()) continue;
    const std::string title = fmt::format(
        "Fig. {} of the paper, {}: cost of a frame, OBB tree with all contacts = 100 %", figure, work);
    pictures.push_back({fmt::format("fig11-{}", work), title,
                        bars_svg(title, std::string("% of the OBB tree") + kSpan, bars)});
  }
}

/// Fig. 12 of the paper: memory against sampling density, of the first model and of all.
void add_memory_by_density(const Results& results, std::vector<Picture>& pictures) {
  if (results.models.empty()) return;
  for (const std::string& model : {results.models.front().model, std::string("all models")}) {
    SeriesByFamily series;
    for (const MemoryRow& row : results.memory) {
      const bool is_shown = row.family == "grid-float-simd" || row.family == "paper-layer2" ||
                            row.family == "sqmap-layer3" || row.family.starts_with("adf-float");
      if (row.model != model || !is_shown) continue;
      // One line for the octree at each bound, over the resolutions of its lattice.
      const std::string family = row.family.starts_with("adf-float")
                                     ? "ADF, bound " + row.method.substr(row.method.rfind('-') + 1) + " %"
                                     : row.family;
      series.add(family, {static_cast<double>(row.density), row.bytes / kKilobyte, row.bytes,
                          fmt::format("{}: {:.4g} KB", row.method, row.bytes / kKilobyte)});
    }
    if (series.series.empty()) continue;
    const std::string title = fmt::format("Fig. 12 of the paper, {}: memory and sampling density", model);
    pictures.push_back({model == "all models" ? "fig12-all" : "fig12-first", title,
                        scatter_svg(title, "samples along an axis: nodes of a grid, rows of a map",
                                    "KB resident", series.series)});
  }
}

void add_rest(const Results& results, std::vector<Picture>& pictures) {
  std::vector<std::pair<std::string, double>> memory, jumps, small_jumps, effects;
  for (const MemoryRow& row : results.memory)
    if (row.model != "all models" && !(row.is_paper && row.model == "Scene"))
      memory.emplace_back(row.is_paper ? "paper: " + row.method : row.method, row.bytes / kKilobyte);
  for (const ForceRow& row : results.force)
    (row.peer.ends_with(kSmallStepsName) ? small_jumps : jumps)
        .emplace_back(row.peer, row.mean_change_percent);
  for (const EffectRow& row : results.effects) effects.emplace_back(row.variant, row.us.median);
  const auto add = [&](const char* name, const char* title, const char* axis, const auto& values) {
    if (!values.empty())
      pictures.push_back({name, title, bars_svg(title, std::string(axis) + kSpan, bars_over_models(values))});
  };
  add("memory", "Memory: geometric mean over the models", "KB resident", memory);
  add("force", "Change of force from step to step of a slide: geometric mean over the models",
      "% of the mean force", jumps);
  add("force-small-steps",
      "Change of force in steps of about 0.005 % of R_max: geometric mean over the models",
      "% of the mean force", small_jumps);
  add("effects", "What a touching frame costs by what it asks for: geometric mean over the models",
      "microseconds", effects);
  SeriesByFamily bake;
  for (const BakeRow& row : results.bake)
    bake.add(row.model, {row.eq35_percent, row.seconds.median, row.bytes,
                         fmt::format("{}: {:.3g} %, {:.3g} s, {:.3g} KB, {} parts", row.model,
                                     row.eq35_percent, row.seconds.median, row.bytes / kKilobyte, row.parts),
                         row.seconds.lower, row.seconds.upper});
  if (!bake.series.empty())
    pictures.push_back({"bake", "What accuracy costs in baking",
                        scatter_svg("What accuracy costs in baking", "error of the maps (eq. 35), % of R_max",
                                    "seconds", bake.series)});
}

enum class Drawn { kLinear, kLogarithmic, kPanels };
/// The axes of a figure that is drawn from curves.
struct Figure {
  const char *figure, *title, *x_title, *y_title;
  Drawn drawn;
};
constexpr Figure kFigures[] = {
    {"13a", "Fig. 13a of the paper: the direction of the force along a slide", "way, % of R_max",
     "angle between force and way, degrees", Drawn::kPanels},
    {"13b", "Fig. 13b of the paper: how the force changes from step to step", "way, % of R_max",
     "|F_i - F_i-1|, % of the mean force", Drawn::kPanels},
    {"13b-small", "Fig. 13b of the paper in steps of about 0.005 % of R_max", "way, % of R_max",
     "|F_i - F_i-1|, % of the mean force", Drawn::kPanels},
    {"14a", "Fig. 14a of the paper: frames of a slide", "pose", "microseconds a frame", Drawn::kLinear},
    {"14b", "Fig. 14b of the paper: many contacts", "points of the probe inside the object, poses with any",
     "microseconds a frame", Drawn::kLogarithmic},
    {"14c", "Fig. 14c of the paper: performance and error, layers 2 to 3",
     "mean error of the points answered in the +-3 % shell, % of R_max", "points a microsecond",
     Drawn::kLogarithmic},
    {"objects", "The same object in ever more faces", "faces of the object", "microseconds a touching frame",
     Drawn::kLogarithmic},
    {"objects-build", "What preparing it costs", "faces of the object", "seconds", Drawn::kLogarithmic},
    {"probes", "The same probe in ever more points", "points of the probe", "microseconds a touching frame",
     Drawn::kLogarithmic},
};

void add_curves(const Results& results, std::vector<Picture>& pictures) {
  for (const Figure& figure : kFigures) {
    std::vector<Line> lines;
    std::string model;
    for (const CurveRow& row : results.curves) {
      if (row.figure != figure.figure) continue;
      model = row.model;
      Line& line = lines.emplace_back(Line{row.curve, row.x, row.y});
      for (const Spread& spread : row.y_spread) {
        line.lower.push_back(spread.lower);
        line.upper.push_back(spread.upper);
      }
    }
    if (lines.empty()) continue;
    const std::string title = fmt::format("{} ({})", figure.title, model);
    const std::string name = figure.figure[0] == '1' ? fmt::format("fig{}", figure.figure) : figure.figure;
    pictures.push_back(
        {name, title,
         figure.drawn == Drawn::kPanels
             ? panels_svg(title, figure.x_title, figure.y_title, lines)
             : lines_svg(title, figure.x_title, figure.y_title, lines, figure.drawn == Drawn::kLogarithmic)});
  }
}

}  // namespace

std::vector<Picture> pictures(const Results& results) {
  std::vector<Picture> all;
  add_means(results, all);
  add_frames(results, all);
  add_accuracy(results, all);
  add_shares_of_tree(results, all);
  add_memory_by_density(results, all);
  add_curves(results, all);
  add_rest(results, all);
  all.insert(all.end(), results.drawings.begin(), results.drawings.end());
  return all;
}

}  // namespace sqmap::bench
