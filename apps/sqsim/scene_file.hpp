// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sqmap/asset/result.hpp"
#include "sqmap/runtime/scene.hpp"

namespace sqmap::apps {

/// An object of a scene file.
struct ObjectEntry {
  std::string name;
  std::string bundle;  ///< relative to --bundles or to the scene file
  runtime::Placement placement;
};

struct Keyframe {
  double time_s{};
  Pose pose;
};

/// A spring and a damper between the keyframed handle and the probe, a rigid body (virtual coupling, Colgate
/// et al. 1995).
struct Coupling {
  double mass_kg = 0.2, stiffness_n_per_m = 500, damping_n_s_per_m = 10;
  double inertia_kg_m2 = 2e-3, stiffness_nm_per_rad = 5, damping_nm_s_per_rad = 0.1;
};

struct ProbeEntry {
  std::string mesh;             ///< relative to --meshes or to the scene file; empty: points_m
  std::vector<Vec3f> points_m;  ///< the probe's own frame
  double scale = 1;             ///< metres a unit of the mesh
  int subdivisions = 0;         ///< times that each triangle is cut in four
  double zone_m = 0;            ///< edge of the cubes that make impact zones; 0: one zone
  std::vector<Keyframe> keyframes;
  std::optional<Coupling> coupling;
};

/// A square cloth that falls on the objects.
struct ClothEntry {
  Vec3d centre_m;
  double edge_m = 1;
  int nodes_along_edge = 41;
  double mass_kg = 0.3;
  double thickness_m = 5e-3;  ///< kept between nodes and objects
  double friction = 0.5;
};

/// What the contacts of a frame may cost: a time, turned into units of work by what frames before it took, or
/// the units themselves, which give the same run on every machine.
struct BudgetEntry {
  double microseconds = 0;  ///< 0: units
  std::uint64_t units = 0;
};

/// A scene as samples/scenes/scene.schema.json describes it.
struct SceneFile {
  double rate_hz = 1000, seconds = 10;
  std::vector<ObjectEntry> objects;
  runtime::SceneOptions options;
  std::optional<BudgetEntry> budget;  ///< of a probe
  std::optional<ProbeEntry> probe;
  std::optional<ClothEntry> cloth;
};

/// Errors: kFileMissing, kFileUnreadable; kUnknownFormat with the place in the file, and for a key that is
/// not known the nearest one that is.
Result<SceneFile> read_scene_file(const std::filesystem::path& path);

}  // namespace sqmap::apps
