// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <string_view>

namespace sqmap::bake {

/// How a long bake talks to its caller. Both functions may be empty; both are called from one thread at a
/// time.
struct Progress {
  std::function<void(std::string_view stage, double fraction)> report;  ///< fraction of the stage in [0, 1]
  std::function<bool()> cancelled;  ///< true: stop soon; the bake then returns kCancelled

  void at(std::string_view stage, double fraction) const {
    if (report) report(stage, fraction);
  }
  bool stop() const { return cancelled && cancelled(); }
};

}  // namespace sqmap::bake
