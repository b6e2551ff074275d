// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "sqmap/asset/result.hpp"

#include "settings.hpp"

namespace sqmap::apps {

/// Settings of the files that match a pattern.
struct ConfigRule {
  std::string pattern;  ///< relative to the folder of its file
  SettingValues values;
};

struct ProjectFile {
  std::filesystem::path path;
  SettingValues defaults;
  std::vector<ConfigRule> rules;
};

struct ManifestAsset {
  std::filesystem::path input;   ///< as written, relative to the manifest's folder
  std::filesystem::path output;  ///< relative to the output folder; empty: named after the input
  SettingValues values;
};

struct Manifest {
  std::filesystem::path path;
  SettingValues defaults;
  std::vector<ManifestAsset> assets;
};

/// The three kinds of TOML file. Errors: kFileMissing, kFileUnreadable; kBadOption for what is no TOML, an
/// unknown key (with the one that was probably meant), a value or a pattern that cannot be, each with its
/// line.
Result<ProjectFile> read_project_file(const std::filesystem::path& path);
Result<Manifest> read_manifest(const std::filesystem::path& path);
Result<SettingValues> read_sidecar(const std::filesystem::path& path);

}  // namespace sqmap::apps
