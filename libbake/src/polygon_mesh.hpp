// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "sqmap/asset/result.hpp"
#include "sqmap/asset/vec.hpp"

namespace sqmap::bake {

/// What a file holds, before triangulation: coordinates in its own unit and axes, faces of any number of
/// corners.
struct PolygonMesh {
  std::vector<Vec3d> vertices;
  std::vector<std::uint32_t> corners;    ///< vertices of all polygons, one polygon after the other
  std::vector<std::size_t> polygon_end;  ///< one past the last corner of each polygon; shape [polygons]

  std::span<const std::uint32_t> polygon(std::size_t index) const {
    const std::size_t begin = index == 0 ? 0 : polygon_end[index - 1];
    return std::span(corners).subspan(begin, polygon_end[index] - begin);
  }
};

/// Reads the text of an OFF file (OFF and the prefixes ST, C, N), polygons in their order. Indices are in
/// range; coordinates may still be NaN. Every face record is a polygon here, one of fewer than three corners
/// too, so that polygons are numbered as in the file. `name` is for the error: kInvalidMesh.
Result<PolygonMesh> parse_off(std::string_view text, std::string_view name);

/// Reads a PLY file, text or binary of either byte order, with the same promises. Only the elements vertex
/// (x, y, z) and face (vertex_indices or vertex_index) count.
Result<PolygonMesh> parse_ply(std::string_view bytes, std::string_view name);

/// Appends the n - 2 triangles of a simple polygon, by ear clipping in its mean plane; concave ones are
/// right. Nothing for fewer than three corners. A polygon that cuts itself gets some n - 2 triangles.
void triangulate_polygon(const std::vector<Vec3d>& vertices, std::span<const std::uint32_t> polygon,
                         std::vector<std::array<std::uint32_t, 3>>& triangles);

}  // namespace sqmap::bake
