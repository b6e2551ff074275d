// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "sqmap/asset/result.hpp"

#include "config_files.hpp"
#include "settings.hpp"

namespace sqmap::apps {

/// What to bake where, as the command line says it.
struct JobRequest {
  std::vector<std::string> inputs;  ///< files, folders, patterns and lists: see inputs.hpp
  std::filesystem::path manifest;   ///< names further inputs; may be empty
  std::filesystem::path output;     ///< -o; empty when out_dir is used
  std::filesystem::path out_dir;    ///< --out-dir; empty when output is used
  bool recursive = false;           ///< look below folders
  bool keep_extension = false;      ///< NAME.off.h5 in place of NAME.h5
  bool force = false;               ///< overwrite files that are not bundles
  ConfigRequest config;
};

struct Job {
  std::filesystem::path input;
  std::filesystem::path output;
  std::string name;             ///< for tables: the file, with its folders below the one that was named
  std::uint64_t input_bytes{};  ///< 0 when unknown
  SettingValues settings;       ///< all of them
  /// Files other than the mesh that decided what is baked: lists, manifest, project file, sidecar.
  std::vector<std::filesystem::path> config_files;
};

struct JobList {
  std::vector<Job> jobs;     ///< in order of the command line, each folder sorted by path
  bool single_file = false;  ///< one file was named: its error is the program's error
  bool is_searched = false;  ///< a folder, a pattern, a list or a manifest was named
};

/// The jobs of a request. Reads lists and TOML files, but of a mesh no more than whether it can be read, and
/// writes nothing. Errors: kBadOption (options that do not fit, two inputs for one output, a wrong setting),
/// kFileMissing, kFileUnreadable, kUnknownFormat (a folder without meshes, a manifest that names none),
/// kFileUnwritable (an output that is no bundle of ours, without force).
Result<JobList> list_jobs(const JobRequest& request);

/// Whether prepare_folders() would succeed; makes nothing. Errors: kFileUnwritable.
Outcome check_folders(const JobList& list, const JobRequest& request);

/// Makes the output folders and checks that they can be written. Errors: kFileUnwritable.
Outcome prepare_folders(const JobList& list, const JobRequest& request);

}  // namespace sqmap::apps
