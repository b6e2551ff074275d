// SPDX-License-Identifier: GPL-3.0-or-later
//
// What a run found: one row type a suite. results.schema.json describes the JSON that it becomes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "sqmap/asset/result.hpp"

namespace sqmap::bench {

inline constexpr double kKilobyte = 1024;  ///< of every KB that is shown

/// Median and quartiles of the repetitions. Results of before these were kept for all times tell the median
/// alone: their quartiles are NaN.
struct Spread {
  double median{};
  double lower = std::numeric_limits<double>::quiet_NaN(), upper = lower;
  std::size_t count{};  ///< of repetitions; 0: not told
};
Spread spread_of(std::vector<double> values);

struct Machine {
  std::string cpu, kernel, compiler, instruction_set, libraries;
  unsigned cores{};
  bool is_pinned{};
};

struct ModelRow {
  std::string model;
  std::size_t vertices{}, faces{}, parts{};
  std::uintmax_t bundle_bytes{};
  double r_max_m{};
};
struct PeerRow {
  std::string model, peer, family;
  std::size_t bytes{};
  Spread build_s;                 ///< on the wall clock, with what it shares with other peers
  double stated_error_percent{};  ///< NaN: none, the method tells contacts only
  bool stated_is_mean{};
};
struct WorkRow {
  std::string model, work;
  std::size_t poses{}, probe_points{};
  double contacts_mean{}, near_mean{}, deepest_percent{}, nearest_percent{};
};
struct FrameRow {
  std::string model, work, peer;
  double answers_mean{};  ///< points answered, or pairs of triangles, a frame
  Spread us;              ///< a frame
  Spread ratio;           ///< to the reference, within each repetition
};
struct AccuracyRow {
  std::string model, peer;
  double shell_percent{};
  std::size_t points{};
  double answered_inside_percent{}, answered_outside_percent{};
  double mean_error_percent{}, p95_error_percent{},
      max_error_percent{};      ///< of the answered points, of R_max
  double wrong_side_percent{};  ///< no answer at all means outside
  double wrong_feet_percent{};  ///< of the feet on superquadrics; NaN: has none
  double normal_mean_deg{};     ///< angle to the true gradient, |distance| > 0.1 % of R_max
  Spread ns;                    ///< a point
};
struct MemoryRow {
  std::string model, method;  ///< method: "DF", "ADF" or "SQ", as in the paper's Table 1, or a peer of ours
  double bytes{};
  bool is_paper{};     ///< printed in the paper, for its own model of that name
  std::string family;  ///< methods that differ only in their setting; empty: the bundle, or of the paper
  unsigned density{};  ///< samples along an axis: nodes of a grid, rows of a map; 0: not its setting
};
struct BakeRow {
  std::string model, method;
  double target_percent{};  ///< of eq. (35); NaN for grids
  Spread seconds;           ///< on the wall clock
  double bytes{};
  double eq35_percent{};  ///< reached; NaN for grids
  std::size_t parts{};
};
struct ForceRow {
  std::string model, peer;
  std::size_t steps{};
  double jumps_percent{};        ///< steps whose force changes by more than 10 % of the mean force
  double worst_jump_percent{};   ///< of the mean force
  double mean_change_percent{};  ///< the same, mean over the steps
  double direction_error_deg{};  ///< mean angle to the gradient of the exact distance
  double unanswered_percent{};
};
struct EffectRow {
  std::string model, variant;
  Spread us;  ///< a touching frame
};
/// The finest setting of a method that fits in so many bytes.
struct BudgetRow {
  std::string model, family, peer;
  double budget_bytes{};
  std::size_t bytes{};
  double mean_error_percent{};   ///< of the answered points within 1 % of R_max of the surface
  double depth_error_percent{};  ///< of the penetration, over all of them; no answer means none
  double wrong_side_percent{};
  double answered_percent{};
  double normal_mean_deg{};
  Spread us;  ///< a touching frame
};
/// A line of a figure whose values are numbers of their own, not in another table.
struct CurveRow {
  std::string figure;  ///< "13a": the paper's Fig. 13a; or a word
  std::string model, curve;
  std::vector<double> x, y;  ///< what they are stands in pictures.cpp; equally many
  /// Of y where that is a time or a rate, as many; otherwise none.
  std::vector<Spread> y_spread{};

  /// A point that was timed.
  void add(double at, const Spread& timed) {
    x.push_back(at);
    y.push_back(timed.median);
    y_spread.push_back(timed);
  }
};
/// A check of what was measured. All must hold, or the run ends with an error.
struct CheckRow {
  std::string model, peer, claim;
  double found{}, allowed{};
  bool holds{};
};

/// Pictures that no numbers belong to.
inline constexpr const char* kDrawings[] = {"fig04", "fig10"};

struct Picture {
  std::string name, title, svg;
};

struct Results {
  std::string command;
  bool is_smoke{};
  Machine machine;
  std::vector<ModelRow> models;
  std::vector<PeerRow> peers;
  std::vector<WorkRow> works;
  std::vector<FrameRow> frames;
  std::vector<AccuracyRow> accuracy;
  std::vector<MemoryRow> memory;
  std::vector<BakeRow> bake;
  std::vector<ForceRow> force;
  std::vector<EffectRow> effects;
  std::vector<BudgetRow> budgets;
  std::vector<CurveRow> curves;
  std::vector<CheckRow> checks;
  std::vector<Picture> drawings;  ///< of objects and maps; pictures only, no numbers
};

Machine this_machine(bool is_pinned);

std::string results_json(const Results& results);
/// What results_json() wrote, to its six digits; drawings are not in it.
Result<Results> results_from_json(std::string_view text);
std::string results_csv(const Results& results);
/// The page, and the pictures it shows as files of their own.
std::vector<Picture> pictures(const Results& results);
std::string results_page(const Results& results, const std::vector<Picture>& pictures);

}  // namespace sqmap::bench
