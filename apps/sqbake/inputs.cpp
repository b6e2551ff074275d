// SPDX-License-Identifier: GPL-3.0-or-later
#include "inputs.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <unistd.h>

#include "../common/files.hpp"
#include "glob.hpp"

namespace sqmap::apps {

const char* const kMeshExtensionList = "off obj ply stl gltf glb dae fbx 3mf";

namespace {

namespace fs = std::filesystem;

// What bake::read_mesh imports (bake/mesh.hpp).
constexpr std::array<std::string_view, 9> kMeshExtensions{".off", ".obj", ".ply", ".stl", ".gltf",
                                                          ".glb", ".dae", ".fbx", ".3mf"};
constexpr std::uint64_t kLargestList_bytes = std::uint64_t{64} << 20;

bool has_mesh_extension(const fs::path& path) {
  std::string extension = path.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return std::ranges::find(kMeshExtensions, extension) != kMeshExtensions.end();
}

Error without_meshes(const std::string& input, const char* where, const char* remedy) {
  return {Status::kUnknownFormat,
          fmt::format("{}: no file with a mesh extension ({}) {}", input, kMeshExtensionList, where), remedy};
}

Outcome check_readable(const fs::path& path) {
  std::error_code code;
  const fs::file_status status = fs::status(path, code);
  if (status.type() == fs::file_type::not_found)
    return Error{Status::kFileMissing, fmt::format("{}: no such file or folder", path.string()),
                 "check the path"};
  const bool is_known = fs::status_known(status);
  if (is_known && !fs::is_regular_file(status))
    return Error{
        Status::kFileUnreadable,
        fmt::format("{}: {}", path.string(), fs::is_directory(status) ? "is a folder" : "not a regular file"),
        "name a mesh file"};
  if (!is_known || ::access(path.c_str(), R_OK) != 0)
    return Error{Status::kFileUnreadable,
                 fmt::format("{}: {}", path.string(), is_known ? std::strerror(errno) : code.message()),
                 "check the file's permissions"};
  return Done{};
}

class Lister {
 public:
  explicit Lister(bool recursive) : recursive_(recursive) {}

  /// `listed`: the path stands in a list, `base` is what it is relative to.
  Outcome add(const std::string& input, const fs::path& base, bool listed);
  Outcome add_list(std::string_view name);

  InputList list;

 private:
  Outcome add_folder(const fs::path& folder, const std::string& input);
  Outcome add_pattern(const fs::path& pattern, const std::string& input);

  bool recursive_;
};

Outcome Lister::add_folder(const fs::path& folder, const std::string& input) {
  Result<std::vector<fs::path>> files = files_below(folder, recursive_);
  if (!files) return files.error();
  const std::size_t before = list.meshes.size();
  for (fs::path& file : files.value()) {
    if (!has_mesh_extension(file)) continue;
    if (const Outcome ok = check_readable(file); !ok) return ok.error();
    fs::path place = file.lexically_relative(folder);
    list.meshes.push_back({std::move(file), std::move(place)});
  }
  if (list.meshes.size() > before) return Done{};
  return recursive_ ? without_meshes(input, "in or below this folder", "")
                    : without_meshes(input, "in this folder", "--recursive looks below it");
}

Outcome Lister::add_pattern(const fs::path& pattern, const std::string& input) {
  Result<std::vector<fs::path>> files = expand_glob(pattern.string());
  if (!files) return files.error();
  const fs::path root = glob_root(pattern.string());
  const std::size_t before = list.meshes.size();
  for (fs::path& file : files.value()) {
    if (!has_mesh_extension(file)) continue;
    if (const Outcome ok = check_readable(file); !ok) return ok.error();
    fs::path place = root.empty() ? file : file.lexically_relative(root);
    list.meshes.push_back({std::move(file), std::move(place)});
  }
  if (list.meshes.size() > before) return Done{};
  return Error{Status::kFileMissing,
               fmt::format("{}: no mesh ({}) matches this pattern", input, kMeshExtensionList),
               "check the pattern; ** stands for any number of folders"};
}

Outcome Lister::add(const std::string& input, const fs::path& base, bool listed) {
  const fs::path path = base / input;
  std::error_code code;
  const fs::file_status status = fs::status(path, code);
  const bool is_folder = fs::is_directory(status), is_pattern = !fs::exists(status) && is_glob(input);
  list.is_searched = list.is_searched || listed || is_folder || is_pattern;
  if (is_folder) return add_folder(path, path.string());
  if (is_pattern) return add_pattern(path, path.string());
  if (const Outcome ok = check_readable(path); !ok) return ok.error();
  const fs::path relative = fs::path(input).lexically_normal();
  const bool keeps_folders = listed && relative.is_relative() && *relative.begin() != "..";
  list.meshes.push_back({path, keeps_folders ? relative : path.filename()});
  return Done{};
}

Outcome Lister::add_list(std::string_view name) {
  const bool is_beside = name.starts_with("@");
  if (is_beside) name.remove_prefix(1);
  const fs::path path{std::string(name)};
  if (name.empty()) return Error{Status::kBadOption, "@ without the name of a list", "write @FILE"};
  const bool is_stdin = name == "-";
  const auto bytes = is_stdin ? read_stdin(kLargestList_bytes) : read_file(path, kLargestList_bytes);
  if (!bytes) return bytes.error();
  if (!is_stdin) list.lists.push_back(path);
  const std::string_view text = as_text(bytes.value());
  const fs::path base = is_beside && !is_stdin ? path.parent_path() : fs::path();
  for (std::size_t at = 0, number = 1; at < text.size(); ++number) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    std::string line(text.substr(at, end - at));
    at = end + 1;
    if (line.ends_with('\r')) line.pop_back();
    if (line.empty()) continue;
    const auto place = [&](const Error& error) {
      return Error{error.status, fmt::format("{}:{}: {}", name, number, error.finding), error.remedy};
    };
    if (line.starts_with('@'))
      return place({Status::kBadOption, "a list cannot name a list", "write ./@..."});
    if (const Outcome ok = add(line, base, true); !ok) return place(ok.error());
  }
  return Done{};
}

}  // namespace

Outcome check_mesh_file(const fs::path& path) {
  if (const Outcome ok = check_readable(path); !ok) return ok.error();
  if (has_mesh_extension(path)) return Done{};
  return Error{Status::kUnknownFormat,
               fmt::format("{}: has no mesh extension ({})", path.string(), kMeshExtensionList),
               "name a mesh file"};
}

Result<InputList> list_inputs(const std::vector<std::string>& inputs, bool recursive) {
  Lister lister(recursive);
  for (const std::string& input : inputs) {
    const bool is_list = input.starts_with('@');
    const Outcome ok =
        is_list ? lister.add_list(std::string_view(input).substr(1)) : lister.add(input, {}, false);
    if (!ok) return ok.error();
  }
  std::error_code code;
  lister.list.is_single_file = inputs.size() == 1 && !inputs.front().starts_with('@') &&
                               fs::exists(inputs.front(), code) && !fs::is_directory(inputs.front(), code);
  return std::move(lister.list);
}

}  // namespace sqmap::apps
