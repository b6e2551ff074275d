// SPDX-License-Identifier: GPL-3.0-or-later
// What a file that is written beside the bundles may take the place of. All of it is asked before any work.
#pragma once

#include <filesystem>
#include <span>
#include <string_view>

#include "sqmap/asset/result.hpp"

namespace sqmap::apps {

/// Whether two names lead to one file, or would once it exists.
bool is_same_file(const std::filesystem::path& a, const std::filesystem::path& b);

/// Refuses a file that is also one of `others`. `option` is what names it, e.g. "--depfile"; `role` what the
/// others are, e.g. "an input". Errors: kBadOption.
Outcome check_apart(std::string_view option, const std::filesystem::path& file, std::string_view role,
                    std::span<const std::filesystem::path> others);

/// A page's name ends in .html. It takes the place of another page of sqbake or of an empty file only; with
/// `force` of any file. Errors: kBadOption, kFileUnwritable (also: no folder to write it to; those of
/// `bundles` will be there).
Outcome check_page(std::string_view option, const std::filesystem::path& file, bool force,
                   std::span<const std::filesystem::path> bundles = {});

/// Joined records take the place of joined records or of an empty file only; with `force` of any file.
/// Errors: kFileUnwritable.
Outcome check_merged(std::string_view option, const std::filesystem::path& file, bool force);

/// A depfile takes the place of a depfile or of an empty file only; with `force` of any file. Errors:
/// kFileUnwritable, as of check_page().
Outcome check_depfile(const std::filesystem::path& file, bool force,
                      std::span<const std::filesystem::path> bundles);

}  // namespace sqmap::apps
