// SPDX-License-Identifier: GPL-3.0-or-later
// What passes between sqbake and its worker processes. The worker is started as `sqbake worker MESH`: a path
// is any bytes, JSON is not. Its standard input and output are one socket.
//
//   to the worker      one line: the job
//   from the worker    lines: {"stage":S,"fraction":F} as it goes on, {"memory":true} when an allocation
//   failed,
//                      at last the record of the asset with "bundle_bytes":N, and N bytes
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "sqmap/asset/result.hpp"

#include "bake_asset.hpp"

namespace sqmap::apps {

inline constexpr const char* kWorkerCommand = "worker";
inline constexpr std::string_view kMemoryLine = "{\"memory\":true}\n";

struct WorkerJob {
  BakeJob bake;
  std::uint64_t memory_bytes = 0;  ///< 0: no limit
  std::int64_t parent_pid = 0;     ///< the worker ends when this process does
};

std::string job_line(const WorkerJob& job);
Result<WorkerJob> parse_job(std::string_view line);

std::string progress_line(std::string_view stage, double fraction);

/// A line from the worker.
struct WorkerMessage {
  enum class Kind { kProgress, kMemory, kRecord };
  Kind kind = Kind::kProgress;
  std::string stage;
  double fraction = 0;
  BakeRecord record;
  std::uint64_t bundle_bytes = 0;
};
std::string product_line(const BakeProduct& product);
Result<WorkerMessage> parse_message(std::string_view line);

}  // namespace sqmap::apps
