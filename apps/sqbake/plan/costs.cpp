// SPDX-License-Identifier: GPL-3.0-or-later
#include "costs.hpp"

#include <algorithm>
#include <cmath>

namespace sqmap::apps {
namespace {

// As large as most files are: their size tells little about the time (scripts/score_shards). Times of an
// earlier bake tell more.
constexpr std::uint64_t kFixedCost = 1'000'000;

/// Estimate over seconds: the median of the inputs that have a time; 1 where none has.
double cost_per_second(std::span<const InputFile> inputs, const BakeTimes& times) {
  std::vector<double> ratios;
  for (const InputFile& input : inputs)
    if (const auto time = times.find(input.name); time != times.end())
      ratios.push_back(static_cast<double>(estimated_cost(input.bytes)) / time->second);
  if (ratios.empty()) return 1;
  const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
  std::ranges::nth_element(ratios, middle);
  return *middle;
}

}  // namespace

std::uint64_t estimated_cost(std::uint64_t input_bytes) { return kFixedCost + input_bytes; }

BakeTimes bake_times(std::span<const AssetRecord> records) {
  BakeTimes times;
  for (const AssetRecord& record : records)
    if (!record.is_cached && record.outcome != "cancelled" && std::isfinite(record.seconds) &&
        record.seconds > 0)
      times[record.input] = record.seconds;
  return times;
}

std::vector<std::uint64_t> expected_costs(std::span<const InputFile> inputs, const BakeTimes& times) {
  constexpr double kMostCost = 1e12;  // 18 million of them fit the 64 bits of a shard's sum
  const double scale = cost_per_second(inputs, times);
  std::vector<std::uint64_t> costs;
  for (const InputFile& input : inputs) {
    const auto time = times.find(input.name);
    costs.push_back(time == times.end() ? estimated_cost(input.bytes)
                                        : static_cast<std::uint64_t>(
                                              std::clamp(std::round(scale * time->second), 1.0, kMostCost)));
  }
  return costs;
}

}  // namespace sqmap::apps
