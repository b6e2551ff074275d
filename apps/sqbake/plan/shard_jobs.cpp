// SPDX-License-Identifier: GPL-3.0-or-later
#include "shard_jobs.hpp"

#include <utility>

namespace sqmap::apps {

std::vector<std::uint32_t> shards_of(const JobList& list, std::uint32_t shard_count) {
  std::vector<WorkItem> items;
  for (const Job& job : list.jobs) items.push_back({job.output.generic_string(), job.input_bytes});
  return deal_out(items, shard_count);
}

void keep_shard(JobList& list, const Shard& shard) {
  const std::vector<std::uint32_t> shard_of = shards_of(list, shard.count);
  std::vector<Job> kept;
  for (std::size_t k = 0; k < list.jobs.size(); ++k)
    if (shard_of[k] == shard.index) kept.push_back(std::move(list.jobs[k]));
  list.jobs = std::move(kept);
}

}  // namespace sqmap::apps
