// SPDX-License-Identifier: GPL-3.0-or-later
// The worker's side: bakes one mesh, tells how it goes on, hands the bundle over. It writes no file, so it
// can be killed at any moment.
#include "worker.hpp"

#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <new>
#include <string>
#include <string_view>

#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include "../common/confinement.hpp"
#include "worker_messages.hpp"

namespace sqmap::apps {
namespace {

// A reader that redraws ten times a second has no use for more.
constexpr std::chrono::milliseconds kReportInterval{100};

std::atomic<bool> ran_out_of_memory{false};

bool send(std::string_view text) {
  while (!text.empty()) {
    const ssize_t count = ::write(STDOUT_FILENO, text.data(), text.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(count));
  }
  return true;
}

/// Called by operator new. Libraries may turn what follows into an abort or into another error, so the parent
/// hears of it first.
void on_exhausted_memory() {
  if (!ran_out_of_memory.exchange(true)) send(kMemoryLine);
  throw std::bad_alloc();
}

std::string read_line() {
  std::string line;
  char c = 0;
  for (;;) {
    const ssize_t count = ::read(STDIN_FILENO, &c, 1);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0 || c == '\n') return line;
    line += c;
  }
}

/// TBB's stack of a thread. Its address range counts for the limit, though a bake touches next to none of it;
/// so it comes on top, and a mesh needs no more memory where there are more threads.
constexpr std::uint64_t kThreadStack_bytes = std::uint64_t{4} << 20;

/// Private writable memory: heap and mappings. Not RLIMIT_AS, which also counts libraries and the address
/// ranges that malloc reserves for each thread without using them.
bool limit_memory(std::uint64_t bytes, unsigned threads) {
  const std::uint64_t with_stacks = bytes + threads * kThreadStack_bytes;
  const rlimit limit{with_stacks, with_stacks};
  return ::setrlimit(RLIMIT_DATA, &limit) == 0;
}

void no_core_dump() {
  const rlimit none{0, 0};
  ::setrlimit(RLIMIT_CORE, &none);
}

}  // namespace

int run_worker(const char* mesh) {
  std::signal(SIGINT,
              SIG_IGN);  // Ctrl-C goes to the whole group; the parent decides what becomes of the workers
  const Result<WorkerJob> parsed = parse_job(read_line());
  if (!parsed) return static_cast<int>(Exit::kUsage);
  WorkerJob job = parsed.value();
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != job.parent_pid)
    return static_cast<int>(Exit::kTerminated);  // it died before the line above
  no_core_dump();
  if (job.memory_bytes > 0 && !limit_memory(job.memory_bytes, job.bake.threads))
    return static_cast<int>(Exit::kInternal);
  // Parsers of a dozen formats are about to read a file of who knows whom. Where the system has no such
  // filter the bake goes on without.
  deny_system_calls(true);
  std::set_new_handler(on_exhausted_memory);
  job.bake.input = mesh;

  using Clock = std::chrono::steady_clock;
  std::string last_stage;
  Clock::time_point last_report{};
  bake::Progress progress;
  progress.report = [&](std::string_view stage, double fraction) {
    const Clock::time_point now = Clock::now();
    if (stage == last_stage && now - last_report < kReportInterval) return;
    last_stage = stage;
    last_report = now;
    send(progress_line(stage, fraction));
  };
  BakeProduct product = bake_asset(job.bake, progress);
  if (ran_out_of_memory) {  // and something made do without: what it gave is not what any other run would
                            // give
    product.bundle.clear();
    product.record.verdict = Verdict::kMemory;
    product.record.error = Error{Status::kBakeFailed, "out of memory", ""};
  }
  const bool is_sent = send(product_line(product)) &&
                       send({reinterpret_cast<const char*>(product.bundle.data()), product.bundle.size()});
  // Static destructors of a dozen libraries have nothing to add.
  ::_exit(is_sent ? 0 : static_cast<int>(Exit::kFileAccess));
}

}  // namespace sqmap::apps
