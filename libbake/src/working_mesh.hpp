// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "surface.hpp"

namespace sqmap::bake {

/// A surface of about even edge lengths in place of one component, so that the decomposition neither slows
/// down on fine meshes nor depends on how the input was tessellated; and the way back.
struct WorkingMesh {
  Triangles triangles;
  std::vector<std::vector<std::uint32_t>> faces_of_input;  ///< working faces each input face became part of
};

/// First moves vertices that carry no shape, as where faces were cut into coplanar ones, into a neighbour,
/// so that how a surface was cut matters little. Then splits edges longer than `longest_edge`, then collapses
/// edges shorter than `shortest_edge` to their midpoints where that neither changes the topology nor flips a
/// face. Works on any triangles; non-manifold edges are left alone.
WorkingMesh make_working_mesh(const Triangles& input, double shortest_edge, double longest_edge);

}  // namespace sqmap::bake
