// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "../common/console.hpp"

namespace sqmap::apps {

/// Shows how far a run has come: on a terminal one line that is rewritten (count, asset, stage, percent,
/// rate, time left), else, when asked for, one line a stage. Thread-safe.
class ProgressBoard {
 public:
  struct Item {
    std::string name;
    std::uint64_t weight;  ///< expected share of the work, any unit
  };
  ProgressBoard(Console& console, When when, std::vector<Item> items);

  void at(std::size_t index, std::string_view stage, double fraction);
  void finished(std::size_t index);
  /// It needs no work; it does not count for the rate.
  void skip(std::size_t index);

 private:
  using Clock = std::chrono::steady_clock;
  enum class Style { kNone, kLine, kPlain };

  void draw(std::size_t index);
  /// "[done/all] "; nothing for a single item.
  std::string count() const;
  std::string rate_and_time_left() const;

  struct State {
    std::string stage;
    double fraction = 0;
    bool is_running = false;
  };
  Console& console_;
  Style style_;
  std::vector<Item> items_;
  std::vector<State> states_;
  std::size_t finished_count_ = 0, skipped_count_ = 0;
  std::uint64_t finished_weight_ = 0, total_weight_ = 0;
  Clock::time_point start_, last_draw_;
  std::mutex mutex_;
};

}  // namespace sqmap::apps
