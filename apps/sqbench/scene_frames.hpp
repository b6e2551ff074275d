// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "suites.hpp"

namespace sqmap::bench {

inline constexpr std::size_t kSceneObjects = 6;

/// Frames of a scene as in the paper's Fig. 9a: the first six objects, or as many as there are, side by side,
/// all made equally large, and the probe touching each of them in turn. Every method
/// asks all of them. Adds nothing where there is but one.
void run_scene(const SuiteInput& input, Results& results);

}  // namespace sqmap::bench
