// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <ctime>
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
    begun_processor_ = processor_time();
  }
  /// Length of the frame [microseconds].
  double end() {
    const auto used = processor_time() - begun_processor_;
    const Clock::time_point now = Clock::now();
    due_ += period_;
    if (now > due_) {
      ++missed_;
      if (used < period_) ++kept_waiting_;
      due_ = now;
    }
    processor_us_ = std::chrono::duration<double, std::micro>(used).count();
    return std::chrono::duration<double, std::micro>(now - begun_).count();
  }
  /// What the last frame had of the processor [microseconds].
  double processor_us() const noexcept { return processor_us_; }

  std::size_t missed() const noexcept { return missed_; }
  /// Of missed(): frames that had less than a period of the processor. What made them late is the system's.
  std::size_t kept_waiting() const noexcept { return kept_waiting_; }

 private:
  using Clock = std::chrono::steady_clock;
  /// Of this thread.
  static std::chrono::nanoseconds processor_time() noexcept {
    timespec time{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
  }

  Clock::duration period_;
  bool is_fast_;
  Clock::time_point due_, begun_;
  std::chrono::nanoseconds begun_processor_{};
  double processor_us_ = 0;
  std::size_t missed_ = 0, kept_waiting_ = 0;
};

}  // namespace sqmap::apps
