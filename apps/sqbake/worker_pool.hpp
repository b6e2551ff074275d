// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <functional>

namespace sqmap::apps {

/// Processors this process may use: its affinity mask, limited by the CPU quota of its control group.
unsigned available_threads();

/// Calls job(0) .. job(count - 1), started in this order, with at most `threads` threads busy in total: jobs
/// run side by side, and when there are fewer jobs than threads, the parallel loops inside a job share the
/// rest. `job` must not throw.
void run_jobs(std::size_t count, unsigned threads, const std::function<void(std::size_t)>& job);

}  // namespace sqmap::apps
