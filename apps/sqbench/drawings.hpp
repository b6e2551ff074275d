// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "suites.hpp"

namespace sqmap::bench {

/// Fig. 4 of the paper: two spheres, their superquadric, its map. Fig. 10: the parts of the models.
void draw_objects(const SuiteInput& input, Results& results);

}  // namespace sqmap::bench
