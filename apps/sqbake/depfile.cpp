// SPDX-License-Identifier: GPL-3.0-or-later
#include "depfile.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>
#include <fstream>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "../common/files.hpp"

namespace sqmap::apps {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr std::uint64_t kLargestScene_bytes = std::uint64_t{1} << 30;

std::string lower(std::string text) {
  std::ranges::transform(text, text.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

/// Names after `mtllib`, the whole rest of the line being one name, as assimp takes it; and the file that it
/// tries where that one is missing.
std::vector<std::string> material_files(const fs::path& mesh) {
  std::vector<std::string> names;
  std::ifstream file(mesh);
  for (std::string line; std::getline(file, line);) {
    if (!line.starts_with("mtllib")) continue;
    std::size_t start = line.find_first_of(" \t");
    start = start == std::string::npos ? start : line.find_first_not_of(" \t", start);
    if (start == std::string::npos) continue;
    const std::size_t end = line.find_last_not_of(" \t\r");
    names.push_back(line.substr(start, end - start + 1));
  }
  if (!names.empty()) names.push_back(fs::path(mesh).filename().replace_extension(".mtl").string());
  return names;
}

/// The JSON of a scene: all of a .gltf, the first chunk of a .glb.
std::string_view scene_json(std::string_view bytes, bool is_binary) {
  if (!is_binary) return bytes;
  constexpr std::size_t kHeader_bytes = 20;  // magic, version, length, length of the chunk, type of the chunk
  if (bytes.size() < kHeader_bytes) return {};
  std::uint32_t length = 0;
  std::memcpy(&length, bytes.data() + 12, sizeof length);
  return bytes.substr(kHeader_bytes, length);
}

/// URIs of buffers as they stand there: assimp 5.2 does not undo percent signs.
std::vector<std::string> buffer_files(const fs::path& mesh, bool is_binary) {
  std::vector<std::string> names;
  const auto bytes = read_file(mesh, kLargestScene_bytes);
  if (!bytes) return names;
  const std::string_view all = as_text(bytes.value());
  const Json scene = Json::parse(scene_json(all, is_binary), nullptr, false);
  if (!scene.is_object() || !scene.contains("buffers") || !scene["buffers"].is_array()) return names;
  for (const Json& buffer : scene["buffers"]) {
    if (!buffer.is_object() || !buffer.contains("uri") || !buffer["uri"].is_string()) continue;
    auto uri = buffer["uri"].get<std::string>();
    if (!uri.starts_with("data:")) names.push_back(std::move(uri));
  }
  return names;
}

bool is_below(const fs::path& path, const fs::path& folder) {
  std::error_code code;
  const fs::path whole = fs::weakly_canonical(path, code), base = fs::weakly_canonical(folder, code);
  return std::mismatch(base.begin(), base.end(), whole.begin(), whole.end()).first == base.end();
}

/// A name as make and ninja read it in a rule.
std::string escaped(const fs::path& path) {
  std::string text;
  for (const char c : path.string()) {
    if (c == '$') text += '$';
    if (c == ' ' || c == '#' || c == '\\' || c == ':') text += '\\';
    text += c;
  }
  return text;
}

}  // namespace

std::vector<fs::path> side_files(const fs::path& mesh) {
  const std::string extension = lower(mesh.extension().string());
  std::vector<std::string> names;
  if (extension == ".obj") names = material_files(mesh);
  if (extension == ".gltf" || extension == ".glb") names = buffer_files(mesh, extension == ".glb");
  const fs::path folder = mesh.parent_path().empty() ? fs::path(".") : mesh.parent_path();
  std::vector<fs::path> files;
  for (const std::string& name : names) {
    fs::path file = mesh.parent_path() / name;
    if (is_below(file, folder) && std::ranges::find(files, file) == files.end())
      files.push_back(std::move(file));
  }
  return files;
}

Outcome write_depfile(const fs::path& path, const std::vector<Job>& jobs) {
  std::string text;
  std::set<std::string> inputs;
  for (const Job& job : jobs) {
    std::vector<fs::path> files{job.input};
    std::error_code code;
    for (fs::path& file : side_files(job.input))
      if (fs::exists(file, code)) files.push_back(std::move(file));
    files.insert(files.end(), job.config_files.begin(), job.config_files.end());
    text += escaped(job.output) + ":";
    for (const fs::path& file : files) {
      if (file.string().find('\n') != std::string::npos)
        return Error{Status::kBadOption, fmt::format("{}: a depfile cannot hold a line feed", file.string()),
                     "rename the file"};
      text += " \\\n  " + escaped(file);
      inputs.insert(escaped(file));
    }
    text += "\n";
  }
  for (const std::string& input : inputs) text += input + ":\n";
  return write_file(path, text);
}

}  // namespace sqmap::apps
