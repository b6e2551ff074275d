// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "sqmap/runtime/object.hpp"

namespace sqmap::runtime {

/// What a question about a body may cost, in units of work that are the same on every machine: one for each
/// block of the body near a part, and kWorkOfLayer for each pair of a point and a superquadric that holds it.
/// The same budget gives the same answers; no clock is read.
struct WorkBudget {
  std::uint64_t units{};       ///< may be spent
  std::uint64_t spent{};       ///< were spent; more than `units` only where even layer 1 costs more
  Layer layer = Layer::kAuto;  ///< the deepest layer that was afforded
  std::uint32_t level{};       ///< of the maps, as asked: a coarser one costs the same time
};

/// By layer, kOne first. The ratios of the times that `sqbench run frames` prints for layers 1, 2 and 3.
inline constexpr std::uint32_t kWorkOfLayer[3] = {2, 4, 9};

/// Turns a time a frame may take into units, by what frames before it took. The caller holds the clock.
///
///     WorkRate rate;                                     // for each machine and loop
///     WorkBudget budget{rate.units_for(200)};            // microseconds
///     object.contacts(body, placement, contacts, query, budget);
///     rate.learn(budget.spent, passed_us);
class WorkRate {
 public:
  /// 20 units a microsecond, slower than any machine it was measured on, until frames have been seen.
  explicit WorkRate(double units_per_us = 20) noexcept : units_per_us_(units_per_us) {}
  std::uint64_t units_for(double us) const noexcept {
    const double units = us * units_per_us_;
    if (!(units > 0)) return 0;  // NaN: none
    return units < 1e15 ? static_cast<std::uint64_t>(units) : std::uint64_t{1000000000000000};
  }
  /// Slow frames count at once, fast ones by a sixteenth: the rate is one that most frames keep.
  void learn(std::uint64_t spent, double took_us) noexcept {
    // A frame of few units says little: what it took is mostly the call itself.
    if (spent < kLeastSpent || !(took_us > 0)) return;
    const double seen = static_cast<double>(spent) / took_us;
    units_per_us_ += (seen < units_per_us_ ? 0.5 : 1.0 / 16) * (seen - units_per_us_);
  }
  double units_per_us() const noexcept { return units_per_us_; }

 private:
  static constexpr std::uint64_t kLeastSpent = 256;
  double units_per_us_;
};

}  // namespace sqmap::runtime
