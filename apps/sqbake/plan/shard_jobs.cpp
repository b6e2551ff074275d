// SPDX-License-Identifier: GPL-3.0-or-later
#include "shard_jobs.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "../../common/json_text.hpp"
#include "costs.hpp"

namespace sqmap::apps {

Result<std::vector<std::uint64_t>> costs_of(Console& console, const JobList& list,
                                            const std::filesystem::path& records) {
  std::vector<InputFile> inputs;
  for (const Job& job : list.jobs) inputs.push_back({json_name(job.input.string()), job.input_bytes});
  BakeTimes times;
  if (!records.empty()) {
    const Result<AssetRecords> read = read_asset_records(records);
    if (!read) return read.error();
    times = bake_times(read.value().records);
    const auto is_known = [&](const InputFile& input) { return times.contains(input.name); };
    if (std::ranges::none_of(inputs, is_known))
      console.warning(
          fmt::format("--costs {}: tells of no bake of these meshes, so sizes count", records.string()));
  }
  return expected_costs(inputs, times);
}

std::vector<std::uint32_t> shards_of(const JobList& list, const std::vector<std::uint64_t>& costs,
                                     std::uint32_t shard_count) {
  std::vector<WorkItem> items;
  for (std::size_t k = 0; k < list.jobs.size(); ++k)
    items.push_back({list.jobs[k].output.generic_string(), costs[k]});
  return deal_out(items, shard_count);
}

void keep_shard(JobList& list, const std::vector<std::uint64_t>& costs, const Shard& shard) {
  const std::vector<std::uint32_t> shard_of = shards_of(list, costs, shard.count);
  std::vector<Job> kept;
  for (std::size_t k = 0; k < list.jobs.size(); ++k)
    if (shard_of[k] == shard.index) kept.push_back(std::move(list.jobs[k]));
  list.jobs = std::move(kept);
}

}  // namespace sqmap::apps
