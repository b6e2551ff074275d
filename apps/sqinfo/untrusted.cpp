// SPDX-License-Identifier: Apache-2.0
#include "untrusted.hpp"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <exception>
#include <new>
#include <system_error>

#include <fmt/format.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
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

#if defined(__x86_64__)
// A list of what is denied, not of what is allowed: libraries differ in the calls they make to read and
// print.
bool deny_system_calls() {
  constexpr std::uint32_t kX32Calls = 0x40000000;  // the same calls under other numbers
  constexpr std::array<std::uint32_t, 16> kDenied{SYS_execve,
                                                  SYS_execveat,
                                                  SYS_fork,
                                                  SYS_vfork,
                                                  SYS_clone,
                                                  SYS_clone3,
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
  constexpr std::size_t kHead = 5, kTail = 2;
  std::array<sock_filter, kHead + kDenied.size() + kTail> program{};
  const auto jump = [](std::uint16_t test, std::uint32_t value, std::size_t if_true, std::size_t if_false) {
    return sock_filter{static_cast<std::uint16_t>(BPF_JMP | test | BPF_K), static_cast<std::uint8_t>(if_true),
                       static_cast<std::uint8_t>(if_false), value};
  };
  const auto load = [](std::size_t offset) {
    return sock_filter{BPF_LD | BPF_W | BPF_ABS, 0, 0, static_cast<std::uint32_t>(offset)};
  };
  const std::size_t kill_at = program.size() - 1;
  const auto to_kill = [&](std::size_t from) { return kill_at - from - 1; };
  program[0] = load(offsetof(seccomp_data, arch));
  program[1] = jump(BPF_JEQ, AUDIT_ARCH_X86_64, 0, to_kill(1));
  program[2] = load(offsetof(seccomp_data, nr));
  program[3] = jump(BPF_JGE, kX32Calls, to_kill(3), 0);
  program[4] = load(offsetof(seccomp_data, nr));
  for (std::size_t k = 0; k < kDenied.size(); ++k)
    program[kHead + k] = jump(BPF_JEQ, kDenied[k], to_kill(kHead + k), 0);
  program[kill_at - 1] = {BPF_RET | BPF_K, 0, 0, SECCOMP_RET_ALLOW};
  program[kill_at] = {BPF_RET | BPF_K, 0, 0, SECCOMP_RET_KILL_PROCESS};
  const sock_fprog filter{static_cast<unsigned short>(program.size()), program.data()};
  return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter) == 0;
}
#else
bool deny_system_calls() { return true; }
#endif

/// A sanitizer's run-time reserves terabytes of address space.
constexpr bool may_bound_memory() {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  return false;
#else
  return true;
#endif
}

bool confine() {
  return prctl(PR_SET_PDEATHSIG, SIGKILL) == 0 && limit(RLIMIT_CORE, 0) &&
         limit(RLIMIT_CPU, kUntrustedCpu_s) &&
         (!may_bound_memory() || limit(RLIMIT_AS, kUntrustedMemoryBytes)) && deny_system_calls();
}

Exit hostile(Console& console, const std::string& files, const std::string& what) {
  console.error(message_for(files, {Status::kInvalidAsset, what,
                                    "do not open it without --untrusted; bake it again if it is yours"}));
  return Exit::kBadInput;
}

[[noreturn]] void run_child(Console& console, const std::string& files,
                            const std::function<Exit(Console&)>& command) {
  Exit code = Exit::kInternal;
  try {
    if (confine()) {
      code = command(console);
    } else {
      console.error("the system refuses to confine the child of --untrusted");
    }
  } catch (const std::bad_alloc&) {
    code = hostile(console, files, fmt::format("needs more than {} bytes of memory", kUntrustedMemoryBytes));
  } catch (const std::exception& problem) {
    console.error(fmt::format("internal error: {}", problem.what()));
  }
  _exit(static_cast<int>(console.finish(code)));  // no destructors: what they own is the parent's too
}

}  // namespace

Exit run_untrusted(Console& console, const std::string& files, const std::function<Exit(Console&)>& command) {
  console.finish(Exit::kOk);  // what is buffered would be printed twice
  const pid_t child = fork();
  if (child < 0) {
    console.error(
        fmt::format("cannot start the child of --untrusted: {}", std::generic_category().message(errno)));
    return Exit::kInternal;
  }
  if (child == 0) run_child(console, files, command);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status)) return static_cast<Exit>(WEXITSTATUS(status));
  const int signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  if (signal == SIGPIPE) return Exit::kPipeClosed;
  // Both limits of RLIMIT_CPU are the same; Linux kills at the hard one.
  if (signal == SIGXCPU || signal == SIGKILL)
    return hostile(console, files,
                   fmt::format("was stopped, after at most {} s of processor time", kUntrustedCpu_s));
  if (signal == SIGSYS)
    return hostile(console, files, "made the reader ask the system for what no bundle needs");
  return hostile(console, files, fmt::format("crashed the program that reads it (signal {})", signal));
}

}  // namespace sqmap::apps
