// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "sqmap/bake/mesh.hpp"

#include "edge_table.hpp"

namespace sqmap::bake {

/// The steps of check_and_repair, in the order they are taken. Each changes the mesh in place and returns how
/// many vertices, faces or holes it dealt with. All are deterministic and close to linear in the size of the
/// mesh.

/// What distances of the mesh are measured by.
struct MeshScale {
  Vec3d centre_m;       ///< of the bounding box
  double diagonal_m{};  ///< of the bounding box; 0 for a mesh that is a point
  /// A triangle no higher than this counts as without area.
  double zero_height_m{};
};
MeshScale measure_scale(const Mesh& mesh);

/// True when the triangle's height over its longest side is at most zero_height_m.
bool has_no_area(const Mesh& mesh, const Face& face, const MeshScale& scale);

/// Replaces each vertex by the first one, in file order, that lies within the tolerance and was kept.
std::uint32_t weld(Mesh& mesh, double tolerance_m);

/// Of faces with the same three vertices keeps the first. A wall where two closed surfaces touch, that is
/// faces in opposite pairs whose rim carries both surfaces, goes altogether, so that the two become one
/// solid.
std::uint32_t drop_duplicates(Mesh& mesh);

/// Faces joined across edges of exactly two faces get the same number; numbers ascend with the first face.
std::vector<std::uint32_t> label_components(const Mesh& mesh);

/// Makes each component consistent by turning its minority, then turns whole components so that they face
/// outwards; inside another component, inwards too, where that leaves no point with a negative winding
/// number.
std::uint32_t orient(Mesh& mesh, const MeshScale& scale);

/// Closes boundary loops of at most max_hole_edges edges by a triangulation of least area. A loop whose fill
/// is not small beside its component is the rim of a sheet and stays open.
std::uint32_t fill_holes(Mesh& mesh, const MeshScale& scale, std::uint32_t max_hole_edges);

/// Removes faces without area: by turning the edge between such a face and its neighbour over its longest
/// side, so that a closed mesh stays closed, or by deletion where there is no such neighbour. Counts the
/// faces that came from the file.
std::uint32_t remove_zero_area(Mesh& mesh, const MeshScale& scale);

/// Keeps the faces for which keep[face]; returns the number dropped.
std::uint32_t keep_faces(Mesh& mesh, const std::vector<bool>& keep);

}  // namespace sqmap::bake
