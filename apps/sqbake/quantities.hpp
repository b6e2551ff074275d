// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string_view>

#include "sqmap/asset/result.hpp"

namespace sqmap::apps {

/// Metres in one unit: "m", "mm", "cm", "um", "in", "ft", or a positive number of metres.
Result<double> parse_unit(std::string_view text);

/// An error target: a share of R_max or a length.
struct ErrorTarget {
  double percent{};   ///< of R_max; 0 when a length was given
  double length_m{};  ///< 0 when a share was given
};
/// "0.1%" or "0.1" (percent of R_max), or "0.5mm" (a length with a unit). Must be > 0.
Result<ErrorTarget> parse_error_target(std::string_view text);

/// "131072", "128K", "4M" or "2G" (powers of 1024). Must be > 0.
Result<std::uint64_t> parse_bytes(std::string_view text);

/// Seconds: "90", "90s", "5m", "2h"; 0 for "none". Otherwise > 0.
Result<double> parse_duration(std::string_view text);

}  // namespace sqmap::apps
