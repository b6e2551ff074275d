// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "../job_list.hpp"
#include "shards.hpp"

namespace sqmap::apps {

/// The shard of each job. Every machine that lists the same meshes gets the same answer.
std::vector<std::uint32_t> shards_of(const JobList& list, std::uint32_t shard_count);

/// Leaves the jobs of one shard, in their order.
void keep_shard(JobList& list, const Shard& shard);

}  // namespace sqmap::apps
