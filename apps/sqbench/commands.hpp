// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>

#include "../common/program.hpp"

namespace sqmap::apps {

std::function<Exit(Console&)> declare_run(CLI::App& app);
std::function<Exit(Console&)> declare_draw(CLI::App& app);

}  // namespace sqmap::apps
