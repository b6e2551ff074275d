// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include "frame_clock.hpp"

namespace sqmap::apps {

/// Value below which the given share of the samples lies (nearest rank); 0 without samples.
double percentile(std::span<const double> samples, double share);

/// The histogram of frame times as --help shows it: one line a factor of two, then median, 99.9 % and worst.
std::string latency_text(std::span<const double> microseconds);
std::string percentiles_text(std::span<const double> microseconds);

/// Missed deadlines, and how many of them are the system's.
std::string missed_text(const FrameClock& clock);

}  // namespace sqmap::apps
