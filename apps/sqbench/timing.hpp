// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "results.hpp"

namespace sqmap::bench {

/// One method at one kind of work. `run(i)` does item i and returns how much it answered.
struct Contestant {
  std::string name;
  std::function<std::size_t(std::size_t)> run;
};

struct Timing {
  std::vector<double> seconds;  ///< of processor time, an item, by repetition
  double answers_mean{};
  Spread spread(double units_per_second) const;
  /// Of its inverse: how many of `things` are done in a second, where an item is so many.
  Spread rate(double things) const;
  /// This over that, repetition by repetition.
  Spread ratio_to(const Timing& other) const;
};

/// Times all contestants over all items. In each repetition each of them has its turn, each time another
/// first, so that whatever disturbs the machine disturbs all; fast ones repeat their items until kShortest_s
/// has passed, and those that take longer than kLong_s have the first kTurnsOfLong turns only.
std::vector<Timing> measure(const std::vector<Contestant>& contestants, std::size_t items,
                            std::size_t repetitions);
inline constexpr double kShortest_s = 5e-4, kLong_s = 0.05;
inline constexpr std::size_t kTurnsOfLong = 5;

/// Of the clock on the wall, from some moment on [s].
double wall_s() noexcept;

/// What is prepared is timed kMakings times, but twice where it took kTwice_s or more, and once where
/// kOnce_s: so a run takes no more than minutes longer.
bool is_timed_enough(const std::vector<double>& seconds) noexcept;
inline constexpr std::size_t kMakings = 3;
inline constexpr double kTwice_s = 0.2, kOnce_s = 10;

/// Makes the same thing until it is timed often enough, and returns the last. Adds to `seconds` what each
/// took on the wall clock.
template <class Make>
auto make_timed(const Make& make, std::vector<double>& seconds) {
  std::optional<std::invoke_result_t<const Make&>> made;
  do {
    made.reset();  // there may be no room for two
    const double start_s = wall_s();
    made.emplace(make());
    seconds.push_back(wall_s() - start_s);
  } while (!is_timed_enough(seconds));
  return std::move(*made);
}

/// Keeps this thread on one core. False where the system refuses.
bool pin_thread();

}  // namespace sqmap::bench
