// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace sqmap {

/// Version of the programs and libraries of this tree.
inline constexpr const char* kVersion = "0.1.0";

/// Bundle format. A minor step adds optional data, a major step changes meaning (history: formats/FORMAT.md).
inline constexpr std::uint32_t kFormatMajor = 1;
inline constexpr std::uint32_t kFormatMinor = 3;

}  // namespace sqmap
