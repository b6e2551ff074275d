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
  double deepest_m{};  ///< of the contacts; 0 without
};

/// CSV with a header line.
std::string trace_csv(std::span<const TraceRow> rows);

/// Force, contacts and frame time over time, as an SVG file.
std::string trace_svg(std::span<const TraceRow> rows, const std::string& title);

/// Steps between two frames in contact in which the force changes by more than a tenth of the larger one.
struct Jumps {
  std::size_t steps{}, jumps{};
};
Jumps force_jumps(std::span<const TraceRow> rows);

}  // namespace sqmap::apps
