// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "sqmap/asset/vec.hpp"

namespace sqmap::apps {

/// One frame of a run. World frame.
struct TraceRow {
  double time_s{};
  Pose pose;  ///< of the probe
  Vec3f force_n, torque_nm;
  std::uint32_t contacts{};
  int layer{};
  double microseconds{};
  double deepest_m{};          ///< of the contacts; 0 without
  std::uint64_t work_units{};  ///< spent of the budget; 0 without one
};

/// CSV with a header line.
std::string trace_csv(std::span<const TraceRow> rows);

/// Force, contacts and frame time over time, as an SVG file.
std::string trace_svg(std::span<const TraceRow> rows, const std::string& title);

/// Steps between two frames in contact in which the force changes by more than a tenth of the larger one.
struct Jumps {
  std::size_t steps{}, jumps{};
  std::size_t
      firm_jumps{};  ///< of them, those at more than kFirm_n: not the first and last frames of a touch
  double most_n{};   ///< largest change of any step in contact
};
/// A force that grows with depth from nothing changes by more than a tenth for a while, whatever is done;
/// from here on it need not.
inline constexpr double kFirm_n = 1;
Jumps force_jumps(std::span<const TraceRow> rows);

}  // namespace sqmap::apps
