// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "sqmap/asset/asset.hpp"
#include "sqmap/asset/result.hpp"

#include "part_surface.hpp"

namespace sqmap::apps {

/// A mesh file to draw beside its bundle.
struct SourceSurface {
  TriangleSurface surface;  ///< object frame [m]: unit and up axis of the bundle applied; without normals
  std::string hash;         ///< XXH3-128 of the file, as Provenance::source_hash
};

/// Reads any mesh file that assimp knows. Errors: kFileMissing, kFileUnreadable, kInvalidMesh.
Result<SourceSurface> read_source(const std::filesystem::path& path, const Provenance& provenance);

}  // namespace sqmap::apps
