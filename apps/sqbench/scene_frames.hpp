// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "suites.hpp"

namespace sqmap::bench {

inline constexpr std::size_t kSceneObjects = 6;

/// Frames of a scene: the first six objects side by side, all made equally large, and the probe touching each
/// of them in turn. The runtime asks all six; the grid, the reference, only the one that is touched. Adds
/// nothing where there are fewer than six.
void run_scene(const SuiteInput& input, Results& results);

}  // namespace sqmap::bench
