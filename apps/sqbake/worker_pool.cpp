// SPDX-License-Identifier: GPL-3.0-or-later
#include "worker_pool.hpp"

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/task_arena.h>

namespace sqmap::apps {
namespace {

/// Quota over period of control group version 2, rounded up; `none` without a limit.
unsigned quota_threads(unsigned none) {
  std::ifstream file("/sys/fs/cgroup/cpu.max");
  std::string quota;
  double period_us = 0;
  if (!(file >> quota >> period_us) || quota == "max" || !(period_us > 0)) return none;
  const double threads = std::strtod(quota.c_str(), nullptr) / period_us;
  return threads > 0 && threads < none ? std::max(1U, static_cast<unsigned>(threads + 0.999)) : none;
}

}  // namespace

unsigned available_threads() {
  return quota_threads(static_cast<unsigned>(std::max(1, tbb::info::default_concurrency())));
}

void run_jobs(std::size_t count, unsigned threads, const std::function<void(std::size_t)>& job) {
  threads = std::max(1U, threads);
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  const auto workers = static_cast<unsigned>(std::clamp<std::size_t>(count, 1, threads));
  std::atomic<std::size_t> next{0};
  const auto work = [&](unsigned worker) {
    tbb::task_arena arena(static_cast<int>(threads / workers + (worker < threads % workers ? 1 : 0)));
    for (std::size_t index = next.fetch_add(1); index < count; index = next.fetch_add(1))
      arena.execute([&] { job(index); });
  };
  std::vector<std::jthread> helpers;
  for (unsigned i = 1; i < workers; ++i) helpers.emplace_back(work, i);
  work(0);
}

}  // namespace sqmap::apps
