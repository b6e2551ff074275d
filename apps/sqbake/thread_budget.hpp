// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sqmap/asset/result.hpp"

namespace sqmap::apps {

/// Threads that workers may use: at most `limit`, and where GNU make runs us with its jobserver, each but the
/// first only while we hold one of make's tokens.
class ThreadBudget {
 public:
  /// `makeflags`: the text of MAKEFLAGS, or null. A jobserver that make did not hand on (a rule without `+`)
  /// leaves one thread.
  ThreadBudget(unsigned limit, const char* makeflags);
  /// Gives all tokens back.
  ~ThreadBudget();
  ThreadBudget(const ThreadBudget&) = delete;
  ThreadBudget& operator=(const ThreadBudget&) = delete;

  unsigned limit() const noexcept { return limit_; }
  /// Below the limit; with a jobserver fewer may be had.
  unsigned free_count() const noexcept { return limit_ - used_; }
  /// Takes up to `most` threads of those that are free now; returns how many.
  unsigned take(unsigned most);
  void give_back(unsigned count);
  /// Readable when make may have a token for us; -1 without a jobserver, or when the limit is reached.
  int wake_fd() const noexcept;
  /// What to tell the user of the jobserver; empty: nothing.
  const std::string& remark() const noexcept { return remark_; }

 private:
  void connect(const std::string& auth);

  unsigned limit_;
  unsigned used_ = 0;
  int read_fd_ = -1, write_fd_ = -1;
  std::vector<char> tokens_;  ///< make's, to be given back as they were
  std::string remark_;
};

}  // namespace sqmap::apps
