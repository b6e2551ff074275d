// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <functional>
#include <string>
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

/// Keeps this thread on one core. False where the system refuses.
bool pin_thread();

}  // namespace sqmap::bench
