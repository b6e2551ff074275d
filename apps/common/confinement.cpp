// SPDX-License-Identifier: Apache-2.0
#include "confinement.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <exception>
#include <new>
#include <system_error>
#include <vector>

#include <fmt/format.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

namespace sqmap::apps {
namespace {

bool limit(int resource, rlim_t most) {
  rlimit now{};
  if (getrlimit(static_cast<__rlimit_resource>(resource), &now) != 0) return false;
  now.rlim_max = now.rlim_max < most ? now.rlim_max : most;
  now.rlim_cur = now.rlim_max;
  return setrlimit(static_cast<__rlimit_resource>(resource), &now) == 0;
}

bool limit_memory(int resource, std::uint64_t bytes) {
  return bytes == 0 || !may_bound_memory() || limit(resource, bytes);
}

#if defined(__x86_64__)
// A list of what is denied, not of what is allowed: libraries differ in the calls they make to read and
// print. clone and clone3 come on top.
constexpr std::array<std::uint32_t, 14> kDenied{SYS_execve,
                                                SYS_execveat,
                                                SYS_fork,
                                                SYS_vfork,
                                                SYS_ptrace,
                                                SYS_kill,
                                                SYS_tkill,
                                                SYS_socket,
                                                SYS_connect,
                                                SYS_sendto,
                                                SYS_socketpair,
                                                SYS_process_vm_readv,
                                                SYS_process_vm_writev,
                                                SYS_bpf};

std::vector<sock_filter> filter_program(bool may_start_threads) {
  constexpr std::uint32_t kX32Calls = 0x40000000;  // the same calls under other numbers
  std::vector<sock_filter> program;
  const auto load = [&](std::size_t offset) {
    program.push_back({BPF_LD | BPF_W | BPF_ABS, 0, 0, static_cast<std::uint32_t>(offset)});
  };
  /// Goes on with the next instruction if the test holds, else leaves out `count` of them.
  const auto unless_skip = [&](unsigned test, std::uint32_t value, std::uint8_t count) {
    program.push_back({static_cast<std::uint16_t>(BPF_JMP | test | BPF_K), 0, count, value});
  };
  const auto end = [&](std::uint32_t how) { program.push_back({BPF_RET | BPF_K, 0, 0, how}); };

  load(offsetof(seccomp_data, arch));
  program.push_back({BPF_JMP | BPF_JEQ | BPF_K, 1, 0, AUDIT_ARCH_X86_64});
  end(SECCOMP_RET_KILL_PROCESS);
  load(offsetof(seccomp_data, nr));
  unless_skip(BPF_JGE, kX32Calls, 1);
  end(SECCOMP_RET_KILL_PROCESS);
  for (const std::uint32_t call : kDenied) {
    unless_skip(BPF_JEQ, call, 1);
    end(SECCOMP_RET_KILL_PROCESS);
  }
  // A filter cannot look at the flags of clone3, which lie in memory; without it the C library takes clone.
  unless_skip(BPF_JEQ, SYS_clone3, 1);
  end(may_start_threads ? SECCOMP_RET_ERRNO | ENOSYS : SECCOMP_RET_KILL_PROCESS);
  unless_skip(BPF_JEQ, SYS_clone, 4);
  load(offsetof(seccomp_data, args));  // the flags, their lower half
  unless_skip(BPF_JSET, may_start_threads ? CLONE_THREAD : 0, 1);
  end(SECCOMP_RET_ALLOW);
  end(SECCOMP_RET_KILL_PROCESS);
  end(SECCOMP_RET_ALLOW);
  return program;
}
#endif

Exit hostile(Console& console, const ConfinedCommand& command, const std::string& what) {
  console.error(message_for(command.files, {Status::kInvalidAsset, what, command.remedy}));
  return Exit::kBadInput;
}

[[noreturn]] void run_child(Console& console, const ConfinedCommand& command) {
  Exit code = Exit::kInternal;
  try {
    if (confine(command.bounds)) {
      code = command.run(console);
    } else {
      console.error("the system refuses to confine a child process");
    }
  } catch (const std::bad_alloc&) {
    const std::uint64_t most = std::max(command.bounds.address_bytes, command.bounds.heap_bytes);
    code = hostile(console, command,
                   most > 0 ? fmt::format("needs more than {} bytes of memory", most) : "out of memory");
  } catch (const std::exception& problem) {
    console.error(fmt::format("internal error: {}", problem.what()));
  }
  _exit(static_cast<int>(console.finish(code)));  // no destructors: what they own is the parent's too
}

}  // namespace

bool deny_system_calls([[maybe_unused]] bool may_start_threads) {
#if defined(__x86_64__)
  std::vector<sock_filter> program = filter_program(may_start_threads);
  const sock_fprog filter{static_cast<unsigned short>(program.size()), program.data()};
  return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter) == 0;
#else
  return true;
#endif
}

bool may_bound_memory() noexcept {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  return false;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
  return false;
#else
  return true;
#endif
#else
  return true;
#endif
}

std::uint64_t physical_memory_bytes() {
  const long pages = sysconf(_SC_PHYS_PAGES), page_bytes = sysconf(_SC_PAGESIZE);
  return pages > 0 && page_bytes > 0
             ? static_cast<std::uint64_t>(pages) * static_cast<std::uint64_t>(page_bytes)
             : 0;
}

bool confine(const Confinement& bounds) {
  return prctl(PR_SET_PDEATHSIG, SIGKILL) == 0 && limit(RLIMIT_CORE, 0) &&
         (bounds.cpu_s == 0 || limit(RLIMIT_CPU, bounds.cpu_s)) &&
         limit_memory(RLIMIT_AS, bounds.address_bytes) && limit_memory(RLIMIT_DATA, bounds.heap_bytes) &&
         deny_system_calls(bounds.may_start_threads);
}

Exit run_confined(Console& console, const ConfinedCommand& command) {
  console.finish(Exit::kOk);  // what is buffered would be printed twice
  const pid_t child = fork();
  if (child < 0) {
    console.error(fmt::format("cannot start a child process: {}", std::generic_category().message(errno)));
    return Exit::kInternal;
  }
  if (child == 0) run_child(console, command);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status)) return static_cast<Exit>(WEXITSTATUS(status));
  const int signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  if (signal == SIGPIPE) return Exit::kPipeClosed;
  // Both limits of RLIMIT_CPU are the same; Linux kills at the hard one.
  if (command.bounds.cpu_s > 0 && (signal == SIGXCPU || signal == SIGKILL))
    return hostile(console, command,
                   fmt::format("was stopped, after at most {} s of processor time", command.bounds.cpu_s));
  if (signal == SIGSYS)
    return hostile(console, command, "made the reader ask the system for what no file of its kind needs");
  return hostile(console, command, fmt::format("crashed the program that reads it (signal {})", signal));
}

}  // namespace sqmap::apps
