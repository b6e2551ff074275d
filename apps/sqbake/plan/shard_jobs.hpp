// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "../../common/console.hpp"
#include "../job_list.hpp"
#include "shards.hpp"

namespace sqmap::apps {

/// What each job is expected to take. `records`: of earlier bakes, which know it; may be empty. Warns where
/// they tell of none of the meshes. Errors: those of read_asset_records().
Result<std::vector<std::uint64_t>> costs_of(Console& console, const JobList& list,
                                            const std::filesystem::path& records);

/// The shard of each job. Every machine that has the same meshes and costs gets the same answer.
std::vector<std::uint32_t> shards_of(const JobList& list, const std::vector<std::uint64_t>& costs,
                                     std::uint32_t shard_count);

/// Leaves the jobs of one shard, in their order.
void keep_shard(JobList& list, const std::vector<std::uint64_t>& costs, const Shard& shard);

}  // namespace sqmap::apps
