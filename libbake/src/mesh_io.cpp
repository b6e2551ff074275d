// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <fstream>
#include <limits>
#include <system_error>
#include <utility>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include "sqmap/bake/mesh.hpp"

#include "polygon_mesh.hpp"
#include "scene_reader.hpp"

namespace sqmap::bake {
namespace {

namespace fs = std::filesystem;

/// Squares and sixth powers of coordinates up to here stay far from the range of double.
constexpr double kLargestCoordinate_m = 1e15;

constexpr std::array<std::string_view, 9> kExtensions{".off", ".obj", ".ply", ".stl", ".gltf",
                                                      ".glb", ".dae", ".fbx", ".3mf"};

std::string quoted(const fs::path& path) { return "\"" + path.string() + "\""; }

std::string lower_extension(const fs::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

Outcome check(const ReadOptions& options) {
  if (!(options.metres_per_unit > 0) || !std::isfinite(options.metres_per_unit))
    return Error{
        Status::kBadOption,
        "read.metres_per_unit = " + std::to_string(options.metres_per_unit) + ", must be finite and > 0",
        "give the length of one unit of the file in metres, e.g. 0.001 for millimetres"};
  if (options.up != UpAxis::kX && options.up != UpAxis::kY && options.up != UpAxis::kZ)
    return Error{Status::kBadOption,
                 "read.up = " + std::to_string(static_cast<int>(options.up)) + ", must be x, y or z", ""};
  return Done{};
}

/// Everything that can be said about a path before its bytes are read; the size of the file [bytes].
Result<std::uint64_t> check_file(const fs::path& path, std::uint64_t max_bytes) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (status.type() == fs::file_type::not_found)
    return Error{Status::kFileMissing, quoted(path) + " does not exist", "check the spelling and the folder"};
  if (status.type() == fs::file_type::none)
    return Error{Status::kFileUnreadable, quoted(path) + ": " + error.message(),
                 "check the permissions of its folders"};
  if (status.type() == fs::file_type::directory)
    return Error{Status::kFileUnreadable, quoted(path) + " is a folder, need a mesh file",
                 "name a file in it"};
  if (status.type() != fs::file_type::regular)
    return Error{Status::kFileUnreadable, quoted(path) + " is a pipe, socket or device, need a regular file",
                 "write the mesh to a file first"};

  const std::string extension = lower_extension(path);
  if (std::ranges::find(kExtensions, extension) == kExtensions.end()) {
    std::string known;
    for (const std::string_view each : kExtensions)
      known += (known.empty() ? "" : " ") + std::string(each.substr(1));
    return Error{Status::kUnknownFormat,
                 quoted(path) +
                     (extension.empty() ? " has no extension" : " has the extension " + extension) +
                     ", need one of " + known,
                 "convert the mesh to one of these formats"};
  }
  const std::uint64_t bytes = fs::file_size(path, error);
  if (error) return Error{Status::kFileUnreadable, quoted(path) + ": " + error.message(), ""};
  if (bytes == 0)
    return Error{Status::kInvalidMesh, quoted(path) + " is empty (0 bytes)", "export the mesh again"};
  if (bytes > max_bytes)
    return Error{
        Status::kFileUnreadable,
        quoted(path) + " has " + std::to_string(bytes) + " bytes, the limit is " + std::to_string(max_bytes),
        "simplify the mesh, or raise read.max_file_bytes"};
  return bytes;
}

Result<std::string> read_bytes(const fs::path& path, std::uint64_t size) {
  std::ifstream file(path, std::ios::binary);
  if (!file)
    return Error{Status::kFileUnreadable, quoted(path) + " cannot be opened for reading",
                 "check its permissions"};
  std::string bytes(size, '\0');
  if (!file.read(bytes.data(), static_cast<std::streamsize>(size)))
    return Error{Status::kFileUnreadable,
                 quoted(path) + ": reading stopped after " + std::to_string(file.gcount()) + " of " +
                     std::to_string(size) + " bytes",
                 "check the disk, and that nothing writes to the file"};
  return bytes;
}

std::string hash(std::string_view bytes) {
  const XXH128_hash_t value = XXH3_128bits(bytes.data(), bytes.size());
  std::string digits;
  for (const std::uint64_t half : {value.high64, value.low64})
    for (int shift = 60; shift >= 0; shift -= 4) digits += "0123456789abcdef"[half >> shift & 15];
  return digits;
}

/// The rotation that turns the up axis to +z: a cyclic exchange for x, a quarter turn about x for y.
Vec3d turned_up(const Vec3d& p, UpAxis up) {
  switch (up) {
    case UpAxis::kX:
      return {p.y, p.z, p.x};
    case UpAxis::kY:
      return {p.x, -p.z, p.y};
    case UpAxis::kZ:
      break;
  }
  return p;
}

Outcome to_metres(std::vector<Vec3d>& vertices, const ReadOptions& options, const fs::path& path) {
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    const Vec3d p_m = options.metres_per_unit * turned_up(vertices[v], options.up);
    for (int axis = 0; axis < 3; ++axis) {
      if (std::abs(p_m[axis]) <= kLargestCoordinate_m) continue;  // NaN: falls through
      const bool is_finite = std::isfinite(turned_up(vertices[v], options.up)[axis]);
      return Error{Status::kInvalidMesh,
                   "vertex " + std::to_string(v) + " (counted from 0) of " + quoted(path) +
                       " has a coordinate " +
                       (std::isnan(p_m[axis]) ? "that is not a number"
                        : is_finite           ? "beyond 1e15 m"
                                              : "that is infinite"),
                   is_finite ? "check the unit of the mesh" : "remove the vertex, or export the mesh again"};
    }
    vertices[v] = p_m;
  }
  return Done{};
}

Mesh triangulated(PolygonMesh polygons) {
  Mesh mesh;
  mesh.faces.reserve(polygons.corners.size() / 3);
  for (std::size_t p = 0; p < polygons.polygon_end.size(); ++p) {
    triangulate_polygon(polygons.vertices, polygons.polygon(p), mesh.faces);
    mesh.source_face.resize(mesh.faces.size(), static_cast<std::uint32_t>(p));
  }
  mesh.vertices_m = std::move(polygons.vertices);
  return mesh;
}

}  // namespace

Result<SourceMesh> read_mesh(const fs::path& path, const ReadOptions& options) {
  if (Outcome outcome = check(options); !outcome) return outcome.error();
  const Result<std::uint64_t> size = check_file(path, options.max_file_bytes);
  if (!size) return size.error();

  SourceMesh source;
  source.name = path.filename().string();
  source.metres_per_unit = options.metres_per_unit;
  source.up = options.up;
  const std::string extension = lower_extension(path);
  Result<PolygonMesh> polygons = PolygonMesh{};
  {
    const Result<std::string> bytes = read_bytes(path, size.value());
    if (!bytes) return bytes.error();
    source.hash = hash(bytes.value());
    if (extension == ".off") polygons = parse_off(bytes.value(), source.name);
    if (extension == ".ply") polygons = parse_ply(bytes.value(), source.name);
    // assimp 5.2 leaks memory on what is not even an archive.
    if (extension == ".3mf" && !bytes.value().starts_with("PK"))
      return Error{Status::kInvalidMesh, quoted(path) + " is not a ZIP archive, as every 3MF file is",
                   "export the mesh again"};
  }  // the bytes go before assimp reads the file once more
  if (extension != ".off" && extension != ".ply") polygons = read_scene(path);
  if (!polygons) return polygons.error();

  if (Outcome outcome = to_metres(polygons.value().vertices, options, path); !outcome) return outcome.error();
  if (polygons.value().polygon_end.size() >= kNewFace)
    return Error{Status::kInvalidMesh, quoted(path) + " has 2^32 - 1 faces or more", "simplify the mesh"};
  source.source_face_count = static_cast<std::uint32_t>(polygons.value().polygon_end.size());
  source.mesh = triangulated(std::move(polygons).value());
  if (source.mesh.faces.empty())
    return Error{
        Status::kInvalidMesh,
        quoted(path) + " has no faces (" + std::to_string(source.mesh.vertices_m.size()) + " vertices)",
        "export the mesh with its faces; point clouds are not baked"};
  return source;
}

}  // namespace sqmap::bake
