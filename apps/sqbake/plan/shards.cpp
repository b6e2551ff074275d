// SPDX-License-Identifier: GPL-3.0-or-later
#include "shards.hpp"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <numeric>
#include <optional>
#include <tuple>

#include <fmt/format.h>

namespace sqmap::apps {
namespace {

constexpr std::uint32_t kMostShards = 1'000'000;

std::optional<std::uint32_t> number(std::string_view text) {
  std::uint32_t value = 0;
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
  return problem == std::errc() && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

std::optional<std::uint32_t> variable(const char* name) {
  const char* text = std::getenv(name);
  return text != nullptr ? number(text) : std::nullopt;
}

}  // namespace

Result<std::optional<Shard>> shard_of_job_array() {
  if (const auto id = variable("SLURM_ARRAY_TASK_ID"), count = variable("SLURM_ARRAY_TASK_COUNT");
      id && count) {
    const std::uint32_t first = variable("SLURM_ARRAY_TASK_MIN").value_or(0);
    const std::uint32_t step = std::max(1U, variable("SLURM_ARRAY_TASK_STEP").value_or(1));
    if (*id >= first && (*id - first) / step < *count)
      return std::optional<Shard>({(*id - first) / step, *count});
    return Error{
        Status::kBadOption,
        fmt::format("SLURM_ARRAY_TASK_ID={} is beyond the {} tasks from {} by {}", *id, *count, first, step),
        "use an array without gaps, such as --array=1-8, or say --shard I/N"};
  }
  if (const auto index = variable("JOB_COMPLETION_INDEX"), count = variable("JOB_COMPLETIONS");
      index && count) {
    if (*index < *count) return std::optional<Shard>({*index, *count});
    return Error{Status::kBadOption,
                 fmt::format("JOB_COMPLETION_INDEX={} is beyond JOB_COMPLETIONS={}", *index, *count),
                 "set JOB_COMPLETIONS to the job's number of completions"};
  }
  return std::optional<Shard>();
}

Result<Shard> parse_shard(std::string_view text) {
  if (text == "auto") {
    const Result<std::optional<Shard>> shard = shard_of_job_array();
    if (!shard) return shard.error();
    if (shard.value()) return *shard.value();
    return Error{
        Status::kBadOption, "--shard auto: this is no task of a job array",
        "start it by sbatch --array, set JOB_COMPLETION_INDEX and JOB_COMPLETIONS, or say --shard I/N"};
  }
  const std::size_t slash = text.find('/');
  if (slash != std::string_view::npos) {
    const auto index = number(text.substr(0, slash)), count = number(text.substr(slash + 1));
    if (index && count && *index >= 1 && *index <= *count && *count <= kMostShards)
      return Shard{*index - 1, *count};
  }
  return Error{Status::kBadOption,
               fmt::format("--shard {}: must be I/N with 1 <= I <= N <= {}, or auto", text, kMostShards), ""};
}

std::vector<std::uint32_t> deal_out(std::span<const WorkItem> items, std::uint32_t shard_count) {
  std::vector<std::size_t> order(items.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, [&](std::size_t a, std::size_t b) {
    return std::tie(items[b].cost, items[a].name) < std::tie(items[a].cost, items[b].name);
  });
  struct Load {
    std::uint64_t cost;
    std::uint32_t shard;
  };
  const auto is_heavier = [](const Load& a, const Load& b) {
    return std::tie(a.cost, a.shard) > std::tie(b.cost, b.shard);
  };
  std::vector<Load> heap;  // the lightest first; of equals, that with the lowest number
  for (std::uint32_t shard = 0; shard < shard_count; ++shard) heap.push_back({0, shard});
  std::vector<std::uint32_t> shard_of(items.size());
  for (const std::size_t item : order) {
    std::ranges::pop_heap(heap, is_heavier);
    shard_of[item] = heap.back().shard;
    heap.back().cost += items[item].cost;
    std::ranges::push_heap(heap, is_heavier);
  }
  return shard_of;
}

}  // namespace sqmap::apps
