// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "sqmap/asset/asset.hpp"
#include "sqmap/asset/result.hpp"
#include "sqmap/asset/vec.hpp"

namespace sqmap::bake {

/// Indexed triangle mesh, object frame, metres. Faces are counter-clockwise seen from outside once repaired.
struct Mesh {
  std::vector<Vec3d> vertices_m;
  std::vector<std::array<std::uint32_t, 3>> faces;
  /// For each face, the face of the input file it came from; shape [faces]. kNewFace: made by repair.
  std::vector<std::uint32_t> source_face;
};
inline constexpr std::uint32_t kNewFace = 0xFFFFFFFF;

/// The axis of the input that points up; it is turned to +z of the object frame.
enum class UpAxis { kX, kY, kZ };

struct ReadOptions {
  double metres_per_unit = 1;                             ///< length of one unit of the input [m], > 0
  UpAxis up = UpAxis::kZ;                                 ///< kZ: coordinates are taken as they are
  std::uint64_t max_file_bytes = std::uint64_t{4} << 30;  ///< larger files are refused unread
};

/// A mesh as the file gave it, with what the bundle records of its origin.
struct SourceMesh {
  Mesh mesh;                          ///< triangulated; source_face numbers the polygons of the file
  std::uint32_t source_face_count{};  ///< polygons in the file
  std::string name;                   ///< file name without folders
  std::string hash;                   ///< XXH3-128 of the file's bytes, 32 hex digits
  double metres_per_unit{1};
  UpAxis up{UpAxis::kZ};
};

/// Reads the triangles of a mesh file: OFF and PLY in double and with the polygons numbered as in the file;
/// OBJ, STL, glTF/GLB, DAE, FBX and 3MF through assimp, which keeps coordinates in float. Node transforms of
/// a scene are applied; all its meshes are joined, and their polygons numbered mesh by mesh; lines and points
/// are skipped. Files a scene refers to are opened only in its folder and below. Errors: kFileMissing,
/// kFileUnreadable (a directory, a pipe, no permission), kUnknownFormat, kInvalidMesh (damaged, no faces, a
/// coordinate that is NaN, infinite or beyond 1e15 m).
Result<SourceMesh> read_mesh(const std::filesystem::path& path, const ReadOptions& options = {});

/// What check_and_repair may change.
enum class Repair {
  kNone,  ///< nothing but what cannot be baked at all: faces of zero area and faces that repeat a vertex
  kSafe,  ///< also weld equal vertices, drop duplicate faces, orient components consistently and outwards
  kAll,   ///< also fill small holes
};

struct RepairOptions {
  Repair policy = Repair::kAll;
  double weld_tolerance = 1e-9;        ///< vertices closer than this share of the diagonal become one
  std::uint32_t max_hole_edges = 128;  ///< longer boundary loops stay open
};

/// A mesh ready to bake, with the record of what was found and done.
struct PreparedMesh {
  Mesh mesh;
  MeshRecord record;
  std::vector<std::uint32_t> component;  ///< connected component of each face; shape [faces]
};

/// Checks and repairs. Deterministic. Errors: kInvalidMesh when no face with area is left, or the mesh spans
/// a volume of zero thickness that no superquadric can bound.
Result<PreparedMesh> check_and_repair(const SourceMesh& source, const RepairOptions& options = {});

}  // namespace sqmap::bake
