// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "sqmap/asset/result.hpp"

namespace sqmap::apps {

/// A mesh to bake.
struct InputMesh {
  std::filesystem::path path;
  /// Its place below the output folder, with its own extension: the folders below the folder or the fixed
  /// start of the pattern that was named; of a path in a list, all its folders.
  std::filesystem::path place;
};

struct InputList {
  std::vector<InputMesh> meshes;             ///< in the order they were named, each folder sorted
  std::vector<std::filesystem::path> lists;  ///< list files that were read
  bool is_single_file = false;               ///< one file was named, by its name
  bool is_searched = false;                  ///< a folder, a pattern or a list was named
};

/// The extensions that bake::read_mesh knows, for people.
extern const char* const kMeshExtensionList;

/// Whether this is, by its name, a mesh, and a file that can be read. Errors: kFileMissing, kFileUnreadable,
/// kUnknownFormat.
Outcome check_mesh_file(const std::filesystem::path& path);

/// What inputs stand for: a file, a folder (its meshes; with `recursive` those below it, too), a pattern with
/// * ? [ ** (the meshes that match), `@LIST` (one input a line; `@-`: standard input) or `@@LIST` (paths in
/// it are relative to the list). A file called like a pattern or a list is named with `./` in front. Opens
/// no mesh. Errors: kFileMissing (also a pattern that nothing matches), kFileUnreadable (files and folders),
/// kUnknownFormat (a folder without meshes), kBadOption (lists in lists).
Result<InputList> list_inputs(const std::vector<std::string>& inputs, bool recursive);

}  // namespace sqmap::apps
