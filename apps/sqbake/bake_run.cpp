// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake_run.hpp"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sqmap/io/bundle.hpp"

#include "../common/confinement.hpp"
#include "../common/files.hpp"
#include "cache/content_hash.hpp"
#include "depfile.hpp"
#include "job_cache.hpp"
#include "record_json.hpp"
#include "stop_signals.hpp"
#include "worker_pool.hpp"

namespace sqmap::apps {
namespace {

using Clock = std::chrono::steady_clock;

// How late a signal may be noticed that comes just before the loop begins to wait.
constexpr std::chrono::milliseconds kLongestWait{100};

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

std::vector<ProgressBoard::Item> board_items(const JobList& list) {
  std::vector<ProgressBoard::Item> items;
  for (const Job& job : list.jobs) items.push_back({job.name, job.input_bytes});
  return items;
}

RecordWriter::Options writer_options(const BakeArguments& arguments, const JobList& list) {
  std::size_t width = 0;
  for (const Job& job : list.jobs) width = std::max(width, job.name.size());
  return {arguments.format, arguments.quiet, arguments.verbose, list.single_file, width};
}

/// Says of a limit that was run into where it was given: that is where to raise it.
void name_the_limit(BakeRecord& record, const Job& job) {
  const char* setting = record.verdict == Verdict::kTimeout  ? "timeout"
                        : record.verdict == Verdict::kMemory ? "memory"
                                                             : nullptr;
  if (setting == nullptr || !record.error) return;
  const SettingValue& value = job.settings.find(setting)->second;
  if (value.text != "none")
    record.error->finding += fmt::format(" ({} {}, {})", setting, value.text, value.source);
}

/// Whether a file is a sound bundle, and not one that a fallback left.
bool holds_more_than_fallback(const std::filesystem::path& file) {
  const Result<Asset> asset = io::read(file);
  if (!asset) return false;
  const auto options = nlohmann::json::parse(asset.value().provenance.options_json, nullptr, false);
  return !options.contains("fallback");
}

BakeRecord cancelled(const char* finding) {
  BakeRecord record;
  record.verdict = Verdict::kCancelled;
  record.error = Error{Status::kCancelled, finding, ""};
  return record;
}

/// 0: none.
std::uint64_t memory_limit_bytes(const AssetOptions& options) {
  if (options.memory_bytes != kMemoryOfTheMachine) return options.memory_bytes;
  return may_bound_memory() ? physical_memory_bytes() : 0;
}

}  // namespace

BakeRun::BakeRun(Console& console, const BakeArguments& arguments, JobList list)
    : console_(console),
      arguments_(arguments),
      list_(std::move(list)),
      cache_(open_cache(arguments)),
      budget_(arguments.threads != 0 ? arguments.threads : available_threads(), std::getenv("MAKEFLAGS")),
      board_(console, arguments.quiet ? When::kNever : arguments.progress, board_items(list_)),
      writer_(console, writer_options(arguments, list_)),
      running_(list_.jobs.size()),
      records_(list_.jobs.size()),
      is_done_(list_.jobs.size(), false) {
  for (std::size_t index = 0; index < list_.jobs.size(); ++index) queue_.push_back({index, false});
}

void BakeRun::take_from_cache() {
  if (!cache_) {
    if (arguments_.explain) console_.note(kNoCache);
    return;
  }
  std::deque<Attempt> missed;
  for (const Attempt& attempt : queue_) {
    const std::size_t index = attempt.index;
    const Job& job = list_.jobs[index];
    const Clock::time_point start = Clock::now();
    const WriteGuard guard;
    if (stop_signal() != 0) return;
    CacheAnswer answer = cache_->lookup(cache_request(job));
    if (arguments_.explain)
      for (const std::string& reason : answer.reasons)
        console_.note(job.name + ": " + with_setting_names(reason));
    Result<BakeRecord> record = Error{Status::kBadOption, "", ""};
    if (answer.is_hit) record = parse_record(answer.record_json);
    if (!record) {
      running_[index].ticket = std::move(answer.ticket);
      missed.push_back(attempt);
      continue;
    }
    record.value().is_cached = true;
    record.value().hash = answer.object;
    record.value().seconds = seconds_since(start);
    record.value().times.clear();
    ++cached_;
    board_.skip(index);
    hand_in(index, std::move(record).value());
  }
  queue_ = std::move(missed);
}

void BakeRun::add_to_cache(std::size_t index, const BakeRecord& record) {
  const Running& running = running_[index];
  if (!cache_ || !running.ticket || running.is_fallback) return;
  const std::vector<std::filesystem::path> sides = side_files(list_.jobs[index].input);
  const Outcome kept = cache_->publish(*running.ticket, sides, record_line(record));
  if (kept || has_cache_warning_) return;
  has_cache_warning_ = true;  // one is enough: what keeps one bundle out mostly keeps all out
  console_.warning("cache: " + message_for(cache_->folder().string(), kept.error()));
}

BakeJob BakeRun::bake_job(const Attempt& attempt, unsigned threads) const {
  const Job& job = list_.jobs[attempt.index];
  return {job.input, texts_of(job.settings), threads, arguments_.verify_determinism, attempt.is_fallback};
}

bool BakeRun::is_stopping() const { return stop_signal() != 0 || (arguments_.fail_fast && has_failure_); }

void BakeRun::start_workers(WorkerProcesses& workers) {
  while (!queue_.empty() && !is_stopping()) {
    // With fewer meshes than threads each gets its share.
    const auto share = static_cast<unsigned>(std::max<std::size_t>(1, budget_.free_count() / queue_.size()));
    const unsigned threads = budget_.take(share);
    if (threads == 0) return;
    const Attempt attempt = queue_.front();
    queue_.pop_front();
    Running& running = running_[attempt.index];
    running.threads = threads;
    running.is_fallback = attempt.is_fallback;
    // The settings were checked when the jobs were listed.
    const AssetOptions options = options_from(texts_of(list_.jobs[attempt.index].settings)).value();
    workers.start(attempt.index, bake_job(attempt, threads),
                  {options.timeout_s, memory_limit_bytes(options)});
  }
}

void BakeRun::run_isolated() {
  WorkerProcesses workers({[this](std::size_t index, std::string_view stage, double fraction) {
                             board_.at(index, stage, fraction);
                           },
                           [this](std::size_t index, BakeProduct product) {
                             budget_.give_back(std::exchange(running_[index].threads, 0));
                             on_finished(index, std::move(product));
                           }});
  for (;;) {
    if (stop_signal() != 0) workers.kill_all();
    start_workers(workers);
    if (workers.running_count() == 0 && (queue_.empty() || is_stopping())) return;
    workers.wait(kLongestWait, queue_.empty() || is_stopping() ? -1 : budget_.wake_fd());
  }
}

void BakeRun::run_here() {
  const unsigned threads = std::max(1U, budget_.take(budget_.limit()));
  while (!queue_.empty() && !is_stopping()) {
    const Attempt attempt = queue_.front();
    queue_.pop_front();
    running_[attempt.index].is_fallback = attempt.is_fallback;
    bake::Progress progress;
    progress.report = [&](std::string_view stage, double fraction) {
      board_.at(attempt.index, stage, fraction);
    };
    progress.cancelled = [] { return stop_signal() != 0; };
    on_finished(attempt.index, bake_asset(bake_job(attempt, threads), progress));
  }
}

bool BakeRun::falls_back(std::size_t index, BakeRecord& record) {
  Running& running = running_[index];
  const bool is_worth_it =
      record.verdict == Verdict::kTimeout || record.verdict == Verdict::kMemory ||
      record.verdict == Verdict::kCrashed ||
      (record.verdict == Verdict::kFailed && record.error->status == Status::kBakeFailed);
  if (!is_worth_it || running.is_fallback || is_stopping()) return false;
  if (list_.jobs[index].settings.at("fallback").text == "none") return false;
  if (const std::filesystem::path& output = list_.jobs[index].output; holds_more_than_fallback(output)) {
    record.warnings.push_back(fmt::format(
        "no fallback is baked: {} holds an earlier bundle that is none, and is kept", output.string()));
    return false;
  }
  running.cause = record;
  queue_.push_front({index, true});
  return true;
}

void BakeRun::on_finished(std::size_t index, BakeProduct product) {
  name_the_limit(product.record, list_.jobs[index]);
  if (falls_back(index, product.record)) return;
  BakeRecord& record = product.record;
  if (const auto cause = std::exchange(running_[index].cause, std::nullopt)) {
    record.seconds += cause->seconds;
    if (record.has_bundle()) {
      record.verdict = Verdict::kDegraded;
      record.degradations.insert(
          record.degradations.begin(),
          {"fallback", fmt::format("one superquadric for the whole mesh ({}: {})",
                                   verdict_name(cause->verdict), cause->error->finding)});
    } else if (record.verdict != Verdict::kCancelled) {
      record.warnings.push_back(
          fmt::format("the fallback ended with {}: {}", verdict_name(record.verdict), record.error->finding));
      record.verdict = cause->verdict;
      record.error = cause->error;
    }
  }
  publish(index, std::move(product));
}

void BakeRun::publish(std::size_t index, BakeProduct product) {
  BakeRecord& record = product.record;
  if (record.has_bundle()) {
    const Clock::time_point start = Clock::now();
    const WriteGuard guard;
    if (stop_signal() != 0) {
      record = cancelled("stopped before the bundle was written");
    } else if (const Outcome written = write_file(list_.jobs[index].output, product.bundle); !written) {
      record.verdict = Verdict::kFailed;
      record.error = written.error();
    }
    if (record.has_bundle()) record.hash = content_hash(product.bundle);
    record.times.push_back({"write", seconds_since(start)});
    record.seconds += seconds_since(start);
    if (record.has_bundle()) add_to_cache(index, record);
  }
  board_.finished(index);
  hand_in(index, std::move(record));
}

void BakeRun::hand_in(std::size_t index, BakeRecord record) {
  const Job& job = list_.jobs[index];
  record.input = job.input.string();
  record.output = job.output.string();
  record.name = job.name;
  if (record.verdict != Verdict::kCancelled &&
      (!record.has_bundle() || (arguments_.strict && record.verdict == Verdict::kDegraded))) {
    has_failure_ = true;
    last_failure_ = record.has_bundle() ? Exit::kDegraded : exit_of(record);
  }
  records_[index] = std::move(record);
  is_done_[index] = true;
  for (; reported_ < records_.size() && is_done_[reported_]; ++reported_) {
    report(*records_[reported_], list_.jobs[reported_]);
    records_[reported_].reset();
  }
}

void BakeRun::report(BakeRecord& record, const Job& job) {
  if (!arguments_.report.empty()) record_lines_ += record_line(record);
  for (const std::string& warning : record.warnings) console_.warning(job.name + ": " + warning);
  for (const Degradation& item : record.degradations)
    console_.insist(fmt::format("{}: degraded: {}", job.name, item.finding));
  if (!record.has_bundle() && record.verdict != Verdict::kCancelled) {
    const bool is_plain = record.verdict == Verdict::kFailed;
    Error error = *record.error;
    if (!is_plain) error.finding = fmt::format("{}: {}", verdict_name(record.verdict), error.finding);
    console_.error(message_for(record.input, error));
  }
  writer_.add(record);
}

void BakeRun::cancel_rest() {
  while (!queue_.empty()) {
    const std::size_t index = queue_.front().index;
    queue_.pop_front();
    hand_in(index,
            cancelled(stop_signal() != 0 ? "stopped before it began" : "not begun: an earlier one failed"));
  }
}

void BakeRun::summarise(double seconds) {
  const std::size_t baked = writer_.count(Verdict::kOk) + writer_.count(Verdict::kDegraded);
  if (list_.single_file && writer_.count(Verdict::kCancelled) == 0) return;
  std::string summary = fmt::format("{} of {} baked", baked, list_.jobs.size());
  if (cached_ > 0) summary += fmt::format(", {} of them from the cache", cached_);
  for (const Verdict verdict : {Verdict::kDegraded, Verdict::kFailed, Verdict::kTimeout, Verdict::kMemory,
                                Verdict::kCrashed, Verdict::kCancelled})
    if (const std::size_t count = writer_.count(verdict); count > 0)
      summary +=
          fmt::format(", {} {}", count, verdict == Verdict::kCancelled ? "stopped" : verdict_name(verdict));
  console_.note(summary + fmt::format(" in {:.1f} s", seconds));
}

Exit BakeRun::exit_code() const {
  if (const int signal = stop_signal(); signal != 0) return static_cast<Exit>(128 + signal);
  if (!has_failure_) return Exit::kOk;
  return list_.single_file ? last_failure_ : Exit::kSomeFailed;
}

Exit BakeRun::run() {
  const Clock::time_point start = Clock::now();
  if (!budget_.remark().empty()) console_.note(budget_.remark());
  take_from_cache();
  if (arguments_.no_isolation) {
    run_here();
  } else {
    run_isolated();
  }
  cancel_rest();
  writer_.finish(seconds_since(start));
  summarise(seconds_since(start));
  return exit_code();
}

}  // namespace sqmap::apps
