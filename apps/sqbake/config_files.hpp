// SPDX-License-Identifier: GPL-3.0-or-later
// Where the settings of a mesh come from, the stronger source later:
//
//   built in < [default] of the project file < [default] of the manifest
//            < the matching [[rule]]s of the project file in their order
//            < the manifest's [[asset]] < the sidecar < the command line
//
// The project file is the nearest `sqbake.toml` in the folder of the mesh or above it; the sidecar of
// hand.off is hand.off.sqbake.toml or hand.sqbake.toml beside it. A quality counts as the limits that it
// sets, but for those that the same source gives beside it.
#pragma once

#include <filesystem>
#include <map>
#include <utility>
#include <vector>

#include "sqmap/asset/result.hpp"

#include "settings.hpp"
#include "toml_files.hpp"

namespace sqmap::apps {

/// The source of a value that nothing else gives.
inline constexpr const char* kBuiltIn = "built in";

/// What holds for one mesh: a value for every setting, and the files that had a say.
struct EffectiveSettings {
  SettingValues values;
  std::vector<std::filesystem::path> files;
};

/// Which files to look at.
struct ConfigRequest {
  SettingTexts command_line;
  std::filesystem::path project;  ///< this file for every mesh, not the nearest one; empty: the nearest
  bool use_files = true;          ///< false: neither project files nor sidecars
};

/// Finds and reads project files and sidecars; each project file once.
class ConfigFiles {
 public:
  explicit ConfigFiles(ConfigRequest request) : request_(std::move(request)) {}

  /// `manifest` and `asset` are null for a mesh that no manifest names. Errors: those of toml_files.hpp;
  /// kBadOption also for two sidecars.
  Result<EffectiveSettings> settings_of(const std::filesystem::path& mesh, const Manifest* manifest = nullptr,
                                        const ManifestAsset* asset = nullptr);

 private:
  Result<const ProjectFile*> project_for(const std::filesystem::path& folder);
  Result<const ProjectFile*> project_at(const std::filesystem::path& path);

  ConfigRequest request_;
  std::map<std::filesystem::path, ProjectFile> projects_;
  std::map<std::filesystem::path, const ProjectFile*> nearest_;  ///< by absolute folder; null: none
};

}  // namespace sqmap::apps
