// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sqmap/asset/vec.hpp"

namespace sqmap::bake {

/// Triangles without connectivity, as the decomposition passes them around.
struct Triangles {
  std::vector<Vec3d> points;
  std::vector<std::array<std::uint32_t, 3>> faces;
};

/// Two faces that share an edge: an edge of the dual graph.
struct Link {
  std::array<std::uint32_t, 2> face;
  std::array<std::uint32_t, 2> vertex;  ///< the shared edge
  double length;
  double bend_rad;  ///< angle between the normals, > 0 convex, < 0 concave; 0 where the two orientations
                    ///< disagree
};

/// Lists of varying length in one array: row i is values[begin[i] .. begin[i + 1]).
struct Rows {
  std::vector<std::uint32_t> begin, values;
  std::span<const std::uint32_t> operator[](std::size_t row) const noexcept {
    return {values.data() + begin[row], begin[row + 1] - begin[row]};
  }
};

/// Groups `count` (row, value) pairs by row; within a row the order is kept.
Rows group_rows(std::size_t row_count, std::span<const std::array<std::uint32_t, 2>> pairs);

/// One connected component with its dual graph, moved to its centroid and scaled to unit area. Every length
/// and threshold of the decomposition is then relative to the square root of the component's area.
///
/// Faces of zero area may occur. An edge of k > 2 faces links them in a chain, so that the component stays
/// connected.
struct Surface {
  std::vector<Vec3d> points;
  std::vector<std::array<std::uint32_t, 3>> faces;
  std::vector<double> area;     ///< sums to 1; shape [faces]
  std::vector<Vec3d> centroid;  ///< shape [faces]
  std::vector<Vec3d> normal;    ///< unit, or zero for a face of zero area; shape [faces]
  std::vector<Link> links;
  Rows links_of_face;
  Rows faces_of_vertex;
  std::vector<Vec3d> vertex_normal;       ///< area-weighted; shape [points]
  std::vector<double> vertex_area;        ///< a third of the faces around it; shape [points]
  std::vector<std::uint8_t> on_boundary;  ///< of an edge without exactly two faces; shape [points]
  bool is_closed{};                       ///< every edge has exactly two faces
  double scale_m{};                       ///< sqrt(area) [m] before scaling

  std::uint32_t other_face(const Link& link, std::uint32_t face) const noexcept {
    return link.face[0] == face ? link.face[1] : link.face[0];
  }
};

/// Builds the dual graph. The triangles must be connected over edges, with positive total area. Orientation:
/// a closed component whose signed volume is negative is turned, so that convex and concave keep their
/// meaning.
Surface make_surface(const Triangles& triangles);

/// A vertex index for the used points only, in order of first use by the faces of one component; `faces`
/// selects.
Triangles extract(const std::vector<Vec3d>& points,
                  const std::vector<std::array<std::uint32_t, 3>>& all_faces,
                  std::span<const std::uint32_t> faces);

}  // namespace sqmap::bake
