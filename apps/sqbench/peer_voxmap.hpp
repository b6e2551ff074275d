// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>

#include "peer.hpp"

namespace sqmap::bench {

/// `resolution`: voxels along the longest axis. Its contacts are points of the probe, not pairs of triangles.
std::unique_ptr<ContactPeer> make_voxmap(const Model& model, const bake::Mesh& probe, unsigned resolution);
/// How far outside the object a point may lie that it tells to touch: the diagonal of a voxel.
double voxel_reach_m(const Model& model, unsigned resolution);

}  // namespace sqmap::bench
