// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <thread>

namespace sqmap::apps {

/// Frames at a fixed rate. A frame misses its deadline when it ends after the next one should have begun; the
/// clock then starts anew, so that one late frame is not counted again and again.
class FrameClock {
 public:
  FrameClock(double rate_hz, bool is_fast)
      : period_(std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1 / rate_hz))),
        is_fast_(is_fast),
        due_(Clock::now()) {}

  void begin() {
    if (!is_fast_) std::this_thread::sleep_until(due_);
    begun_ = Clock::now();
    if (is_fast_) due_ = begun_;
    woke_late_ = begun_ - due_ > period_ / 2;
  }
  /// Length of the frame's work [microseconds].
  double end() {
    const Clock::time_point now = Clock::now();
    due_ += period_;
    if (now > due_) {
      ++missed_;
      if (woke_late_) ++overslept_;
      due_ = now;
    }
    return std::chrono::duration<double, std::micro>(now - begun_).count();
  }

  std::size_t missed() const noexcept { return missed_; }
  /// Of missed(): frames that the system began more than half a period late.
  std::size_t overslept() const noexcept { return overslept_; }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::duration period_;
  bool is_fast_;
  Clock::time_point due_, begun_;
  bool woke_late_ = false;
  std::size_t missed_ = 0, overslept_ = 0;
};

}  // namespace sqmap::apps
