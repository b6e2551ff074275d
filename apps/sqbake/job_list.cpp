// SPDX-License-Identifier: GPL-3.0-or-later
#include "job_list.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <map>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <unistd.h>

#include "../common/files.hpp"
#include "inputs.hpp"

namespace sqmap::apps {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kBundleExtension = ".h5";
constexpr std::string_view kBundleMagic{"SQMAP\x1a\n\0", 8};  // formats/FORMAT.md

std::uint64_t size_or_zero(const fs::path& path) {
  std::error_code code;
  const std::uintmax_t bytes = fs::file_size(path, code);
  return code ? 0 : bytes;
}

fs::path output_name(const fs::path& relative, bool keep_extension) {
  fs::path name = relative;
  if (!keep_extension) name.replace_extension();
  name += kBundleExtension;
  return name;
}

Outcome append_job(const JobRequest& request, ConfigFiles& config, Job job, const Manifest* manifest,
                   const ManifestAsset* asset, std::vector<Job>& jobs) {
  Result<EffectiveSettings> effective = config.settings_of(job.input, manifest, asset);
  if (!effective) return effective.error();
  job.settings = std::move(effective.value().values);
  // Values that fit alone may not fit together, and those built in may not fit the mesh's own.
  if (const Result<AssetOptions> ok = options_from(texts_of(job.settings)); !ok)
    return Error{ok.error().status, job.input.string() + ": " + ok.error().finding, ok.error().remedy};
  for (fs::path& file : effective.value().files) job.config_files.push_back(std::move(file));
  if (!request.output.empty()) job.output = request.output;
  job.input_bytes = size_or_zero(job.input);
  jobs.push_back(std::move(job));
  return Done{};
}

Outcome append_manifest(const JobRequest& request, ConfigFiles& config, std::vector<Job>& jobs) {
  const Result<Manifest> manifest = read_manifest(request.manifest);
  if (!manifest) return manifest.error();
  for (const ManifestAsset& asset : manifest.value().assets) {
    const fs::path input = (request.manifest.parent_path() / asset.input).lexically_normal();
    if (const Outcome ok = check_mesh_file(input); !ok)
      return Error{ok.error().status, fmt::format("{}: {}", request.manifest.string(), ok.error().finding),
                   ok.error().remedy + "; paths are relative to the manifest"};
    const fs::path relative = asset.input.lexically_normal();
    const bool is_below = relative.is_relative() && *relative.begin() != "..";
    const fs::path place = is_below ? relative : relative.filename();
    Job job;
    job.input = input;
    job.output =
        request.out_dir / (asset.output.empty() ? output_name(place, request.keep_extension) : asset.output);
    job.name = place.string();
    if (const Outcome ok = append_job(request, config, std::move(job), &manifest.value(), &asset, jobs); !ok)
      return ok.error();
  }
  return Done{};
}

Outcome check_clashes(const std::vector<Job>& jobs) {
  std::map<fs::path, const Job*> owner;
  std::map<fs::path, fs::path> folders;  // weakly_canonical asks the system for every name on the way
  for (const Job& job : jobs) {
    const auto [folder, is_new_folder] = folders.emplace(job.output.parent_path(), fs::path());
    std::error_code code;
    if (is_new_folder)
      folder->second = fs::weakly_canonical(fs::absolute(job.output, code).parent_path(), code);
    const auto [entry, is_new] = owner.emplace(folder->second / job.output.filename(), &job);
    if (!is_new && fs::equivalent(entry->second->input, job.input, code))
      return Error{
          Status::kBadOption,
          fmt::format(
              "{} is named twice, for one bundle{}", entry->second->input.string(),
              entry->second->input == job.input ? "" : fmt::format(": also as {}", job.input.string())),
          "name it once"};
    if (!is_new)
      return Error{Status::kBadOption,
                   fmt::format("{} and {} would both be written to {}", entry->second->input.string(),
                               job.input.string(), job.output.string()),
                   "bake them into different folders, name their folder in place of the files, or add "
                   "--keep-extension"};
  }
  return Done{};
}

/// An existing output is replaced only when it is a bundle (of any version, also a damaged one) or empty.
Outcome check_overwrite(const fs::path& output) {
  std::error_code code;
  const fs::file_status status = fs::status(output, code);
  if (!fs::exists(status)) return Done{};
  if (fs::is_regular_file(status)) {
    std::array<char, kBundleMagic.size()> start{};
    std::ifstream file(output, std::ios::binary);
    file.read(start.data(), static_cast<std::streamsize>(start.size()));
    if (size_or_zero(output) == 0 || std::string_view(start.data(), start.size()) == kBundleMagic)
      return Done{};
  }
  return Error{
      Status::kFileUnwritable, fmt::format("{}: exists and is not an sqmap bundle", output.string()),
      fs::is_regular_file(status) ? "name another file, or overwrite it with --force" : "name another file"};
}

Outcome check_request(const JobRequest& request) {
  const std::size_t count = request.inputs.size() + (request.manifest.empty() ? 0 : 1);
  if (count == 0)
    return Error{Status::kBadOption, "INPUT is required",
                 "name mesh files, folders of them, or --manifest FILE"};
  if (request.output.empty() && request.out_dir.empty())
    return Error{Status::kBadOption, "no output named",
                 "add -o FILE.h5, or --out-dir DIR for several inputs"};
  if (!request.output.empty() && !request.out_dir.empty())
    return Error{Status::kBadOption, "-o and --out-dir exclude each other", "use one of them"};
  if (!request.output.empty() && count > 1)
    return Error{Status::kBadOption, fmt::format("-o names one file for {} inputs", count),
                 "use --out-dir DIR"};
  std::error_code code;
  if (!request.output.empty() && !request.inputs.empty() && fs::is_directory(request.inputs.front(), code))
    return Error{Status::kBadOption,
                 fmt::format("{}: is a folder, but -o names one file", request.inputs.front()),
                 "use --out-dir DIR"};
  if (!request.output.empty() && !request.manifest.empty())
    return Error{Status::kBadOption, "-o names one file, a manifest many", "use --out-dir DIR"};
  if (!request.output.empty() && request.output.extension() != kBundleExtension)
    return Error{Status::kBadOption, fmt::format("{}: a bundle's name ends in .h5", request.output.string()),
                 "choose a name that ends in .h5"};
  return Done{};
}

std::set<fs::path> output_folders(const JobList& list) {
  std::set<fs::path> folders;
  for (const Job& job : list.jobs) {
    const fs::path folder = job.output.parent_path();
    folders.insert(folder.empty() ? fs::path(".") : folder);
  }
  return folders;
}

Outcome check_folder(const fs::path& folder) {
  std::error_code code;
  if (!fs::is_directory(folder, code))
    return Error{
        Status::kFileUnwritable,
        fmt::format("{}: {}", folder.string(), fs::exists(folder, code) ? "not a folder" : "no such folder"),
        "make the folder, or name another output"};
  if (::access(folder.c_str(), W_OK | X_OK) != 0)
    return Error{Status::kFileUnwritable, fmt::format("{}: {}", folder.string(), std::strerror(errno)),
                 "check the folder's permissions"};
  return Done{};
}

}  // namespace

Result<JobList> list_jobs(const JobRequest& request) {
  if (const Outcome ok = check_request(request); !ok) return ok.error();
  JobList list;
  ConfigFiles config(request.config);
  const Result<InputList> inputs = list_inputs(request.inputs, request.recursive);
  if (!inputs) return inputs.error();
  if (!request.output.empty() && !inputs.value().is_single_file)
    return Error{Status::kBadOption,
                 fmt::format("{}: names several meshes, but -o one file", request.inputs.front()),
                 "use --out-dir DIR"};
  for (const InputMesh& mesh : inputs.value().meshes) {
    Job job;
    job.input = mesh.path;
    job.output = request.out_dir / output_name(mesh.place, request.keep_extension);
    job.name = mesh.place.string();
    job.config_files = inputs.value().lists;
    if (const Outcome ok = append_job(request, config, std::move(job), nullptr, nullptr, list.jobs); !ok)
      return ok.error();
  }
  if (!request.manifest.empty())
    if (const Outcome ok = append_manifest(request, config, list.jobs); !ok) return ok.error();
  list.is_searched = inputs.value().is_searched || !request.manifest.empty();
  list.single_file = inputs.value().is_single_file && request.manifest.empty();
  if (const Outcome ok = check_clashes(list.jobs); !ok) return ok.error();
  std::error_code code;
  for (const Job& job : list.jobs)
    if (const Outcome ok = check_overwrite(job.output);
        !ok && (!request.force || fs::is_directory(job.output, code)))
      return ok.error();
  return list;
}

Outcome check_folders(const JobList& list, const JobRequest& request) {
  std::error_code code;
  for (const fs::path& folder : output_folders(list)) {
    fs::path there = folder;  // itself, or what it will be made in
    while (!request.out_dir.empty() && !fs::exists(there, code) && there.has_relative_path())
      there = there.has_parent_path() ? there.parent_path() : ".";
    if (const Outcome ok = check_folder(there); !ok) return ok.error();
  }
  return Done{};
}

Outcome prepare_folders(const JobList& list, const JobRequest& request) {
  for (const fs::path& folder : output_folders(list)) {
    std::error_code code;
    if (!request.out_dir.empty()) fs::create_directories(folder, code);
    if (code)
      return Error{Status::kFileUnwritable, fmt::format("{}: {}", folder.string(), code.message()),
                   "make the folder, or name another output"};
    if (const Outcome ok = check_folder(folder); !ok) return ok.error();
  }
  std::vector<fs::path> bundles;
  for (const Job& job : list.jobs) bundles.push_back(job.output);
  remove_abandoned(bundles);
  return Done{};
}

}  // namespace sqmap::apps
