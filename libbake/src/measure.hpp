// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "sqmap/asset/asset.hpp"
#include "sqmap/bake/mesh.hpp"
#include "sqmap/bake/oracle.hpp"
#include "sqmap/runtime/object.hpp"

#include "map_builder.hpp"

namespace sqmap::bake {

/// Points near the surface with the truth about them.
struct ShellPoints {
  std::vector<Vec3f> points_m;
  std::vector<double> signed_distance_m;  ///< exact, negative inside
  std::vector<std::uint32_t> face;        ///< mesh face each point was offset from
};

/// `count` points at most half_width_m from the surface: uniform on the surface by area, then offset along
/// the face's normal by a uniform share of the width; points that are nearer to another side keep their true
/// distance.
ShellPoints sample_shell(const MeshQueries& queries, double half_width_m, std::uint32_t count,
                         std::uint64_t seed);

/// Errors of every level and layer of the asset, by querying the runtime (FORMAT.md section 6).
std::vector<ErrorRow> measure(const Asset& asset, const runtime::Object& object, const MeshQueries& queries,
                              std::uint32_t sample_count, std::uint64_t seed);

/// What layer 3 tells wrong of the shell points, as ErrorRow defines it.
struct ShellError {
  double depth_mean_m{};
  double misclassified{};  ///< share of the points
};
ShellError shell_error(const runtime::Object& object, const ShellPoints& shell);

/// Mean |reported - true| signed distance over the shell points, by the part that owns each point's face [m].
/// An unknown distance, or a wrong side, counts as `worst_m`. Shape [part_count]; `share` gets the points of
/// each part.
std::vector<double> error_by_part(const runtime::Object& object, const ShellPoints& shell,
                                  const std::vector<std::uint32_t>& part_of_face, std::uint32_t part_count,
                                  double worst_m, std::vector<std::uint32_t>& share);

}  // namespace sqmap::bake
