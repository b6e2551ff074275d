// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>

#include "peer.hpp"

namespace sqmap::bench {

/// An OpenVDB level set over the lattice of the field at `resolution`, as wide as the band.
std::unique_ptr<Peer> make_openvdb(const Model& model, unsigned resolution);

}  // namespace sqmap::bench
