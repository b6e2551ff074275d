// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>

#include "peer.hpp"

namespace sqmap::bench {

enum class NanovdbCode { kFloat, k16Bit, k8Bit };
/// A NanoVDB level set over the lattice of the field at `resolution`, as wide as the band.
std::unique_ptr<Peer> make_nanovdb(const Model& model, NanovdbCode code, unsigned resolution);

}  // namespace sqmap::bench
