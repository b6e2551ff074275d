// SPDX-License-Identifier: GPL-3.0-or-later
#include "stop_signals.hpp"

#include <atomic>
#include <csignal>

#include <unistd.h>

namespace sqmap::apps {
namespace {

std::atomic<int> first_signal{0};
std::atomic<int> active_writes{0};
static_assert(std::atomic<int>::is_always_lock_free, "used in signal handlers");

// Only async-signal-safe calls from here on.
void end_now() {
  if (active_writes.load() > 0) {
    ::alarm(1);  // look again: a write takes milliseconds
    return;
  }
  ::_exit(128 + first_signal.load());
}

void on_stop(int signal) {
  int expected = 0;
  if (first_signal.compare_exchange_strong(expected, signal)) {
    ::alarm(1);
  } else {
    end_now();
  }
}

void on_alarm(int) { end_now(); }

void handle(int signal, void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART;
  sigemptyset(&action.sa_mask);
  ::sigaction(signal, &action, nullptr);
}

}  // namespace

void install_stop_signals() {
  struct sigaction inherited {};
  ::sigaction(SIGINT, nullptr, &inherited);
  if (inherited.sa_handler != SIG_IGN)
    handle(SIGINT, on_stop);  // a background job of a script keeps ignoring it
  handle(SIGTERM, on_stop);
  handle(SIGPIPE, on_stop);
  handle(SIGALRM, on_alarm);
  handle(SIGXFSZ, SIG_IGN);  // a file size limit then is a write error like a full disk
}

int stop_signal() noexcept { return first_signal.load(); }

WriteGuard::WriteGuard() noexcept { active_writes.fetch_add(1); }
WriteGuard::~WriteGuard() { active_writes.fetch_sub(1); }

}  // namespace sqmap::apps
