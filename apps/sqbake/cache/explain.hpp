// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "store.hpp"

namespace sqmap::apps {

/// What differs between the last bake of an output and what is asked for now, one line each: "mesh hand.off
/// changed", "option fit.quick: true, was false". Empty when nothing does.
std::vector<std::string> differences(const OutputRecord& last, const OutputRecord& now);

}  // namespace sqmap::apps
