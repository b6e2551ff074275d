// SPDX-License-Identifier: Apache-2.0
// The one place where sqinfo and sqsim use assimp: they must not link the baker, whose reader is GPL.
#include "source_mesh.hpp"

#include <exception>
#include <utility>
#include <vector>

#include <assimp/Importer.hpp>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>
#define XXH_INLINE_ALL
#include <xxhash.h>

#include "files.hpp"

namespace sqmap::apps {
namespace {

constexpr std::uint64_t kMaxSourceBytes = std::uint64_t{4} << 30;

/// The rotation sqbake applied (formats/FORMAT.md, up_axis).
Vec3d turned_up(const Vec3d& p, const std::string& up_axis) {
  if (up_axis == "x") return {p.y, p.z, p.x};
  if (up_axis == "y") return {p.x, -p.z, p.y};
  return p;
}

void append(const aiMesh& mesh, const Provenance& provenance, TriangleSurface& surface) {
  const auto first = static_cast<std::uint32_t>(surface.points_m.size());
  for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
    const aiVector3D& p = mesh.mVertices[v];
    surface.points_m.push_back(
        cast<float>(provenance.metres_per_unit * turned_up({p.x, p.y, p.z}, provenance.up_axis)));
  }
  for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
    const aiFace& face = mesh.mFaces[f];
    if (face.mNumIndices == 3)
      surface.triangles.push_back(
          {first + face.mIndices[0], first + face.mIndices[1], first + face.mIndices[2]});
  }
}

}  // namespace

Result<SourceSurface> read_source(const std::filesystem::path& path, const Provenance& provenance) {
  const Result<std::vector<std::uint8_t>> bytes = read_file(path, kMaxSourceBytes);
  if (!bytes) return bytes.error();
  SourceSurface source;
  const XXH128_hash_t hash = XXH3_128bits(bytes.value().data(), bytes.value().size());
  source.hash = fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
  try {
    Assimp::Importer importer;
    const aiScene* scene =
        importer.ReadFile(path.string(), aiProcess_Triangulate | aiProcess_PreTransformVertices |
                                             aiProcess_JoinIdenticalVertices);
    if (scene == nullptr)
      return Error{Status::kInvalidMesh, fmt::format("{}: {}", path.string(), importer.GetErrorString()), ""};
    for (unsigned m = 0; m < scene->mNumMeshes; ++m) append(*scene->mMeshes[m], provenance, source.surface);
  } catch (const std::exception& problem) {
    return Error{Status::kInvalidMesh, fmt::format("{}: {}", path.string(), problem.what()), ""};
  }
  if (source.surface.triangles.empty())
    return Error{Status::kInvalidMesh, fmt::format("{}: no triangles", path.string()), ""};
  return source;
}

}  // namespace sqmap::apps
