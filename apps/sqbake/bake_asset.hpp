// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "sqmap/bake/progress.hpp"

#include "records.hpp"
#include "settings.hpp"

namespace sqmap::apps {

/// One mesh to bake, and how. What it gives does not depend on the number of threads.
struct BakeJob {
  std::filesystem::path input;
  SettingTexts settings;
  unsigned threads = 1;
  bool verify_determinism = false;  ///< bake twice, with two numbers of threads, and compare
  bool is_fallback = false;         ///< the plain bake that stands in for the one asked for
};

/// The record, and the bundle when there is one. Nothing is written.
struct BakeProduct {
  BakeRecord record;
  std::vector<std::uint8_t> bundle;
};

/// Reads, bakes and encodes. Throws nothing: an exception becomes a verdict.
BakeProduct bake_asset(const BakeJob& job, const bake::Progress& progress);

}  // namespace sqmap::apps
