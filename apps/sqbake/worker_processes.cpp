// SPDX-License-Identifier: GPL-3.0-or-later
#include "worker_processes.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <optional>
#include <string>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "worker_messages.hpp"

namespace sqmap::apps {
namespace {

using Clock = std::chrono::steady_clock;

// What a crashing worker said last, for the message.
constexpr std::size_t kLastWords_bytes = 400;
// A line longer than this is no message of ours.
constexpr std::size_t kLongestLine_bytes = std::size_t{64} << 20;

class Fd {
 public:
  Fd() = default;
  explicit Fd(int fd) noexcept : fd_(fd) {}
  Fd(Fd&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Fd& operator=(Fd&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~Fd() {
    if (fd_ >= 0) ::close(fd_);
  }
  int get() const noexcept { return fd_; }
  void close() noexcept { *this = Fd(); }

 private:
  int fd_ = -1;
};

std::string last_line(const std::string& text) {
  const std::size_t end = text.find_last_not_of(" \n\r\t");
  if (end == std::string::npos) return "";
  const std::size_t start = text.find_last_of('\n', end);
  return text.substr(start == std::string::npos ? 0 : start + 1,
                     end - (start == std::string::npos ? 0 : start + 1) + 1);
}

/// Everything that can be read now, appended. False at the end of the stream.
bool drain(int fd, std::string& to) {
  std::array<char, 65536> buffer;
  for (;;) {
    const ssize_t count = ::recv(fd, buffer.data(), buffer.size(), MSG_DONTWAIT);
    if (count > 0) {
      to.append(buffer.data(), static_cast<std::size_t>(count));
    } else if (count < 0 && errno == EINTR) {
      continue;
    } else {
      return count < 0 && errno == EAGAIN;
    }
  }
}

/// A pair of connected sockets, closed on exec.
bool make_channel(Fd& ours, Fd& theirs) {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) return false;
  ours = Fd(ends[0]);
  theirs = Fd(ends[1]);
  return true;
}

/// 0 or errno.
int spawn_self(const std::string& mesh, int channel, int errors, pid_t& pid) {
  posix_spawn_file_actions_t actions;
  posix_spawnattr_t attributes;
  if (const int code = ::posix_spawn_file_actions_init(&actions); code != 0) return code;
  if (const int code = ::posix_spawnattr_init(&attributes); code != 0) {
    ::posix_spawn_file_actions_destroy(&actions);
    return code;
  }
  ::posix_spawn_file_actions_adddup2(&actions, channel, STDIN_FILENO);
  ::posix_spawn_file_actions_adddup2(&actions, channel, STDOUT_FILENO);
  ::posix_spawn_file_actions_adddup2(&actions, errors, STDERR_FILENO);
  sigset_t set;
  sigemptyset(&set);
  ::posix_spawnattr_setsigmask(&attributes, &set);
  for (const int signal : {SIGTERM, SIGALRM, SIGPIPE, SIGXFSZ}) sigaddset(&set, signal);
  ::posix_spawnattr_setsigdefault(&attributes, &set);
  ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  std::string program = "sqbake", command = kWorkerCommand, argument = mesh;
  std::array<char*, 4> arguments{program.data(), command.data(), argument.data(), nullptr};
  const int code = ::posix_spawn(&pid, "/proc/self/exe", &actions, &attributes, arguments.data(), environ);
  ::posix_spawnattr_destroy(&attributes);
  ::posix_spawn_file_actions_destroy(&actions);
  return code;
}

BakeProduct ended(Verdict verdict, std::string finding, std::string remedy) {
  BakeProduct product;
  product.record.verdict = verdict;
  product.record.error = Error{Status::kBakeFailed, std::move(finding), std::move(remedy)};
  return product;
}

}  // namespace

class WorkerProcesses::Worker {
 public:
  Worker(std::size_t number, const WorkerLimits& bounds)
      : index(number), limits(bounds), start(Clock::now()) {}

  /// 0 or errno.
  int spawn(const BakeJob& job);
  /// Reads what has come. Reports progress.
  void read(const Events& events);
  bool has_exited();
  void kill() const { ::kill(pid_, SIGKILL); }
  /// After has_exited().
  BakeProduct product();

  std::size_t index;
  WorkerLimits limits;
  Clock::time_point start;
  std::optional<BakeProduct> failure;  ///< it never ran
  bool is_late = false, is_killed = false;
  Fd channel, errors, process;

 private:
  void take_lines(const Events& events);
  BakeProduct crashed() const;

  pid_t pid_ = -1;
  int status_ = 0;
  std::string unread_, said_, stage_;
  bool is_out_of_memory_ = false;
  std::optional<WorkerMessage> last_;
};

int WorkerProcesses::Worker::spawn(const BakeJob& job) {
  Fd their_channel, their_errors;
  if (!make_channel(channel, their_channel) || !make_channel(errors, their_errors)) return errno;
  if (const int code = spawn_self(job.input.string(), their_channel.get(), their_errors.get(), pid_);
      code != 0)
    return code;
  // The declaration in <sys/pidfd.h> of glibc 2.36 is not usable from C++.
  process = Fd(static_cast<int>(::syscall(SYS_pidfd_open, pid_, 0)));
  if (process.get() < 0) {
    const int code = errno;
    kill();
    ::waitpid(pid_, nullptr, 0);
    return code;
  }
  // Fits the socket's buffer; a worker that is gone already is found out by its exit.
  const std::string line = job_line({job, limits.memory_bytes, ::getpid()});
  ::send(channel.get(), line.data(), line.size(), MSG_NOSIGNAL);
  return 0;
}

void WorkerProcesses::Worker::read(const Events& events) {
  if (channel.get() >= 0 && !drain(channel.get(), unread_)) channel.close();
  if (errors.get() >= 0 && !drain(errors.get(), said_)) errors.close();
  if (said_.size() > kLastWords_bytes) said_.erase(0, said_.size() - kLastWords_bytes);
  take_lines(events);
}

void WorkerProcesses::Worker::take_lines(const Events& events) {
  std::size_t at = 0;
  while (!last_) {
    const std::size_t end = unread_.find('\n', at);
    if (end == std::string::npos) break;
    Result<WorkerMessage> message = parse_message(std::string_view(unread_).substr(at, end - at));
    at = end + 1;
    if (!message) continue;  // torn by a dying worker; its exit tells the rest
    switch (message.value().kind) {
      case WorkerMessage::Kind::kProgress:
        stage_ = message.value().stage;
        events.progress(index, stage_, message.value().fraction);
        break;
      case WorkerMessage::Kind::kMemory:
        is_out_of_memory_ = true;
        break;
      case WorkerMessage::Kind::kRecord:
        last_ = std::move(message).value();
        break;
    }
  }
  unread_.erase(0, at);
  if (!last_ && unread_.size() > kLongestLine_bytes) kill();
}

bool WorkerProcesses::Worker::has_exited() { return ::waitpid(pid_, &status_, WNOHANG) == pid_; }

BakeProduct WorkerProcesses::Worker::crashed() const {
  std::string how = WIFSIGNALED(status_) ? fmt::format("ended by signal {} ({})", WTERMSIG(status_),
                                                       ::strsignal(WTERMSIG(status_)))
                                         : fmt::format("ended with exit code {}", WEXITSTATUS(status_));
  if (!stage_.empty()) how += " in stage " + stage_;
  if (const std::string words = last_line(said_); !words.empty()) how += ", after saying: " + words;
  return ended(Verdict::kCrashed, "the baker " + how,
               WIFSIGNALED(status_) && WTERMSIG(status_) == SIGKILL
                   ? "the system does that when memory runs out; bake fewer meshes at once (-j)"
                   : "report this with the mesh; sqbake check may say what is wrong with it");
}

BakeProduct WorkerProcesses::Worker::product() {
  if (failure) return std::move(*failure);
  if (last_ && unread_.size() == last_->bundle_bytes && WIFEXITED(status_) && WEXITSTATUS(status_) == 0) {
    BakeProduct product{std::move(last_->record), {unread_.begin(), unread_.end()}};
    if (product.record.verdict != Verdict::kMemory) return product;
    is_out_of_memory_ = true;
  }
  if (is_killed) return ended(Verdict::kCancelled, "stopped", "");
  if (is_out_of_memory_)
    return limits.memory_bytes == 0
               ? ended(Verdict::kMemory, "out of memory", "bake fewer meshes at once (-j), or a smaller mesh")
               : ended(Verdict::kMemory,
                       fmt::format("needs more memory than the {} MiB of --memory{}",
                                   limits.memory_bytes >> 20, stage_.empty() ? "" : ", in stage " + stage_),
                       "raise --memory, or bake a smaller mesh");
  if (is_late)
    return ended(Verdict::kTimeout,
                 fmt::format("not done after the {:g} s of --timeout{}", limits.timeout_s,
                             stage_.empty() ? "" : ", in stage " + stage_),
                 "raise --timeout, or bake a smaller mesh");
  return crashed();
}

WorkerProcesses::WorkerProcesses(Events events) : events_(std::move(events)) {}

WorkerProcesses::~WorkerProcesses() {
  events_ = {[](std::size_t, std::string_view, double) {}, [](std::size_t, const BakeProduct&) {}};
  kill_all();
}

void WorkerProcesses::start(std::size_t index, const BakeJob& job, const WorkerLimits& limits) {
  auto worker = std::make_unique<Worker>(index, limits);
  if (const int code = worker->spawn(job); code != 0)
    worker->failure = ended(Verdict::kFailed, fmt::format("no process for it: {}", std::strerror(code)),
                            "bake fewer meshes at once (-j)");
  workers_.push_back(std::move(worker));
}

std::size_t WorkerProcesses::running_count() const noexcept { return workers_.size(); }

void WorkerProcesses::wait(std::chrono::milliseconds longest, int wake_fd) {
  std::vector<pollfd> polled;
  if (wake_fd >= 0) polled.push_back({wake_fd, POLLIN, 0});
  auto left = longest;
  for (const auto& worker : workers_) {
    for (const Fd* fd : {&worker->process, &worker->channel, &worker->errors})
      if (fd->get() >= 0) polled.push_back({fd->get(), POLLIN, 0});
    if (worker->failure) left = std::chrono::milliseconds(0);
  }
  ::poll(polled.data(), static_cast<nfds_t>(polled.size()), static_cast<int>(left.count()));

  std::vector<std::unique_ptr<Worker>> gone;
  for (auto& worker : workers_) {
    const bool has_exited = worker->failure || worker->has_exited();
    worker->read(events_);  // after the exit is known: then this is the last there is
    const double age_s = std::chrono::duration<double>(Clock::now() - worker->start).count();
    if (!has_exited && worker->limits.timeout_s > 0 && age_s >= worker->limits.timeout_s &&
        !worker->is_late) {
      worker->is_late = true;
      worker->kill();
    }
    if (has_exited) gone.push_back(std::move(worker));
  }
  std::erase(workers_, nullptr);
  for (const auto& worker : gone) finish(*worker);
}

void WorkerProcesses::finish(Worker& worker) {
  BakeProduct product = worker.product();
  product.record.seconds = std::chrono::duration<double>(Clock::now() - worker.start).count();
  events_.finished(worker.index, std::move(product));
}

void WorkerProcesses::kill_all() {
  for (const auto& worker : workers_) {
    worker->is_killed = true;
    if (!worker->failure) worker->kill();
  }
  while (!workers_.empty()) wait(std::chrono::milliseconds(100));
}

}  // namespace sqmap::apps
