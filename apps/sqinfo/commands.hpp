// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <optional>

#include "sqmap/asset/asset.hpp"

#include "../common/program.hpp"

namespace sqmap::apps {

std::function<Exit(Console&)> declare_show(CLI::App& app);
std::function<Exit(Console&)> declare_validate(CLI::App& app);
std::function<Exit(Console&)> declare_query(CLI::App& app);
std::function<Exit(Console&)> declare_export(CLI::App& app);
std::function<Exit(Console&)> declare_diff(CLI::App& app);

/// Prints the error against the file and returns its exit code.
Exit report(Console& console, const std::filesystem::path& file, const Error& error);

/// What `show` calls a cut reason.
const char* reason_name(CutReason reason) noexcept;

}  // namespace sqmap::apps
