// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <deque>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "../common/console.hpp"
#include "bake_asset.hpp"
#include "cache/bundle_cache.hpp"
#include "job_list.hpp"
#include "progress_board.hpp"
#include "records.hpp"
#include "thread_budget.hpp"
#include "worker_processes.hpp"

namespace sqmap::apps {

struct BakeArguments {
  JobRequest request;
  unsigned threads = 0;  ///< 0: as many as this process may use
  RecordFormat format = RecordFormat::kText;
  When progress = When::kAuto;
  bool quiet = false;
  bool verbose = false;
  bool dry_run = false;
  bool fail_fast = false;
  bool strict = false;  ///< degraded bundles are failures of the run
  bool verify_determinism = false;
  bool no_isolation = false;
  std::filesystem::path depfile;
  std::filesystem::path report;  ///< HTML page to write; empty: none
  std::string shard;             ///< as parse_shard() takes it; empty: bake all
  std::filesystem::path costs;   ///< records that tell what meshes took, for shards; empty: sizes count
  std::filesystem::path cache;   ///< folder of the cache; empty: the default one
  bool use_cache = true;
  bool explain = false;  ///< say why each mesh is baked, or is not
};

/// Bakes a list of jobs, each in a worker process, as many side by side as there are threads, unless the
/// cache has their bundles. This process alone writes bundles; it reports the jobs in their order.
class BakeRun {
 public:
  BakeRun(Console& console, const BakeArguments& arguments, JobList list);

  Exit run();
  /// The records of the finished run, as NDJSON; empty unless a report was asked for.
  const std::string& record_lines() const noexcept { return record_lines_; }

 private:
  struct Attempt {
    std::size_t index;
    bool is_fallback;
  };

  /// Takes what the cache holds; the others stay in the queue.
  void take_from_cache();
  void add_to_cache(std::size_t index, const BakeRecord& record);
  BakeJob bake_job(const Attempt& attempt, unsigned threads) const;
  void run_isolated();
  void run_here();
  void start_workers(WorkerProcesses& workers);
  void on_finished(std::size_t index, BakeProduct product);
  /// True: the plain bake takes its place in the queue. Not where a better bundle is there already, which the
  /// record is told then.
  bool falls_back(std::size_t index, BakeRecord& record);
  void publish(std::size_t index, BakeProduct product);
  void hand_in(std::size_t index, BakeRecord record);
  void report(BakeRecord& record, const Job& job);
  void cancel_rest();
  void summarise(double seconds);
  bool is_stopping() const;
  Exit exit_code() const;

  struct Running {
    unsigned threads = 0;
    bool is_fallback = false;
    std::optional<BakeRecord> cause;    ///< what the plain bake stands in for
    std::optional<CacheTicket> ticket;  ///< of a lookup that found nothing
  };

  Console& console_;
  const BakeArguments& arguments_;
  JobList list_;
  std::optional<BundleCache> cache_;
  ThreadBudget budget_;
  ProgressBoard board_;
  RecordWriter writer_;
  std::deque<Attempt> queue_;
  std::vector<Running> running_;                    ///< of each job
  std::vector<std::optional<BakeRecord>> records_;  ///< finished, not yet reported
  std::vector<bool> is_done_;
  std::size_t reported_ = 0;
  std::string record_lines_;
  bool has_failure_ = false, has_cache_warning_ = false;
  std::size_t cached_ = 0;
  Exit last_failure_ = Exit::kOk;
};

}  // namespace sqmap::apps
