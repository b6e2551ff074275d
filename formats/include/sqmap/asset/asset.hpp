// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sqmap/asset/distance_map.hpp"
#include "sqmap/asset/superquadric.hpp"
#include "sqmap/asset/surface_bounds.hpp"
#include "sqmap/asset/vec.hpp"

namespace sqmap {

/// Why a part exists: the last cut that separated it. Stored; do not renumber, append only.
enum class CutReason : std::uint8_t {
  kWhole = 0,             ///< never cut
  kComponent = 1,         ///< a connected component of its own
  kBoundaryStrength = 2,  ///< boundary strength of consecutive locales (paper 3.1)
  kHyperbolic = 3,        ///< hyperbolic Gaussian curvature of a locale (paper 3.2)
  kErrorTarget = 4,       ///< split because it exceeded the error target
};

/// One superquadric of an asset and the distance map on its surface.
struct Part {
  Superquadric shape;
  Pose object_from_part;    ///< p_object = R p_part + t
  BoundingSphere sphere;    ///< encloses the superquadric, object frame
  std::uint32_t segment{};  ///< natural part (salience segment) that this part refines
  CutReason reason{CutReason::kWhole};
  std::uint32_t vertex_count{};  ///< N_m of the paper's layer rule: mesh vertices of this part
  std::uint32_t face_count{};    ///< mesh faces of this part, after repair
  double volume_m3{};            ///< of what the superquadric bounds, its cuts closed [m^3]
  DistanceMap map;
  SurfaceBounds bounds;  ///< none unless the bake was asked for them
  friend bool operator==(const Part&, const Part&) = default;
};

/// Errors of one level and layer against the exact mesh, as measured by the baker; lengths in percent of
/// R_max. A value that could not be measured (no samples) is NaN.
struct ErrorRow {
  std::uint32_t level{};
  std::uint32_t layer{};  ///< 1, 2 or 3
  double eq35_percent{};  ///< mean |D_hat - D| / R_max over shell points inside a superquadric
  /// Mean |signed distance error| in the +-3 % shell, where a distance is told; inner points without one
  /// count with their whole depth.
  double depth_mean_percent{};
  double depth_p95_percent{};         ///< 95th percentile of the same
  double misclassified_3_percent{};   ///< share of wrong inside/outside answers, +-3 % shell
  double misclassified_05_percent{};  ///< the same in the +-0.5 % shell
  std::uint32_t samples_3{};          ///< points of the +-3 % shell
  std::uint32_t samples_05{};         ///< points of the +-0.5 % shell
  std::uint32_t samples_depth{};      ///< of samples_3, those that depth_mean is over
};

/// Where an asset comes from.
struct Provenance {
  std::string generator;          ///< program, e.g. "sqbake"
  std::string generator_version;  ///< e.g. "0.1.0"
  std::string source_name;        ///< file name of the input, without its folders
  std::string source_hash;        ///< XXH3-128 of the input file, 32 hex digits
  std::string options_json;       ///< effective options of the bake, a JSON object
  double metres_per_unit{1};      ///< what one unit of the input became
  std::string up_axis{"z"};       ///< input axis that was turned to +z: "x", "y" or "z" (no turn)
};

/// What the baker found and did to the input mesh, by count.
struct MeshRecord {
  std::uint32_t source_vertices{}, source_faces{};  ///< as read
  std::uint32_t vertices{}, faces{};                ///< as baked
  std::uint32_t components{};
  std::uint32_t welded_vertices{}, degenerate_faces{}, duplicate_faces{}, flipped_faces{};
  std::uint32_t filled_holes{}, boundary_edges{}, non_manifold_edges{};
  bool is_closed{};    ///< every edge has two faces after repair
  double volume_m3{};  ///< signed volume after repair [m^3]
  friend bool operator==(const MeshRecord&, const MeshRecord&) = default;
};

/// A superquadric map: what sqbake makes, a bundle stores and the runtime loads. Immutable once built.
/// Object frame, metres, right-handed. The meaning of every number is in formats/FORMAT.md.
struct Asset {
  double r_max_m{};       ///< R_max: largest distance between two vertices of the mesh [m]
  BoundingSphere sphere;  ///< encloses every part's superquadric, object frame
  std::vector<Part> parts;
  /// Part index of each face of the *input* file, in its order; kNoPart for faces that repair dropped.
  std::vector<std::uint16_t> face_labels;
  MeshRecord mesh;
  std::vector<ErrorRow> errors;
  Provenance provenance;
};

inline constexpr std::uint16_t kNoPart = 0xFFFF;
inline constexpr std::uint32_t kMaxParts = 4096;  ///< an asset has at most this many parts

}  // namespace sqmap
