// SPDX-License-Identifier: GPL-3.0-or-later
#include "job_list.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <map>
#include <set>
#include <string_view>
#include <system_error>

#include <fmt/format.h>
#include <unistd.h>

#include "sqmap/io/bundle.hpp"

namespace sqmap::apps {
namespace {

namespace fs = std::filesystem;

// What bake::read_mesh imports (bake/mesh.hpp).
constexpr std::array<std::string_view, 9> kMeshExtensions{".off", ".obj", ".ply", ".stl", ".gltf",
                                                          ".glb", ".dae", ".fbx", ".3mf"};
constexpr std::string_view kBundleExtension = ".h5";

bool has_mesh_extension(const fs::path& path) {
  std::string extension = path.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return std::ranges::find(kMeshExtensions, extension) != kMeshExtensions.end();
}

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

/// Everything below a folder that is called like a mesh, sorted; pipes and dangling links too, so that each
/// gets a record that says what is wrong with it. Names that start with a dot are hidden.
Result<std::vector<fs::path>> meshes_in(const fs::path& folder, bool recursive) {
  std::vector<fs::path> found;
  std::error_code code;
  const auto options = fs::directory_options::skip_permission_denied;
  fs::recursive_directory_iterator entry(folder, options, code);
  for (; !code && entry != fs::recursive_directory_iterator(); entry.increment(code)) {
    std::error_code type_code;
    const bool is_folder = entry->is_directory(type_code);
    const bool is_hidden = entry->path().filename().string().starts_with('.');
    if (is_folder && (!recursive || is_hidden)) entry.disable_recursion_pending();
    if (!is_folder && !is_hidden && has_mesh_extension(entry->path())) found.push_back(entry->path());
  }
  if (code)
    return Error{Status::kFileUnreadable, fmt::format("{}: {}", folder.string(), code.message()),
                 "check the folder's permissions"};
  std::ranges::sort(found);
  return found;
}

/// Jobs of one named input, appended.
Outcome append_jobs(const fs::path& input, const JobRequest& request, std::vector<Job>& jobs) {
  std::error_code code;
  const fs::file_status status = fs::status(input, code);
  if (!fs::exists(status))
    return Error{Status::kFileMissing, fmt::format("{}: no such file or folder", input.string()),
                 "check the path"};
  if (!fs::is_directory(status)) {
    const fs::path output = request.output.empty()
                                ? request.out_dir / output_name(input.filename(), request.keep_extension)
                                : request.output;
    jobs.push_back({input, output, input.filename().string(), size_or_zero(input)});
    return Done{};
  }
  if (!request.output.empty())
    return Error{Status::kBadOption, fmt::format("{}: is a folder, but -o names one file", input.string()),
                 "use --out-dir DIR"};
  Result<std::vector<fs::path>> meshes = meshes_in(input, request.recursive);
  if (!meshes) return meshes.error();
  if (meshes.value().empty())
    return Error{
        Status::kUnknownFormat,
        fmt::format("{}: no file with a mesh extension (off, obj, ply, stl, gltf, glb, dae, fbx, 3mf) {}",
                    input.string(), request.recursive ? "in or below this folder" : "in this folder"),
        request.recursive ? "" : "--recursive looks below it"};
  for (const fs::path& mesh : meshes.value()) {
    const fs::path relative = mesh.lexically_relative(input);
    jobs.push_back({mesh, request.out_dir / output_name(relative, request.keep_extension), relative.string(),
                    size_or_zero(mesh)});
  }
  return Done{};
}

Outcome check_clashes(const std::vector<Job>& jobs) {
  std::map<fs::path, const Job*> owner;
  for (const Job& job : jobs) {
    const auto [entry, is_new] = owner.emplace(fs::weakly_canonical(job.output), &job);
    if (!is_new)
      return Error{Status::kBadOption,
                   fmt::format("{} and {} would both be written to {}", entry->second->input.string(),
                               job.input.string(), job.output.string()),
                   "bake them into different folders, or add --keep-extension"};
  }
  return Done{};
}

/// An existing output is replaced only when it is a bundle (of any version) or empty.
Outcome check_overwrite(const fs::path& output) {
  std::error_code code;
  const fs::file_status status = fs::status(output, code);
  if (!fs::exists(status)) return Done{};
  if (fs::is_regular_file(status)) {
    if (size_or_zero(output) == 0) return Done{};
    const Result<Asset> old = io::read(output);
    if (old || old.error().status == Status::kUnsupportedVersion) return Done{};
  }
  return Error{
      Status::kFileUnwritable, fmt::format("{}: exists and is not an intact sqmap bundle", output.string()),
      fs::is_regular_file(status) ? "name another file, or overwrite it with --force" : "name another file"};
}

Outcome check_request(const JobRequest& request) {
  if (request.output.empty() && request.out_dir.empty())
    return Error{Status::kBadOption, "no output named",
                 "add -o FILE.h5, or --out-dir DIR for several inputs"};
  if (!request.output.empty() && !request.out_dir.empty())
    return Error{Status::kBadOption, "-o and --out-dir exclude each other", "use one of them"};
  if (!request.output.empty() && request.inputs.size() > 1)
    return Error{Status::kBadOption, fmt::format("-o names one file for {} inputs", request.inputs.size()),
                 "use --out-dir DIR"};
  if (!request.output.empty() && request.output.extension() != kBundleExtension)
    return Error{Status::kBadOption, fmt::format("{}: a bundle's name ends in .h5", request.output.string()),
                 "choose a name that ends in .h5"};
  return Done{};
}

}  // namespace

Result<JobList> list_jobs(const JobRequest& request) {
  if (const Outcome ok = check_request(request); !ok) return ok.error();
  JobList list;
  for (const fs::path& input : request.inputs)
    if (const Outcome ok = append_jobs(input, request, list.jobs); !ok) return ok.error();
  std::error_code code;
  list.single_file = request.inputs.size() == 1 && !fs::is_directory(request.inputs.front(), code);
  if (const Outcome ok = check_clashes(list.jobs); !ok) return ok.error();
  for (const Job& job : list.jobs)
    if (const Outcome ok = check_overwrite(job.output);
        !ok && (!request.force || fs::is_directory(job.output, code)))
      return ok.error();
  return list;
}

Outcome prepare_folders(const JobList& list, const JobRequest& request) {
  std::set<fs::path> folders;
  for (const Job& job : list.jobs) {
    const fs::path folder = job.output.parent_path();
    folders.insert(folder.empty() ? fs::path(".") : folder);
  }
  for (const fs::path& folder : folders) {
    std::error_code code;
    if (!request.out_dir.empty()) fs::create_directories(folder, code);
    if (code || !fs::is_directory(folder, code))
      return Error{Status::kFileUnwritable,
                   fmt::format("{}: {}", folder.string(), code ? code.message() : "no such folder"),
                   "make the folder, or name another output"};
    if (::access(folder.c_str(), W_OK | X_OK) != 0)
      return Error{Status::kFileUnwritable, fmt::format("{}: {}", folder.string(), std::strerror(errno)),
                   "check the folder's permissions"};
  }
  return Done{};
}

}  // namespace sqmap::apps
