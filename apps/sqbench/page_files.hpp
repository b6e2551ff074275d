// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "../common/console.hpp"
#include "../common/exit_codes.hpp"
#include "results.hpp"

namespace sqmap::apps {

/// Says what is wrong with `file`. Returns the exit code.
Exit report(Console& console, const std::filesystem::path& file, const Error& error);

/// Creates the folder and writes results.csv, index.html and the pictures into it.
Exit write_page(Console& console, const std::filesystem::path& folder, const bench::Results& results);

}  // namespace sqmap::apps
