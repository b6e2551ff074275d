// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <mutex>
#include <string>
#include <string_view>

#include "sqmap/asset/result.hpp"

#include "exit_codes.hpp"

namespace sqmap::apps {

enum class When { kAuto, kAlways, kNever };

/// The one owner of stdout and stderr: results go to stdout, everything else to stderr, and a status line on
/// a terminal is taken away before anything else is printed. Thread-safe.
class Console {
 public:
  explicit Console(std::string program);
  ~Console();
  Console(const Console&) = delete;
  Console& operator=(const Console&) = delete;

  const std::string& program() const noexcept { return program_; }
  /// kAuto: colour on a terminal, unless NO_COLOR is set or TERM is "dumb".
  void set_color(When when);
  void set_quiet(bool quiet) noexcept { quiet_ = quiet; }

  /// Results. Flushed at once, so that a reader sees each record when it exists.
  void out(std::string_view text);
  /// `program: error: message` and its kin on stderr. Notes and warnings are silent after set_quiet.
  void error(std::string_view message);
  void warning(std::string_view message);
  /// A warning that is not silent after set_quiet either: the result is less than was asked for.
  void insist(std::string_view message);
  void note(std::string_view message);

  /// Replaces the status line. Only when stderr is a terminal; empty removes it.
  void status(std::string_view line);
  bool stderr_is_terminal() const noexcept { return stderr_is_terminal_; }

  /// Flushes stdout. kFileAccess after a message when any result could not be written, else `code`.
  Exit finish(Exit code);

 private:
  void say(const char* kind, const char* color, std::string_view message);
  void clear_status();

  std::string program_;
  bool stderr_is_terminal_;
  bool color_;
  bool quiet_ = false;
  int out_errno_ = 0;
  std::string status_;
  std::mutex mutex_;
};

/// `FILE: finding; remedy`. The file is left out where the finding already names it.
std::string message_for(std::string_view file, const Error& error);

/// Prints an error as `finding; remedy`, where a file is given as message_for() does. The exit code that
/// tells of it.
Exit refuse(Console& console, const Error& error);
Exit refuse(Console& console, std::string_view file, const Error& error);

}  // namespace sqmap::apps
