// SPDX-License-Identifier: Apache-2.0
// The limits bite: each probe does in a child what the limits forbid, and the same child without them gets
// through.
#include "../../apps/common/confinement.hpp"

#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <new>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/ptrace.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include "../../apps/sqinfo/untrusted.hpp"

namespace sqmap::apps {
namespace {

constexpr std::uint64_t kGigabyte_bytes = std::uint64_t{1} << 30;
constexpr int kDone = 0, kFailed = 1, kNotConfined = 77;

using Act = std::function<bool()>;  ///< false: the system said no, and the process lives

/// How a child ends that is confined (null: is not) and then acts.
int status_after(const Confinement* bounds, const Act& act) {
  const pid_t child = fork();
  if (child == 0) {
    if (bounds != nullptr && !confine(*bounds)) _exit(kNotConfined);
    _exit(act() ? kDone : kFailed);
  }
  int status = 0;
  EXPECT_EQ(waitpid(child, &status, 0), child);
  return status;
}

bool ended_by(int status, int signal) { return WIFSIGNALED(status) && WTERMSIG(status) == signal; }
bool got_through(int status) { return WIFEXITED(status) && WEXITSTATUS(status) == kDone; }

bool reap(pid_t child) {
  if (child == 0) _exit(kDone);
  return child > 0 && waitpid(child, nullptr, 0) == child;
}

bool start_process() { return reap(static_cast<pid_t>(syscall(SYS_fork))); }
bool start_process_with_libc() { return reap(fork()); }
bool start_process_with_clone3() {
  struct {
    std::uint64_t flags, pidfd, child_tid, parent_tid, exit_signal, stack, stack_size, tls;
  } arguments{0, 0, 0, 0, SIGCHLD, 0, 0, 0};
  return reap(static_cast<pid_t>(syscall(SYS_clone3, &arguments, sizeof arguments)));
}
bool start_program() {
  char name[] = "/bin/true";
  char* const arguments[] = {name, nullptr};
  return execve(name, arguments, nullptr) == 0;  // does not return: /bin/true ends with 0
}
bool open_socket() { return socket(AF_INET, SOCK_STREAM, 0) >= 0 || errno != EPERM; }
bool open_socket_pair() {
  int ends[2];
  return socketpair(AF_UNIX, SOCK_STREAM, 0, ends) == 0;
}
bool signal_itself() { return kill(getpid(), 0) == 0; }
bool be_traced() { return ptrace(PTRACE_TRACEME, 0, nullptr, nullptr) == 0; }
bool start_thread() {
  bool ran = false;
  std::thread([&ran] { ran = true; }).join();
  return ran;
}
bool read_a_file() {
  const int file = open("/proc/self/stat", O_RDONLY | O_CLOEXEC);
  char byte = 0;
  return file >= 0 && read(file, &byte, 1) == 1;
}

struct Probe {
  const char* name;
  bool (*act)();
};
constexpr Probe kForbidden[] = {{"fork", start_process},
                                {"fork of the C library", start_process_with_libc},
                                {"execve", start_program},
                                {"socket", open_socket},
                                {"socketpair", open_socket_pair},
                                {"kill", signal_itself},
                                {"ptrace", be_traced}};

TEST(Confinement, WhatIsForbiddenEndsTheProcess) {
  for (const bool may_start_threads : {false, true}) {
    const Confinement bounds{.may_start_threads = may_start_threads};
    for (const Probe& probe : kForbidden) {
      SCOPED_TRACE(probe.name);
      EXPECT_TRUE(got_through(status_after(nullptr, probe.act)));
      EXPECT_TRUE(ended_by(status_after(&bounds, probe.act), SIGSYS));
    }
    EXPECT_TRUE(got_through(status_after(&bounds, read_a_file)));
  }
}

TEST(Confinement, ThreadsAreAllowedOnlyWhereAskedFor) {
  const Confinement strict, with_threads{.may_start_threads = true};
  EXPECT_TRUE(ended_by(status_after(&strict, start_thread), SIGSYS));
  EXPECT_TRUE(got_through(status_after(&with_threads, start_thread)));
}

TEST(Confinement, ThreadsAreConfinedAsWell) {
  const Confinement bounds{.may_start_threads = true};
  EXPECT_TRUE(ended_by(status_after(&bounds,
                                    [] {
                                      std::thread([] { start_process(); }).join();
                                      return true;
                                    }),
                       SIGSYS));
}

TEST(Confinement, TheOtherWayToForkIsClosed) {
  const Confinement strict, with_threads{.may_start_threads = true};
  EXPECT_TRUE(ended_by(status_after(&strict, start_process_with_clone3), SIGSYS));
  EXPECT_TRUE(got_through(status_after(&with_threads, [] {
    return !start_process_with_clone3() && errno == ENOSYS;  // so that the C library takes clone for threads
  })));
}

/// True when the memory could be had. Nothing of it is touched.
bool allocate(std::uint64_t bytes) {
  void* const block = std::malloc(bytes);
  // Else the compiler may leave out both calls.
  asm volatile("" : : "r"(block) : "memory");
  std::free(block);
  return block != nullptr;
}

TEST(Confinement, MemoryIsBounded) {
  if (!may_bound_memory()) GTEST_SKIP() << "the sanitizer's own maps exceed any bound";
  for (const Confinement& bounds :
       {Confinement{.address_bytes = 3 * kGigabyte_bytes}, Confinement{.heap_bytes = 3 * kGigabyte_bytes}}) {
    EXPECT_TRUE(got_through(status_after(&bounds, [] { return allocate(kGigabyte_bytes); })));
    EXPECT_TRUE(got_through(status_after(&bounds, [] { return !allocate(4 * kGigabyte_bytes); })));
  }
}

TEST(Confinement, ProcessorTimeIsBounded) {
  const Confinement bounds{.cpu_s = 1};
  const int status = status_after(&bounds, [] {
    timespec used{};
    while (used.tv_sec < 10) clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
    return true;
  });
  EXPECT_TRUE(ended_by(status, SIGXCPU) || ended_by(status, SIGKILL));
}

TEST(Confinement, TheMachineHasMemory) { EXPECT_GT(physical_memory_bytes(), kGigabyte_bytes / 4); }

/// Exit code and what was said of "stranger.h5" when its reader acts like this.
struct Verdict {
  Exit exit;
  std::string said;
};

Verdict untrusted(const std::function<Exit(Console&)>& command) {
  Console console("sqinfo");
  testing::internal::CaptureStderr();
  const Exit exit = run_untrusted(console, "stranger.h5", command);
  return {exit, testing::internal::GetCapturedStderr()};
}

void expect_refused(const Verdict& verdict, std::string_view why) {
  EXPECT_EQ(verdict.exit, Exit::kBadInput);
  EXPECT_NE(verdict.said.find("stranger.h5"), std::string::npos) << verdict.said;
  EXPECT_NE(verdict.said.find(why), std::string::npos) << verdict.said;
}

TEST(Untrusted, AReaderTakenOverByItsFileIsStopped) {
  for (const Probe& probe : kForbidden) {
    SCOPED_TRACE(probe.name);
    expect_refused(untrusted([&](Console&) { return probe.act() ? Exit::kOk : Exit::kUsage; }),
                   "ask the system");
  }
  expect_refused(untrusted([](Console&) { return start_thread() ? Exit::kOk : Exit::kUsage; }),
                 "ask the system");
}

TEST(Untrusted, AReaderThatWantsFourGigabytesIsRefused) {
  if (!may_bound_memory()) GTEST_SKIP() << "the sanitizer's own maps exceed any bound";
  expect_refused(untrusted([](Console&) {
                   const std::vector<char> block(4 * kGigabyte_bytes);
                   return block.back() == 0 ? Exit::kOk : Exit::kUsage;
                 }),
                 "memory");
}

TEST(Untrusted, AReaderThatDoesItsWorkIsLeftAlone) {
  const Verdict verdict = untrusted([](Console& console) {
    console.warning("seen");
    return read_a_file() ? Exit::kDifferent : Exit::kUsage;
  });
  EXPECT_EQ(verdict.exit, Exit::kDifferent);
  EXPECT_NE(verdict.said.find("seen"), std::string::npos);
}

}  // namespace
}  // namespace sqmap::apps
