// SPDX-License-Identifier: GPL-3.0-or-later
#include "glob.hpp"

#include <algorithm>
#include <cstddef>
#include <span>
#include <system_error>

#include <fmt/format.h>

namespace sqmap::apps {
namespace {

namespace fs = std::filesystem;

std::vector<std::string_view> names_of(std::string_view path) {
  std::vector<std::string_view> names;
  while (!path.empty()) {
    const std::size_t end = std::min(path.find('/'), path.size());
    const std::string_view name = path.substr(0, end);
    if (!name.empty() && name != ".") names.push_back(name);
    path.remove_prefix(std::min(end + 1, path.size()));
  }
  return names;
}

/// Whether the set that begins at pattern[0] == '[' holds c; `length` becomes its length, 0 for no set.
bool set_holds(std::string_view pattern, char c, std::size_t& length) {
  std::size_t at = 1;
  const bool is_negated = at < pattern.size() && (pattern[at] == '!' || pattern[at] == '^');
  if (is_negated) ++at;
  bool holds = false;
  const std::size_t first = at;
  for (; at < pattern.size() && (pattern[at] != ']' || at == first); ++at) {
    char low = pattern[at], high = low;
    if (at + 2 < pattern.size() && pattern[at + 1] == '-' && pattern[at + 2] != ']') {
      high = pattern[at + 2];
      at += 2;
    }
    holds = holds || (low <= c && c <= high);
  }
  length = at < pattern.size() ? at + 1 : 0;
  return holds != is_negated;
}

/// What is wrong with a name of a pattern, but for `..`.
std::string name_fault(std::string_view name) {
  for (std::size_t at = 0; at < name.size(); ++at) {
    if (name[at] == '*' && at + 1 < name.size() && name[at + 1] == '*' && name.size() > 2)
      return fmt::format("`**` must be a whole name, not a piece of `{}`", name);
    if (name[at] != '[') continue;
    std::size_t length = 0;
    set_holds(name.substr(at), 'x', length);
    if (length == 0) return fmt::format("`[` without `]` in `{}`; a bracket itself is `[[]`", name);
    const std::string_view set = name.substr(at, length);
    for (std::size_t k = 2; k + 2 < set.size(); ++k)
      if (set[k] == '-' && set[k - 1] > set[k + 1])
        return fmt::format("`{}` in `{}` holds nothing: its ends are in the wrong order", set, name);
    at += length - 1;
  }
  return "";
}

/// Backtracks to the last star only: that is enough for stars within one name, and linear in practice.
bool name_matches(std::string_view pattern, std::string_view name) {
  std::size_t p = 0, n = 0, star = std::string_view::npos, star_n = 0;
  while (n < name.size()) {
    std::size_t length = 1;
    bool matches = false;
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      star_n = n;
      continue;
    }
    if (p < pattern.size() && pattern[p] == '[') {
      matches = set_holds(pattern.substr(p), name[n], length);
      if (length == 0) matches = name[n] == '[', length = 1;
    } else if (p < pattern.size()) {
      matches = pattern[p] == '?' || pattern[p] == name[n];
    }
    if (matches) {
      p += length;
      ++n;
    } else if (star != std::string_view::npos) {
      p = star + 1;
      n = ++star_n;
    } else {
      return false;
    }
  }
  while (p < pattern.size() && pattern[p] == '*') ++p;
  return p == pattern.size();
}

bool names_match(std::span<const std::string_view> pattern, std::span<const std::string_view> names) {
  // reached[k]: the pattern so far matches the first k names.
  std::vector<bool> reached(names.size() + 1, false);
  reached[0] = true;
  for (const std::string_view part : pattern) {
    std::vector<bool> next(names.size() + 1, false);
    bool any = false;
    for (std::size_t k = 0; k <= names.size(); ++k) {
      any = any || reached[k];
      if (part == "**") {
        next[k] = any;
      } else if (k > 0) {
        next[k] = reached[k - 1] && name_matches(part, names[k - 1]);
      }
    }
    reached = std::move(next);
  }
  return reached.back();
}

}  // namespace

bool is_glob(std::string_view text) { return text.find_first_of("*?[") != std::string_view::npos; }

bool glob_matches(std::string_view pattern, std::string_view path, bool anywhere) {
  const std::vector<std::string_view> names = names_of(path);
  if (names.empty()) return false;
  if (anywhere && pattern.find('/') == std::string_view::npos) return name_matches(pattern, names.back());
  return names_match(names_of(pattern), names);
}

std::string glob_fault(std::string_view pattern) {
  if (names_of(pattern).empty()) return "names nothing";
  if (pattern.ends_with('/')) return "ends in `/`, but matches files; append `**` for all below a folder";
  for (const std::string_view name : names_of(pattern)) {
    if (name == "..") return "holds `..`, which no file below its folder has";
    if (std::string fault = name_fault(name); !fault.empty()) return fault;
  }
  return "";
}

fs::path glob_root(std::string_view pattern) {
  const std::size_t wildcard = std::min(pattern.find_first_of("*?["), pattern.size());
  const std::size_t slash = pattern.substr(0, wildcard).rfind('/');
  if (slash == std::string_view::npos) return {};
  return fs::path(slash == 0 ? "/" : pattern.substr(0, slash));
}

Result<std::vector<fs::path>> files_below(const fs::path& folder, bool recursive) {
  std::vector<fs::path> found;
  std::error_code code;
  fs::recursive_directory_iterator entry(folder, code);
  fs::path read = folder;  // what an error speaks of
  for (; !code && entry != fs::recursive_directory_iterator(); entry.increment(code)) {
    std::error_code type_code;
    const bool is_folder = entry->is_directory(type_code);
    const bool is_hidden = entry->path().filename().string().starts_with('.');
    const bool is_entered = is_folder && recursive && !is_hidden;
    if (!is_entered) entry.disable_recursion_pending();
    read = is_entered ? entry->path() : folder;
    if (!is_folder && !is_hidden) found.push_back(entry->path());
  }
  if (code)
    return Error{Status::kFileUnreadable, fmt::format("{}: {}", read.string(), code.message()),
                 "check the folder's permissions"};
  std::ranges::sort(found);
  return found;
}

Result<std::vector<fs::path>> expand_glob(std::string_view pattern) {
  const fs::path root = glob_root(pattern);
  std::error_code code;
  if (!root.empty() && !fs::is_directory(root, code))
    return Error{Status::kFileMissing, fmt::format("{}: no folder {}", pattern, root.string()),
                 "check the path"};
  const std::string_view rest =
      root.empty() ? pattern : pattern.substr(root.native().size() + (root == "/" ? 0 : 1));
  if (const std::string fault = glob_fault(rest); !fault.empty())
    return Error{Status::kFileMissing, fmt::format("{}: no such file, and no pattern: {}", pattern, fault),
                 "check the path"};
  const bool is_deep = rest.find('/') != std::string_view::npos || rest == "**";
  Result<std::vector<fs::path>> files = files_below(root.empty() ? fs::path(".") : root, is_deep);
  if (!files) return files;
  std::vector<fs::path> found;
  for (fs::path& file : files.value()) {
    fs::path relative = file.lexically_relative(root.empty() ? fs::path(".") : root);
    if (glob_matches(rest, relative.string())) found.push_back(std::move(root.empty() ? relative : file));
  }
  return found;
}

}  // namespace sqmap::apps
