// SPDX-License-Identifier: GPL-3.0-or-later
#include "overwrite.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <string>
#include <system_error>

#include <fmt/format.h>
#include <unistd.h>

#include "report/report_page.hpp"

namespace sqmap::apps {
namespace {

namespace fs = std::filesystem;

fs::path folder_of(const fs::path& file) { return file.has_parent_path() ? file.parent_path() : "."; }

Outcome check_folder(std::string_view option, const fs::path& file, std::span<const fs::path> bundles) {
  std::error_code code;
  const fs::path folder = folder_of(file);
  const bool is_made = std::ranges::any_of(bundles, [&](const fs::path& bundle) {
    return folder_of(bundle).lexically_normal() == folder.lexically_normal();
  });
  if (!is_made && !fs::is_directory(folder, code))
    return Error{Status::kFileUnwritable,
                 fmt::format("{} {}: no folder {}", option, file.string(), folder.string()),
                 "make the folder, or name another file"};
  if (fs::is_directory(file, code))
    return Error{Status::kFileUnwritable, fmt::format("{} {}: is a folder", option, file.string()),
                 "name a file"};
  // A file is replaced, which needs the folder; a device is written to. A folder that a bake makes is not
  // there.
  const bool is_replaced = !fs::exists(file, code) || fs::is_regular_file(file, code);
  if (is_replaced && fs::is_directory(folder, code) && ::access(folder.c_str(), W_OK | X_OK) != 0)
    return Error{Status::kFileUnwritable,
                 fmt::format("{} {}: {}: {}", option, file.string(), folder.string(), std::strerror(errno)),
                 "check the folder's permissions, or name another file"};
  return Done{};
}

std::string start_of(const fs::path& path, std::size_t size) {
  std::string start(size, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(start.data(), static_cast<std::streamsize>(start.size()));
  start.resize(static_cast<std::size_t>(file.gcount()));
  return start;
}

/// A rule of make whose list of dependencies goes on in the next line, as each that write_depfile() makes.
bool begins_like_depfile(const fs::path& path) {
  constexpr std::size_t kLongestRule_bytes = 8192;  // twice the longest path, for its escapes
  const std::string start = start_of(path, kLongestRule_bytes);
  return start.substr(0, start.find('\n')).ends_with(": \\");
}

bool begins_like_page(const fs::path& path) {
  return start_of(path, 1024).find(kPageMark) != std::string::npos;
}

/// A run's records end with a summary, too, but of another kind.
bool ends_like_merged(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string line, last;
  while (std::getline(file, line)) last.swap(line);
  return last.starts_with(R"({"schema":"sqmap.merge/)");
}

/// `is_ours` is asked of a regular file that holds something.
Outcome check_replaced(std::string_view option, const fs::path& file, bool force, const char* what,
                       bool (*is_ours)(const fs::path&)) {
  std::error_code code;
  // Devices and pipes have nothing to lose.
  if (force || !fs::is_regular_file(file, code) || fs::file_size(file, code) == 0 || is_ours(file))
    return Done{};
  return Error{Status::kFileUnwritable,
               fmt::format("{} {}: exists and is not {}", option, file.string(), what),
               "name another file, or overwrite it with --force"};
}

}  // namespace

bool is_same_file(const fs::path& a, const fs::path& b) {
  std::error_code code;
  const bool has_a = fs::exists(a, code), has_b = fs::exists(b, code);
  if (has_a && has_b) return fs::equivalent(a, b, code);
  if (has_a != has_b || a.filename() != b.filename()) return false;
  const auto folder = [&](const fs::path& path) {
    return fs::weakly_canonical(fs::absolute(path, code).parent_path(), code);
  };
  return folder(a) == folder(b);
}

Outcome check_apart(std::string_view option, const fs::path& file, std::string_view role,
                    std::span<const fs::path> others) {
  for (const fs::path& other : others)
    if (is_same_file(file, other))
      return Error{Status::kBadOption, fmt::format("{} {}: is {}, too", option, file.string(), role),
                   "name another file"};
  return Done{};
}

Outcome check_page(std::string_view option, const fs::path& file, bool force,
                   std::span<const fs::path> bundles) {
  if (file.extension() != ".html")
    return Error{Status::kBadOption,
                 fmt::format("{} {}: a report's name ends in .html", option, file.string()),
                 "choose a name that ends in .html"};
  if (const Outcome ok = check_folder(option, file, bundles); !ok) return ok.error();
  return check_replaced(option, file, force, "a page of sqbake", begins_like_page);
}

Outcome check_merged(std::string_view option, const fs::path& file, bool force) {
  if (const Outcome ok = check_folder(option, file, {}); !ok) return ok.error();
  return check_replaced(option, file, force, "what a merge wrote", ends_like_merged);
}

Outcome check_depfile(const fs::path& file, bool force, std::span<const fs::path> bundles) {
  if (const Outcome ok = check_folder("--depfile", file, bundles); !ok) return ok.error();
  return check_replaced("--depfile", file, force, "a depfile", begins_like_depfile);
}

}  // namespace sqmap::apps
