// SPDX-License-Identifier: GPL-3.0-or-later
//
// The page: what was found in words, then every table and picture. One file without scripts or links to
// others.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "budget_words.hpp"
#include "paper_words.hpp"
#include "peer.hpp"
#include "results.hpp"
#include "svg.hpp"

namespace sqmap::bench {
namespace {

constexpr const char* kStyle =
    "body{font-family:sans-serif;max-width:960px;margin:2em auto;padding:0 1em;color:#222}"
    "table{border-collapse:collapse;margin:1em 0;font-size:13px}"
    "td,th{padding:2px 8px;border-bottom:1px solid #ddd;text-align:right}"
    "td:first-child,th:first-child,td:nth-child(2),th:nth-child(2){text-align:left}"
    "tr.ours{background:#fbeeec}svg{max-width:100%;height:auto;border:1px solid #eee;margin:.5em 0}";

std::string number(double value) { return std::isnan(value) ? "-" : fmt::format("{:.3g}", value); }

class Table {
 public:
  explicit Table(const std::vector<std::string>& heads) { add(heads, "th", false); }
  void row(const std::vector<std::string>& cells, bool is_ours) { add(cells, "td", is_ours); }
  std::string html() const { return "<table>\n" + rows_ + "</table>\n"; }

 private:
  void add(const std::vector<std::string>& cells, const char* tag, bool is_ours) {
    rows_ += is_ours ? "<tr class=\"ours\">" : "<tr>";
    for (const std::string& cell : cells) rows_ += fmt::format("<{0}>{1}</{0}>", tag, escaped(cell));
    rows_ += "</tr>\n";
  }
  std::string rows_;
};

bool is_ours(const std::string& peer) { return peer.starts_with("sqmap"); }

/// How often it was timed.
std::string times(const Spread& spread) { return spread.count == 0 ? "-" : fmt::to_string(spread.count); }

std::string quartiles(const Spread& spread) { return number(spread.lower) + " - " + number(spread.upper); }

std::string sentence(const std::string& words) { return "<p>" + escaped(words) + "</p>\n"; }

/// Per work, each of our layers against whoever is fastest, model by model.
std::string frame_words(const Results& results) {
  std::string words;
  for (const char* work : {"touching", "far", "grasp", "costume", "scene"}) {
    std::map<std::string, const FrameRow*> fastest;  // of each model
    std::map<std::string, std::size_t> models_of;    // where a rival is that
    for (const FrameRow& row : results.frames) {
      if (row.work != work || is_ours(row.peer)) continue;
      const FrameRow*& best = fastest[row.model];
      if (best == nullptr || row.us.median < best->us.median) best = &row;
    }
    for (const auto& [model, best] : fastest) ++models_of[best->peer];
    std::string rivals, layers;
    for (const auto& [peer, count] : models_of)
      rivals += fmt::format("{}{} on {}", rivals.empty() ? "" : ", ", peer, count);
    for (const int layer : {2, 3}) {
      double log_ratio = 0;
      std::size_t models = 0, won = 0;
      for (const FrameRow& row : results.frames) {
        if (row.work != work || row.peer != fmt::format("sqmap-layer{}", layer) ||
            fastest[row.model] == nullptr)
          continue;
        const double ratio = row.us.median / fastest[row.model]->us.median;
        log_ratio += std::log(ratio);
        ++models;
        if (ratio < 1) ++won;
      }
      if (models > 0)
        layers += fmt::format("{}layer {} takes {:.3g} times as long and wins on {} of {}",
                              layers.empty() ? "" : "; ", layer,
                              std::exp(log_ratio / static_cast<double>(models)), won, models);
    }
    if (!layers.empty())
      words += sentence(
          fmt::format("Frames, {}, against the fastest rival of each model ({}): {} (geometric mean).", work,
                      rivals, layers));
  }
  return words;
}

std::string joined(const std::set<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

/// At how many settings of sqmap a rival is at once smaller, better in `value` and faster a point.
std::string losses_in_shell(const Results& results, double shell_percent, double AccuracyRow::*value,
                            const char* better) {
  std::map<std::pair<std::string, std::string>, double> bytes;
  for (const PeerRow& row : results.peers) bytes[{row.model, row.peer}] = static_cast<double>(row.bytes);
  const auto bytes_of = [&](const AccuracyRow& row) {
    const auto it = bytes.find({row.model, row.peer});
    return it == bytes.end() ? INFINITY : it->second;
  };
  std::size_t cases = 0, beaten = 0;
  std::set<std::string> by;
  for (const AccuracyRow& ours : results.accuracy) {
    if (std::abs(ours.shell_percent - shell_percent) > 1e-6 || !is_ours(ours.peer)) continue;
    ++cases;
    bool is_beaten = false;
    for (const AccuracyRow& rival : results.accuracy) {
      if (rival.model != ours.model || rival.shell_percent != ours.shell_percent || is_ours(rival.peer) ||
          !(bytes_of(rival) <= bytes_of(ours)) || !(rival.*value < ours.*value) ||
          !(rival.ns.median < ours.ns.median))
        continue;
      is_beaten = true;
      by.insert(rival.peer);
    }
    if (is_beaten) ++beaten;
  }
  if (cases == 0) return {};
  const std::string where = fmt::format(
      "{} (+-{} % shell)", shell_percent < 1 ? "Near contact" : "Around the surface", shell_percent);
  return sentence(
      beaten == 0
          ? fmt::format(
                "{}, for none of {} settings of sqmap is a rival at once smaller, faster a point and {}.",
                where, cases, better)
          : fmt::format("{}, sqmap loses at {} of {} settings: a rival is at once smaller, faster a point "
                        "and {} ({}).",
                        where, beaten, cases, better, joined(by)));
}

/// What is not answered is in no mean: it is said beside them.
std::string answered_words(const Results& results, double shell_percent) {
  double wrong = 0, answered = 0, angle_deg = 0, rivals_least = 100;
  std::size_t models = 0;
  std::map<std::string, std::pair<double, std::size_t>> angles;
  for (const AccuracyRow& row : results.accuracy) {
    if (std::abs(row.shell_percent - shell_percent) > 1e-6) continue;
    if (!is_ours(row.peer)) {
      rivals_least = std::min(rivals_least, row.answered_outside_percent);
      auto& [sum_deg, count] = angles[row.peer];
      sum_deg += row.normal_mean_deg, ++count;
    }
    if (row.peer != "sqmap-layer3") continue;
    wrong += row.wrong_side_percent;
    answered += row.answered_outside_percent;
    angle_deg += row.normal_mean_deg;
    ++models;
  }
  if (models == 0) return {};
  const auto count = static_cast<double>(models);
  std::vector<std::pair<double, std::string>> closer;  // by their mean angle
  for (const auto& [peer, sum] : angles)
    if (const double mean_deg = sum.first / static_cast<double>(sum.second); mean_deg < angle_deg / count)
      closer.emplace_back(mean_deg, peer);
  std::sort(closer.begin(), closer.end());
  constexpr std::size_t kNamed = 3;  // the table has the others
  std::string named;
  for (std::size_t i = 0; i < std::min(closer.size(), kNamed); ++i)
    named += fmt::format("{}{} by {:.3g}", i == 0 ? "" : ", ", closer[i].second,
                         angle_deg / count - closer[i].first);
  return sentence(fmt::format(
      "In the +-{} % shell sqmap (layer 3) puts {:.2g} % of the points on the wrong side, and of "
      "the points outside "
      "the object it knows a distance for {:.3g} %: the others lie outside every superquadric, "
      "and are in none of its "
      "means. Of the rivals that tell distances, none knows less than {:.4g} %. Its normals are "
      "off by {:.3g} degrees "
      "in the mean; {}",
      shell_percent, wrong / count, answered / count, rivals_least, angle_deg / count,
      closer.empty() ? "no rival's are closer."
                     : fmt::format("those of {} settings of rivals are closer, most of all {} degrees.",
                                   closer.size(), named)));
}

std::string accuracy_words(const Results& results) {
  std::string words;
  for (const double shell_percent : {0.5, 3.0}) {
    words += losses_in_shell(results, shell_percent, &AccuracyRow::mean_error_percent, "more accurate");
    words += losses_in_shell(results, shell_percent, &AccuracyRow::normal_mean_deg, "closer in its normals");
    words += answered_words(results, shell_percent);
  }
  return words;
}

/// "3", or "2 to 5".
std::string least_to_most(const std::set<std::size_t>& counts) {
  return *counts.begin() == *counts.rbegin() ? fmt::to_string(*counts.begin())
                                             : fmt::format("{} to {}", *counts.begin(), *counts.rbegin());
}

/// How far apart the quartiles of the curves of times lie, which as bands are hard to read off.
std::string curve_words(const Results& results) {
  std::map<std::string, std::vector<double>> widths_percent;  // by figure
  std::set<std::size_t> counts;
  for (const CurveRow& row : results.curves)
    for (const Spread& spread : row.y_spread) {
      widths_percent[row.figure].push_back(100 * (spread.upper - spread.lower) / spread.median);
      counts.insert(spread.count);
    }
  if (counts.empty()) return {};
  std::string words;
  for (const auto& [figure, widths] : widths_percent)
    words += fmt::format("{}{} {:.3g} and {:.3g}", words.empty() ? "" : ", ", figure,
                         spread_of(widths).median, *std::max_element(widths.begin(), widths.end()));
  return sentence(
      fmt::format("Points of the curves of times are medians of {} repetitions. How far apart their "
                  "quartiles are, in percent "
                  "of the median, for the middle point of a figure and for the widest: {}.",
                  least_to_most(counts), words));
}

/// How often builds and bakes were repeated.
std::string build_words(const Results& results) {
  std::set<std::size_t> counts;
  for (const PeerRow& row : results.peers) counts.insert(row.build_s.count);
  for (const BakeRow& row : results.bake) counts.insert(row.seconds.count);
  counts.erase(0);  // not told
  if (counts.empty()) return {};
  return sentence(
      fmt::format("Seconds of builds and bakes are medians of {} repetitions, fewer the longer they "
                  "take; the tables tell of how many, and the quartiles.",
                  least_to_most(counts)));
}

/// Its ratio to itself is one in every repetition.
std::string reference_of(const Results& results) {
  for (const FrameRow& row : results.frames)
    if (row.ratio.lower == 1 && row.ratio.upper == 1) return row.peer;
  return kReference;
}

std::string tables(const Results& results) {
  std::string html;
  if (!results.works.empty()) {
    Table table(
        {"model", "work", "poses", "points", "contacts", "points within 3 %", "deepest, %", "nearest, %"});
    for (const WorkRow& row : results.works)
      table.row({row.model, row.work, fmt::to_string(row.poses), fmt::to_string(row.probe_points),
                 number(row.contacts_mean), number(row.near_mean), number(row.deepest_percent),
                 number(row.nearest_percent)},
                false);
    html += "<h2>The work</h2>\n" + table.html();
  }
  if (!results.frames.empty()) {
    Table table({"model", "peer", "work", "answers", "us, median", "quartiles",
                 "ratio to " + reference_of(results), "quartiles"});
    for (const FrameRow& row : results.frames)
      table.row({row.model, row.peer, row.work, number(row.answers_mean), number(row.us.median),
                 quartiles(row.us), number(row.ratio.median), quartiles(row.ratio)},
                is_ours(row.peer));
    html += "<h2>Frames</h2>\n" + table.html();
  }
  if (!results.accuracy.empty()) {
    Table table({"model", "peer", "shell, %", "mean error, %", "95th, %", "wrong side, %", "wrong feet, %",
                 "normal, deg", "answered in/out, %", "ns a point", "quartiles"});
    for (const AccuracyRow& row : results.accuracy)
      table.row({row.model, row.peer, number(row.shell_percent), number(row.mean_error_percent),
                 number(row.p95_error_percent), number(row.wrong_side_percent),
                 number(row.wrong_feet_percent), number(row.normal_mean_deg),
                 number(row.answered_inside_percent) + " / " + number(row.answered_outside_percent),
                 number(row.ns.median), quartiles(row.ns)},
                is_ours(row.peer));
    html +=
        "<h2>Accuracy</h2>\n<p>Errors and angles are those of the points that the method answered; the "
        "column before "
        "the times tells how many of those inside and outside the object that are. The side counts for every "
        "point.</p>\n" +
        table.html();
  }
  if (!results.budgets.empty()) {
    Table table({"model", "method", "budget, KB", "KB resident", "error, %", "depth error, %",
                 "wrong side, %", "answered, %", "normal, deg", "us a frame", "quartiles"});
    for (const BudgetRow& row : results.budgets)
      table.row(
          {row.model, row.peer, number(row.budget_bytes / kKilobyte),
           number(static_cast<double>(row.bytes) / kKilobyte), number(row.mean_error_percent),
           number(row.depth_error_percent), number(row.wrong_side_percent), number(row.answered_percent),
           number(row.normal_mean_deg), number(row.us.median), quartiles(row.us)},
          is_ours(row.peer));
    html +=
        "<h2>Budgets</h2>\n<p>Of each method the finest setting that fits; sqmap is baked for each budget. "
        "Errors and angles of the answered points within 1 % of R_max of the surface; the error of the depth "
        "is that of "
        "all of them, no answer counting as no depth.</p>\n" +
        table.html();
  }
  if (!results.peers.empty()) {
    Table table({"model", "peer", "KB resident", "build, s", "quartiles", "times", "stated error, %", "of"});
    for (const PeerRow& row : results.peers)
      table.row({row.model, row.peer, number(static_cast<double>(row.bytes) / kKilobyte),
                 number(row.build_s.median), quartiles(row.build_s), times(row.build_s),
                 number(row.stated_error_percent), row.stated_is_mean ? "mean" : "every point"},
                is_ours(row.peer));
    html +=
        "<h2>Peers</h2>\n<p>Build time starts from the mesh; for sqmap from the bundle, whose baking is a "
        "table of its "
        "own.</p>\n" +
        table.html();
  }
  if (!results.memory.empty()) {
    Table beside({"model", "source", "DF, MB", "ADF, MB", "the paper's maps, MB", "sqmap, MB"});
    for (const MemoryComparison& row : table_1(results))
      beside.row({row.model, row.is_paper ? "paper" : "measured", number(row.grid_mb), number(row.octree_mb),
                  number(row.paper_map_mb), number(row.ours_mb)},
                 false);
    html +=
        "<h2>Table 1</h2>\n<p>Measured: float grids at the greatest resolution, the octree within 0.4 % of "
        "it, the paper's maps at 100 x 200.</p>\n" +
        beside.html();
    Table table({"model", "method", "KB", "source"});
    for (const MemoryRow& row : results.memory)
      table.row({row.model, row.method, number(row.bytes / kKilobyte),
                 row.is_paper ? "paper, Table 1" : "measured"},
                is_ours(row.method));
    html += "<h2>Memory</h2>\n" + table.html();
  }
  if (!results.bake.empty()) {
    Table table(
        {"model", "method", "target, %", "seconds", "quartiles", "times", "KB", "eq. 35, %", "parts"});
    for (const BakeRow& row : results.bake)
      table.row({row.model, row.method, number(row.target_percent), number(row.seconds.median),
                 quartiles(row.seconds), times(row.seconds), number(row.bytes / kKilobyte),
                 number(row.eq35_percent), fmt::to_string(row.parts)},
                is_ours(row.method));
    html += "<h2>Baking</h2>\n" + table.html();
  }
  if (!results.force.empty()) {
    Table table({"model", "peer", "steps", "jumps over 10 %, %", "worst, %", "mean change, %",
                 "direction, deg", "unanswered, %"});
    for (const ForceRow& row : results.force)
      table.row({row.model, row.peer, fmt::to_string(row.steps), number(row.jumps_percent),
                 number(row.worst_jump_percent), number(row.mean_change_percent),
                 number(row.direction_error_deg), number(row.unanswered_percent)},
                is_ours(row.peer));
    html += "<h2>Force along a slide</h2>\n" + table.html();
  }
  if (!results.effects.empty()) {
    Table table({"model", "asked for", "us a frame", "quartiles"});
    for (const EffectRow& row : results.effects)
      table.row({row.model, row.variant, number(row.us.median), quartiles(row.us)}, true);
    html += "<h2>What is asked for</h2>\n" + table.html();
  }
  if (!results.checks.empty()) {
    Table table({"model", "peer", "claim", "found", "allowed", "holds"});
    for (const CheckRow& row : results.checks)
      table.row(
          {row.model, row.peer, row.claim, number(row.found), number(row.allowed), row.holds ? "yes" : "NO"},
          is_ours(row.peer));
    html += "<h2>Checks against the exact mesh</h2>\n" + table.html();
  }
  return html;
}

}  // namespace

std::string results_page(const Results& results, const std::vector<Picture>& pictures) {
  const Machine& m = results.machine;
  std::string html = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\"><title>sqbench</title>\n"
      "<link rel=\"icon\" href=\"data:,\"><style>{}</style></head>\n<body>\n<h1>What accuracy costs in "
      "time</h1>\n",
      kStyle);
  html += sentence(fmt::format("{}; {}, one thread{}, {}, {}, {}; {}.", results.command, m.cpu,
                               m.is_pinned ? ", pinned to one core" : "", m.instruction_set, m.compiler,
                               m.kernel, m.libraries));
  if (results.is_smoke) html += sentence("A smoke run: a few poses and points. The times mean little.");
  html += "<h2>In words</h2>\n" + frame_words(results) + accuracy_words(results);
  for (const std::string& words : budget_words(results)) html += sentence(words);
  for (const std::string& words : paper_words(results)) html += sentence(words);
  const auto broken = static_cast<std::size_t>(std::count_if(results.checks.begin(), results.checks.end(),
                                                             [](const CheckRow& row) { return !row.holds; }));
  if (!results.checks.empty())
    html += sentence(fmt::format("{} of {} checks of the answers against the exact mesh hold.",
                                 results.checks.size() - broken, results.checks.size()));
  html += sentence(
      "Every method is asked the same: signed distance, unit gradient and reaction force of each point "
      "within 3 % of R_max "
      "of the surface; trees of triangles tell the pairs that cross, or whether any do. All methods get the "
      "points sorted into blocks of 32 neighbours. Times of frames and points are processor time of the one "
      "thread, medians; in each repetition all methods take turns, and ratios are formed within a "
      "repetition. "
      "What is prepared is timed by the clock on the wall. A KB is 1024 bytes.");
  html += curve_words(results) + build_words(results);
  if (!pictures.empty()) html += "<h2>Pictures</h2>\n";
  for (const Picture& picture : pictures) html += "<figure>" + picture.svg + "</figure>\n";
  return html + tables(results) + "</body>\n</html>\n";
}

}  // namespace sqmap::bench
