// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "sqmap/asset/result.hpp"

namespace sqmap::apps {

/// True when the text holds one of * ? [.
bool is_glob(std::string_view text);

/// Whether a relative path with forward slashes matches: `*` and `?` stay within a name, `[a-z]` and `[!a-z]`
/// are sets, a whole name `**` stands for any number of folders, also none. A pattern without a slash is
/// matched against the file name alone where `anywhere` is set, as in .gitignore.
bool glob_matches(std::string_view pattern, std::string_view path, bool anywhere = false);

/// What makes a pattern one that cannot mean what it says, for people; empty for a sound one: a set without
/// its `]` or with its ends in the wrong order, `**` beside other letters of a name, a folder `..`, an end in
/// `/`.
std::string glob_fault(std::string_view pattern);

/// The folder before the first name that holds a wildcard; empty for the working folder.
std::filesystem::path glob_root(std::string_view pattern);

/// Files below a folder, sorted; pipes and dangling links too. Names that start with a dot are left out,
/// folders of that kind are not entered, links to folders are not followed. Errors: kFileUnreadable, with the
/// folder that cannot be entered.
Result<std::vector<std::filesystem::path>> files_below(const std::filesystem::path& folder, bool recursive);

/// The files that match, sorted. Errors: kFileMissing (glob_fault, or glob_root is no folder),
/// kFileUnreadable.
Result<std::vector<std::filesystem::path>> expand_glob(std::string_view pattern);

}  // namespace sqmap::apps
