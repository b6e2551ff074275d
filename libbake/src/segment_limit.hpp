// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

#include "sqmap/bake/decompose.hpp"

namespace sqmap::bake {

/// Joins segments until at most `most` (>= 1) are left: the smallest goes to the one whose box it makes least
/// longer, connected or not. A mesh of hundreds of components then keeps to the number of parts that was
/// asked for. What is joined takes the number and the reason of its largest segment; numbers close up.
void join_to_limit(const Mesh& mesh, std::uint32_t most, Decomposition& segments);

}  // namespace sqmap::bake
