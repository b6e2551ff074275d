// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>

#include "../common/program.hpp"

namespace sqmap::apps {

std::function<Exit(Console&)> declare_bake(CLI::App& app);
std::function<Exit(Console&)> declare_check(CLI::App& app);
std::function<Exit(Console&)> declare_cache(CLI::App& app);
std::function<Exit(Console&)> declare_config(CLI::App& app);
std::function<Exit(Console&)> declare_report(CLI::App& app);
std::function<Exit(Console&)> declare_plan(CLI::App& app);
std::function<Exit(Console&)> declare_merge(CLI::App& app);

}  // namespace sqmap::apps
