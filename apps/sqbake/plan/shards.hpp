// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sqmap/asset/result.hpp"

namespace sqmap::apps {

/// One of the shares that a list of assets is dealt out to.
struct Shard {
  std::uint32_t index{};   ///< from 0
  std::uint32_t count{1};  ///< >= 1
};

/// "2/8" is the second of eight. "auto" takes the place in a job array from the environment: of Slurm
/// (SLURM_ARRAY_TASK_ID, _MIN, _STEP, _COUNT), or of a Kubernetes indexed job (JOB_COMPLETION_INDEX, and
/// JOB_COMPLETIONS, which the job must set). Errors: kBadOption.
Result<Shard> parse_shard(std::string_view text);

/// What "auto" says; nothing where no array's variables are set. Errors: kBadOption, for an array with gaps.
Result<std::optional<Shard>> shard_of_job_array();

struct WorkItem {
  std::string name;      ///< unique
  std::uint64_t cost{};  ///< expected, in any unit
};

/// The shard of each item: the costliest first, each to the shard that has least so far (no shard then
/// exceeds 4/3 of the best possible; Graham 1969). Depends on names and costs, not on the order of the list.
std::vector<std::uint32_t> deal_out(std::span<const WorkItem> items, std::uint32_t shard_count);

}  // namespace sqmap::apps
