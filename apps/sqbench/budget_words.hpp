// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "results.hpp"

namespace sqmap::bench {

/// For each budget: where a rival that fits in it is at once closer to the surface and faster than sqmap.
std::vector<std::string> budget_words(const Results& results);

}  // namespace sqmap::bench
