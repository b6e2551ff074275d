// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string_view>

namespace sqmap::apps {

/// What the records of `sqbake bake` are called: see bake.schema.json for when the version grows.
inline constexpr std::string_view kBakeSchemaName = "sqmap.bake/";
inline constexpr unsigned kBakeSchemaVersion = 3;
inline constexpr const char* kBakeSchema = "sqmap.bake/3";

}  // namespace sqmap::apps
