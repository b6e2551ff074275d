// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace sqmap::apps {

/// Makes Ctrl-C, SIGTERM and a closed pipe stop the program cleanly: the first asks for an orderly stop,
/// which gets one second; a second one, or the end of that second, ends the process at once. Either way never
/// while a bundle is being written, so no partial or temporary file stays behind.
void install_stop_signals();

/// The signal that asked to stop, or 0.
int stop_signal() noexcept;

/// While one exists, the process is not ended from outside (SIGKILL excepted). Make it first, then ask
/// stop_signal(): where that says to stop, the end may come as soon as the guard is gone, so do not write.
class WriteGuard {
 public:
  WriteGuard() noexcept;
  ~WriteGuard();
  WriteGuard(const WriteGuard&) = delete;
  WriteGuard& operator=(const WriteGuard&) = delete;
};

}  // namespace sqmap::apps
