// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "results.hpp"
#include "suites.hpp"

namespace sqmap::bench {

/// Frames of the paper's second application: a sheet that changes its shape in every frame sinks onto the
/// object and drapes over it. Each method takes the new places of its points in, and answers.
void run_costume(const SuiteInput& input, const Model& model, Results& results);

}  // namespace sqmap::bench
