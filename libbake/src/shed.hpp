// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "refine.hpp"

namespace sqmap::bake {

/// Lets each piece go of what the superquadric of another holds anyway (the paper's pruning), and fits what
/// is left: at a joint the limb then ends where the trunk's superquadric begins. Sets Piece::held of all, and
/// part and fit, by a quick fit, of those that become smaller. No map is drawn; segments stay as they were.
///
/// Whatever a piece lets go of, a chain of triangles closed by caps, is added to what the other one holds,
/// and lies in its superquadric. So every triangle of the mesh and every point inside it stay bounded
/// (solid.hpp).
void shed_covered(SolidSet& set, std::vector<Piece>& pieces, const FitOptions& options);

}  // namespace sqmap::bake
