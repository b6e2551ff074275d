// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <string_view>
#include <vector>

#include "bake_asset.hpp"

namespace sqmap::apps {

/// What a worker may take.
struct WorkerLimits {
  double timeout_s = 0;            ///< 0: none
  std::uint64_t memory_bytes = 0;  ///< 0: none
};

/// Bakes meshes in processes of their own, so that whatever a mesh does to the baker, only its own bake ends.
/// One thread uses it; the callbacks are called from wait().
class WorkerProcesses {
 public:
  struct Events {
    std::function<void(std::size_t index, std::string_view stage, double fraction)> progress;
    /// The worker is gone. Its verdict is never kCancelled but after kill_all().
    std::function<void(std::size_t index, BakeProduct product)> finished;
  };
  explicit WorkerProcesses(Events events);
  /// Kills what still runs.
  ~WorkerProcesses();
  WorkerProcesses(const WorkerProcesses&) = delete;
  WorkerProcesses& operator=(const WorkerProcesses&) = delete;

  /// Starts a worker; `index` is for the events. What keeps it from starting becomes its verdict.
  void start(std::size_t index, const BakeJob& job, const WorkerLimits& limits);
  std::size_t running_count() const noexcept;

  /// Returns after events, a signal, something to read from `wake_fd` (-1: none), or `longest`.
  void wait(std::chrono::milliseconds longest, int wake_fd = -1);

  /// Ends all workers and waits until they are gone. They write no files, so nothing is left half-done.
  void kill_all();

 private:
  class Worker;
  void finish(Worker& worker);

  Events events_;
  std::vector<std::unique_ptr<Worker>> workers_;
};

}  // namespace sqmap::apps
