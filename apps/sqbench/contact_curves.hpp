// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "suites.hpp"

namespace sqmap::bench {

/// Fig. 14a: what a frame of a slide costs, pose by pose. Fig. 14b: the same for ever more contacts.
void run_contact_curves(const SuiteInput& input, const Model& model, Results& results);

}  // namespace sqmap::bench
