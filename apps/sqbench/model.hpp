// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "sqmap/asset/asset.hpp"
#include "sqmap/asset/result.hpp"
#include "sqmap/bake/mesh.hpp"
#include "sqmap/bake/oracle.hpp"

namespace sqmap::bench {

struct Field;

struct Hulls {
  std::vector<bake::Mesh> meshes;
  std::vector<double> seconds;  ///< they took to compute, each time on the wall clock
};

/// One object of the comparison: its mesh, its bundle, and the truth.
struct Model {
  std::string name;  ///< of the mesh file, without extension
  bake::Mesh mesh;
  Asset asset;
  std::uintmax_t bundle_bytes{};
  std::unique_ptr<bake::Oracle> oracle;
  Vec3d low_m, high_m;  ///< box of the mesh
  double r_max_m() const noexcept { return asset.r_max_m; }

  /// The exact field at this resolution, computed once and shared by the grids of all codes.
  const Field& field(unsigned resolution) const;
  /// How long that takes; computed again until it is timed often enough.
  const std::vector<double>& field_seconds(unsigned resolution) const;

  /// The same object, baked to the same limits with FitOptions::taper, when first asked for.
  const Model& tapered() const;

  /// Sets low_m and high_m from the mesh.
  void find_box();

  mutable std::map<unsigned, std::shared_ptr<Field>> fields;
  /// Convex hulls, by the least number of them: kept, as they take up to minutes.
  mutable std::map<std::size_t, Hulls> hulls;
  mutable std::shared_ptr<const Model> with_tapers;
  mutable double with_tapers_s{};  ///< its bake took
  /// Spent so far on fields, hulls and the bake of tapered().
  double shared_s() const;
};

/// Reads `mesh` and `bundles`/STEM.h5. Errors: those of the two readers, and kBadOption where the bundle was
/// baked from another file.
Result<Model> read_model(const std::filesystem::path& mesh, const std::filesystem::path& bundles);

/// The mesh of the moving body: each triangle cut into four at the middles of its edges, R_max = 1, centred.
Result<bake::Mesh> read_probe(const std::filesystem::path& mesh);

}  // namespace sqmap::bench
