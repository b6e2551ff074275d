// SPDX-License-Identifier: GPL-3.0-or-later
#include "budget_words.hpp"

#include <algorithm>
#include <map>
#include <set>

#include <fmt/format.h>

namespace sqmap::bench {
namespace {

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

/// Models of one budget on which `ours` meets a rival that is better in both, and by whom.
struct Losses {
  std::size_t models{};
  std::map<std::string, std::vector<std::string>> models_by_rival;
  std::size_t lost() const {
    std::set<std::string> names;
    for (const auto& [rival, lost_on] : models_by_rival) names.insert(lost_on.begin(), lost_on.end());
    return names.size();
  }
};

Losses losses_of(const Results& results, double budget_bytes, const std::string& ours,
                 double BudgetRow::*error) {
  Losses losses;
  for (const BudgetRow& own : results.budgets) {
    if (own.budget_bytes != budget_bytes || own.peer != ours) continue;
    ++losses.models;
    for (const BudgetRow& rival : results.budgets)
      if (rival.budget_bytes == budget_bytes && rival.model == own.model &&
          !rival.peer.starts_with("sqmap") && rival.*error < own.*error && rival.us.median < own.us.median)
        losses.models_by_rival[rival.family].push_back(own.model);
  }
  return losses;
}

}  // namespace

std::vector<std::string> budget_words(const Results& results) {
  std::vector<std::string> words;
  std::set<double> budgets;
  std::set<std::string> models;
  for (const BudgetRow& row : results.budgets) {
    budgets.insert(row.budget_bytes);
    models.insert(row.model);
  }
  std::vector<std::string> kept, missed;
  for (const double budget : budgets) {
    const Losses losses = losses_of(results, budget, "sqmap-layer3", &BudgetRow::mean_error_percent);
    const bool is_kept = losses.models == models.size() && losses.lost() == 0;
    (is_kept ? kept : missed).push_back(fmt::format("{:g}", budget / kKilobyte));
  }
  if (!budgets.empty())
    words.push_back(fmt::format(
        "The target: for every budget of 8 to 128 KB an object, no rival has both a smaller error near "
        "contact "
        "(within 1 % of the surface) and a shorter frame than layer 3, on any model. {}{}",
        missed.empty() ? "It holds at all that were run." : "It does not hold at " + joined(missed) + " KB",
        missed.empty() ? ""
        : kept.empty() ? "."
                       : ", and holds at " + joined(kept) + " KB."));
  for (const double budget : budgets) {
    const Losses closest = losses_of(results, budget, "sqmap-layer3", &BudgetRow::mean_error_percent);
    const Losses faster = losses_of(results, budget, "sqmap-layer2", &BudgetRow::mean_error_percent);
    const Losses normals = losses_of(results, budget, "sqmap-layer3", &BudgetRow::normal_mean_deg);
    const Losses depth = losses_of(results, budget, "sqmap-layer3", &BudgetRow::depth_error_percent);
    std::string text = fmt::format("{:g} KB an object: ", budget / kKilobyte);
    if (closest.models < models.size())
      text += fmt::format("sqmap fits for {} of {} models only; ", closest.models, models.size());
    if (closest.models == 0) {
      words.push_back(text + "there is nothing to compare.");
      continue;
    }
    if (closest.lost() == 0)
      text +=
          "no rival has both a smaller error, of the points it answers within 1 % of the surface, and a "
          "shorter frame than "
          "layer 3";
    else
      text += fmt::format(
          "a rival has both a smaller error, of the points it answers within 1 % of the surface, and a "
          "shorter "
          "frame than layer 3 on {} of {} models",
          closest.lost(), closest.models);
    std::vector<std::string> by;
    for (const auto& [rival, lost_on] : closest.models_by_rival)
      by.push_back(fmt::format("{} on {}", rival, joined(lost_on)));
    if (!by.empty()) text += " (" + joined(by) + ")";
    words.push_back(
        fmt::format("{}; than layer 2 on {} of {}. By the error of the penetration depth, where no answer "
                    "counts as none, "
                    "layer 3 loses on {}; by the angle of the normals on {}.",
                    text, faster.lost(), faster.models, depth.lost(), normals.lost()));
  }
  return words;
}

}  // namespace sqmap::bench
