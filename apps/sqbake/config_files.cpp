// SPDX-License-Identifier: GPL-3.0-or-later
#include "config_files.hpp"

#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "glob.hpp"

namespace sqmap::apps {
namespace {

namespace fs = std::filesystem;

constexpr const char* kProjectFile = "sqbake.toml";
constexpr const char* kSidecarEnd = ".sqbake.toml";

/// A quality takes the place of the limits that weaker sources gave, not of those given beside it.
void lay_over(SettingValues& values, const SettingValues& stronger) {
  if (const auto quality = stronger.find("quality"); quality != stronger.end())
    for (const auto& [name, text] : limits_of(quality->second.text))
      values[name] = {text, fmt::format("{} (quality {})", quality->second.source, quality->second.text)};
  for (const auto& [name, value] : stronger) values[name] = value;
}

Result<std::optional<fs::path>> sidecar_of(const fs::path& mesh) {
  const fs::path full = mesh.string() + kSidecarEnd;
  fs::path brief = mesh;
  brief.replace_extension();
  brief += kSidecarEnd;
  std::error_code code;
  const bool has_full = fs::exists(full, code), has_brief = fs::exists(brief, code);
  if (has_full && has_brief && full != brief)
    return Error{Status::kBadOption,
                 fmt::format("{}: has two sidecars, {} and {}", mesh.string(), full.filename().string(),
                             brief.filename().string()),
                 "keep one of them"};
  if (has_full) return std::optional(full);
  if (has_brief) return std::optional(brief);
  return std::optional<fs::path>();
}

}  // namespace

Result<const ProjectFile*> ConfigFiles::project_at(const fs::path& path) {
  if (const auto known = projects_.find(path); known != projects_.end()) return &known->second;
  Result<ProjectFile> file = read_project_file(path);
  if (!file) return file.error();
  return &projects_.emplace(path, std::move(file).value()).first->second;
}

Result<const ProjectFile*> ConfigFiles::project_for(const fs::path& folder) {
  if (!request_.project.empty()) return project_at(request_.project);
  std::error_code code;
  const fs::path start = fs::absolute(folder, code).lexically_normal();
  if (const auto known = nearest_.find(start); known != nearest_.end()) return known->second;
  const ProjectFile* nearest = nullptr;
  for (fs::path at = start;; at = at.parent_path()) {
    if (fs::is_regular_file(at / kProjectFile, code)) {
      const Result<const ProjectFile*> file = project_at(at / kProjectFile);
      if (!file) return file.error();
      nearest = file.value();
      break;
    }
    if (at == at.parent_path()) break;
  }
  nearest_[start] = nearest;
  return nearest;
}

Result<EffectiveSettings> ConfigFiles::settings_of(const fs::path& mesh, const Manifest* manifest,
                                                   const ManifestAsset* asset) {
  EffectiveSettings effective;
  SettingValues& values = effective.values;
  for (const Setting& setting : all_settings()) values[setting.name] = {setting.default_text(), kBuiltIn};

  const ProjectFile* project = nullptr;
  if (request_.use_files) {
    const Result<const ProjectFile*> found = project_for(mesh.parent_path());
    if (!found) return found.error();
    project = found.value();
  }
  if (project != nullptr) {
    lay_over(values, project->defaults);
    effective.files.push_back(project->path);
  }
  if (manifest != nullptr) {
    lay_over(values, manifest->defaults);
    effective.files.push_back(manifest->path);
  }
  if (project != nullptr) {
    std::error_code code;
    const fs::path base = fs::absolute(project->path, code).lexically_normal().parent_path();
    const std::string relative =
        fs::absolute(mesh, code).lexically_normal().lexically_relative(base).string();
    for (const ConfigRule& rule : project->rules)
      if (glob_matches(rule.pattern, relative, true)) lay_over(values, rule.values);
  }
  if (asset != nullptr) lay_over(values, asset->values);
  if (request_.use_files) {
    const Result<std::optional<fs::path>> sidecar = sidecar_of(mesh);
    if (!sidecar) return sidecar.error();
    if (sidecar.value()) {
      const Result<SettingValues> own = read_sidecar(*sidecar.value());
      if (!own) return own.error();
      lay_over(values, own.value());
      effective.files.push_back(*sidecar.value());
    }
  }
  SettingValues command_line;
  for (const auto& [name, text] : request_.command_line) command_line[name] = {text, "command line"};
  lay_over(values, command_line);
  return effective;
}

}  // namespace sqmap::apps
