// SPDX-License-Identifier: GPL-3.0-or-later
#include "timing.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <limits>

#include <sched.h>

namespace sqmap::bench {
namespace {

/// Processor time of this thread: what else runs on the machine takes turns, but does not count.
double thread_s() {
  std::timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace

Spread spread_of(std::vector<double> values) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  if (values.empty()) return {kNan, kNan, kNan, 0};
  std::sort(values.begin(), values.end());
  const auto at = [&](double share) {  // linear between order statistics
    const double place = share * static_cast<double>(values.size() - 1);
    const auto low = static_cast<std::size_t>(place);
    const std::size_t high = std::min(low + 1, values.size() - 1);
    return values[low] + (place - static_cast<double>(low)) * (values[high] - values[low]);
  };
  return {at(0.5), at(0.25), at(0.75), values.size()};
}

Spread Timing::spread(double units_per_second) const {
  std::vector<double> values = seconds;
  for (double& value : values) value *= units_per_second;
  return spread_of(std::move(values));
}

Spread Timing::rate(double things) const {
  std::vector<double> values = seconds;
  for (double& value : values) value = things / value;
  return spread_of(std::move(values));
}

Spread Timing::ratio_to(const Timing& other) const {
  std::vector<double> values;
  for (std::size_t i = 0; i < std::min(seconds.size(), other.seconds.size()); ++i)
    values.push_back(seconds[i] / other.seconds[i]);
  return spread_of(std::move(values));
}

std::vector<Timing> measure(const std::vector<Contestant>& contestants, std::size_t items,
                            std::size_t repetitions) {
  const auto once = [items](const Contestant& contestant, std::size_t rounds, std::size_t& answers) {
    const double start_s = thread_s();
    for (std::size_t round = 0; round < rounds; ++round)
      for (std::size_t item = 0; item < items; ++item) answers += contestant.run(item);
    return thread_s() - start_s;
  };
  std::vector<Timing> timings(contestants.size());
  std::vector<std::size_t> rounds(contestants.size(), 1), turns(contestants.size(), repetitions);
  for (std::size_t c = 0; c < contestants.size(); ++c) {  // warms up, and counts
    std::size_t answers = 0;
    const double seconds = once(contestants[c], 1, answers);
    timings[c].answers_mean = static_cast<double>(answers) / static_cast<double>(items);
    rounds[c] =
        static_cast<std::size_t>(std::clamp(std::ceil(kShortest_s / std::max(seconds, 1e-9)), 1.0, 1e4));
    if (seconds > kLong_s) turns[c] = std::min(repetitions, kTurnsOfLong);
  }
  for (std::size_t repetition = 0; repetition < repetitions; ++repetition)
    for (std::size_t turn = 0; turn < contestants.size(); ++turn) {
      const std::size_t c = (turn + repetition) % contestants.size();
      if (repetition >= turns[c]) continue;
      std::size_t answers = 0;
      const double seconds = once(contestants[c], rounds[c], answers);
      timings[c].seconds.push_back(seconds / static_cast<double>(rounds[c] * items));
    }
  return timings;
}

double wall_s() noexcept {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

bool is_timed_enough(const std::vector<double>& seconds) noexcept {
  if (seconds.empty()) return false;
  const double longest_s = *std::max_element(seconds.begin(), seconds.end());
  return seconds.size() >= (longest_s < kTwice_s ? kMakings : longest_s < kOnce_s ? 2 : 1);
}

bool pin_thread() {
  cpu_set_t cores;
  CPU_ZERO(&cores);
  const int here = sched_getcpu();
  if (here < 0) return false;
  CPU_SET(here, &cores);
  return sched_setaffinity(0, sizeof(cores), &cores) == 0;
}

}  // namespace sqmap::bench
