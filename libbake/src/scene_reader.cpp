// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene_reader.hpp"

#include <algorithm>
#include <cctype>
#include <exception>
#include <limits>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include <assimp/BaseImporter.h>
#include <assimp/DefaultIOSystem.h>
#include <assimp/Importer.hpp>
#include <assimp/scene.h>

namespace sqmap::bake {
namespace {

namespace fs = std::filesystem;

/// Opens regular files in one folder and below, for reading. A scene names its buffers by path, and one made
/// to harm could name a device that never ends or a file that is none of its business.
class FolderIo : public Assimp::DefaultIOSystem {
 public:
  explicit FolderIo(const fs::path& scene) {
    std::error_code error;
    folder_ = fs::weakly_canonical(scene, error).parent_path();
  }
  bool Exists(const char* file) const override { return allows(file) && DefaultIOSystem::Exists(file); }
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    const bool reads = std::string_view(mode).find_first_of("wa+") == std::string_view::npos;
    return reads && allows(file) ? DefaultIOSystem::Open(file, mode) : nullptr;
  }

 private:
  bool allows(const char* file) const {
    std::error_code error;
    const fs::path path = fs::weakly_canonical(file, error);
    if (error || !fs::is_regular_file(path, error)) return false;
    return std::mismatch(folder_.begin(), folder_.end(), path.begin(), path.end()).first == folder_.end();
  }

  fs::path folder_;
};

/// p_to = linear p_from + translation.
struct Affine {
  std::array<Vec3d, 3> row{Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}};
  Vec3d translation;

  Vec3d apply(const Vec3d& p) const {
    return Vec3d{dot(row[0], p), dot(row[1], p), dot(row[2], p)} + translation;
  }
  bool mirrors() const { return dot(row[0], cross(row[1], row[2])) < 0; }
};

Affine from_assimp(const aiMatrix4x4& m) {
  return {{Vec3d{m.a1, m.a2, m.a3}, {m.b1, m.b2, m.b3}, {m.c1, m.c2, m.c3}}, {m.a4, m.b4, m.c4}};
}

/// First `inner`, then `outer`.
Affine chained(const Affine& outer, const Affine& inner) {
  Affine both;
  for (std::size_t i = 0; i < 3; ++i)
    both.row[i] =
        outer.row[i].x * inner.row[0] + outer.row[i].y * inner.row[1] + outer.row[i].z * inner.row[2];
  both.translation = outer.apply(inner.translation);
  return both;
}

Error invalid(const fs::path& path, const std::string& what, const std::string& remedy) {
  return {Status::kInvalidMesh, "\"" + path.filename().string() + "\": " + what, remedy};
}

/// Appends one mesh of the scene. False when an index is out of range or there are too many vertices to
/// number.
bool append(const aiMesh& mesh, const Affine& scene_from_node, PolygonMesh& all) {
  const std::size_t first = all.vertices.size();
  if (first + mesh.mNumVertices >= std::numeric_limits<std::uint32_t>::max()) return false;
  for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
    const aiVector3D& p = mesh.mVertices[v];
    all.vertices.push_back(scene_from_node.apply({p.x, p.y, p.z}));
  }
  for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
    const aiFace& face = mesh.mFaces[f];
    const std::span<const unsigned> corners(face.mIndices, face.mNumIndices);
    if (std::ranges::any_of(corners, [&](unsigned v) { return v >= mesh.mNumVertices; })) return false;
    if (corners.size() < 3) continue;
    for (const unsigned v : corners) all.corners.push_back(static_cast<std::uint32_t>(first + v));
    if (scene_from_node.mirrors())
      std::reverse(all.corners.end() - static_cast<std::ptrdiff_t>(corners.size()), all.corners.end());
    all.polygon_end.push_back(all.corners.size());
  }
  return true;
}

Result<PolygonMesh> join(const aiScene& scene, const fs::path& path) {
  PolygonMesh all;
  std::vector<std::pair<const aiNode*, Affine>> open;  // a stack: scenes may be deep
  if (scene.mRootNode != nullptr) open.emplace_back(scene.mRootNode, Affine{});
  while (!open.empty()) {
    const auto [node, scene_from_parent] = open.back();
    open.pop_back();
    const Affine scene_from_node = chained(scene_from_parent, from_assimp(node->mTransformation));
    for (unsigned i = 0; i < node->mNumMeshes; ++i) {
      if (node->mMeshes[i] >= scene.mNumMeshes) continue;
      const aiMesh& mesh = *scene.mMeshes[node->mMeshes[i]];
      if (!append(mesh, scene_from_node, all))
        return invalid(path,
                       "mesh \"" + std::string(mesh.mName.C_Str()) + "\" has a vertex index out of range",
                       "export the mesh again");
    }
    for (unsigned i = node->mNumChildren; i > 0; --i)
      open.emplace_back(node->mChildren[i - 1], scene_from_node);
  }
  return all;
}

/// Whether a list such as "gltf glb" holds the extension of a path.
bool lists_extension(std::string_view extensions, const fs::path& path) {
  std::string wanted = path.extension().string();
  std::ranges::transform(wanted, wanted.begin(), [](unsigned char c) { return std::tolower(c); });
  for (std::size_t start = 0; start < extensions.size();) {
    const std::size_t end = std::min(extensions.find(' ', start), extensions.size());
    if (!wanted.empty() && extensions.substr(start, end - start) == std::string_view(wanted).substr(1))
      return true;
    start = end + 1;
  }
  return false;
}

/// assimp goes by content, too: any name would lead to each of its formats, the rare ones with their
/// overflows, and PLY, where it never ends on some broken headers.
void keep_importers_of(const fs::path& path, Assimp::Importer& importer) {
  for (std::size_t k = importer.GetImporterCount(); k > 0; --k) {
    if (lists_extension(importer.GetImporterInfo(k - 1)->mFileExtensions, path)) continue;
    Assimp::BaseImporter* other = importer.GetImporter(k - 1);
    importer.UnregisterLoader(other);
    delete other;  // NOLINT(cppcoreguidelines-owning-memory): unregistering hands it back
  }
}

}  // namespace

Result<PolygonMesh> read_scene(const fs::path& path) {
  constexpr const char* kRemedy =
      "check that the file opens in another program, or convert it to OFF, PLY or GLB";
  try {
    Assimp::Importer importer;
    keep_importers_of(path, importer);
    importer.SetIOHandler(new FolderIo(path));                                     // the importer owns it
    importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);  // ReadOptions::up decides
    // No post-processing: it would triangulate and so lose the numbers of the polygons.
    const aiScene* scene = importer.ReadFile(path.string(), 0);
    if (scene == nullptr) {
      std::string reason = importer.GetErrorString();
      std::ranges::replace(reason, '\n', ' ');
      return invalid(path, "assimp cannot read it: " + reason, kRemedy);
    }
    return join(*scene, path);
  } catch (const std::exception& exception) {
    return invalid(path, std::string("assimp cannot read it: ") + exception.what(), kRemedy);
  } catch (...) {
    return invalid(path, "assimp cannot read it", kRemedy);
  }
}

}  // namespace sqmap::bake
