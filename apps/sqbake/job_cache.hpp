// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>

#include "bake_run.hpp"
#include "cache/bundle_cache.hpp"
#include "job_list.hpp"

namespace sqmap::apps {

/// The cache that the arguments and the environment name; none where they want none.
std::optional<BundleCache> open_cache(const BakeArguments& arguments);

/// What --explain says where there is none.
inline constexpr const char* kNoCache = "no cache is used: every mesh is baked";

/// A job whose settings are valid, as the cache knows it.
CacheRequest cache_request(const Job& job);

}  // namespace sqmap::apps
