// SPDX-License-Identifier: Apache-2.0
//
// One program of hostile input: what libFuzzer runs for a time, and what the ordinary tests replay. A target
// returns where the input was refused or served, and ends the program where a promise is broken.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace sqmap::fuzz {

using Bytes = std::vector<std::uint8_t>;

/// Valid inputs, made by code, from which mutations start. Each target defines its own.
std::vector<Bytes> seeds();

/// Ends the program, naming the promise that is broken.
inline void require(bool holds, const char* promise) {
  if (holds) return;
  std::fprintf(stderr, "broken: %s\n", promise);
  std::abort();
}

}  // namespace sqmap::fuzz
