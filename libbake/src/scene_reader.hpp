// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "polygon_mesh.hpp"

namespace sqmap::bake {

/// The polygons of a scene file as assimp reads it (float coordinates): all meshes, once for each node that
/// shows them, in the order of a depth-first walk, the node transforms applied in double. Meshes keep the
/// order of their polygons; points and lines are left out. Files the scene refers to are opened only in its
/// folder and below. Errors: kInvalidMesh.
Result<PolygonMesh> read_scene(const std::filesystem::path& path);

}  // namespace sqmap::bake
