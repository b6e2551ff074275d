// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <memory>

#include "peer.hpp"

namespace sqmap::bench {

/// Convex hulls by Bullet's HACD, at least this many. Deterministic, slow to make.
std::unique_ptr<Peer> make_hulls(const Model& model, std::size_t least_hulls);

}  // namespace sqmap::bench
