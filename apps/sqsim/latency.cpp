// SPDX-License-Identifier: Apache-2.0
#include "latency.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include <fmt/format.h>

namespace sqmap::apps {

double percentile(std::span<const double> samples, double share) {
  if (samples.empty()) return 0;
  std::vector<double> sorted(samples.begin(), samples.end());
  const double rank = std::ceil(share * static_cast<double>(sorted.size()));
  const std::size_t index = rank > 1 ? static_cast<std::size_t>(rank) - 1 : 0;
  std::ranges::nth_element(sorted, sorted.begin() + static_cast<std::ptrdiff_t>(index));
  return sorted[index];
}

std::string latency_text(std::span<const double> microseconds) {
  std::map<int, std::size_t> bins;  // floor(log2) of the time
  for (const double us : microseconds) ++bins[static_cast<int>(std::floor(std::log2(std::max(us, 0.125))))];
  std::size_t fullest = 1;
  for (const auto& [bin, count] : bins) fullest = std::max(fullest, count);
  std::string text = "microseconds a frame     frames\n";
  for (const auto& [bin, count] : bins)
    text += fmt::format("{:>9.4g} .. {:<9.4g} {:>8} {}\n", std::exp2(bin), std::exp2(bin + 1), count,
                        std::string((40 * count + fullest - 1) / fullest, '#'));
  return text + percentiles_text(microseconds) + "\n";
}

std::string percentiles_text(std::span<const double> microseconds) {
  return fmt::format("median {:.1f} us, 99.9 % {:.1f} us, worst {:.1f} us", percentile(microseconds, 0.5),
                     percentile(microseconds, 0.999), percentile(microseconds, 1));
}

std::string missed_text(const FrameClock& clock) {
  return fmt::format("missed deadlines: {} ({} by frames that had less than a period of the processor)\n",
                     clock.missed(), clock.kept_waiting());
}

}  // namespace sqmap::apps
