// SPDX-License-Identifier: Apache-2.0
#include "console.hpp"

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <utility>

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "printable.hpp"

namespace sqmap::apps {
namespace {

constexpr const char* kRed = "\033[1;31m";
constexpr const char* kYellow = "\033[1;33m";
constexpr const char* kPlain = "\033[0m";

bool is_dumb_terminal() {
  const char* term = std::getenv("TERM");
  return term == nullptr || std::string_view(term) == "dumb";
}

bool wants_color(bool is_terminal) {
  const char* no_color = std::getenv("NO_COLOR");
  return is_terminal && !is_dumb_terminal() && (no_color == nullptr || *no_color == '\0');
}

std::size_t terminal_width() {
  winsize size{};
  if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return 80;
  return size.ws_col;
}

}  // namespace

Console::Console(std::string program)
    : program_(std::move(program)),
      stderr_is_terminal_(isatty(STDERR_FILENO) == 1 && !is_dumb_terminal()),
      color_(wants_color(stderr_is_terminal_)) {}

Console::~Console() { status({}); }

void Console::set_color(When when) {
  color_ = when == When::kAlways || (when == When::kAuto && wants_color(stderr_is_terminal_));
}

void Console::out(std::string_view text) {
  const std::scoped_lock lock(mutex_);
  clear_status();
  if (out_errno_ != 0) return;
  errno = 0;
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0)
    out_errno_ = errno != 0 ? errno : EIO;
}

void Console::error(std::string_view message) { say("error", kRed, message); }

void Console::warning(std::string_view message) {
  if (!quiet_) say("warning", kYellow, message);
}

void Console::insist(std::string_view message) { say("warning", kYellow, message); }

void Console::note(std::string_view message) {
  if (!quiet_) say(nullptr, nullptr, message);
}

void Console::say(const char* kind, const char* color, std::string_view message) {
  const std::scoped_lock lock(mutex_);
  clear_status();
  std::string line = program_ + ": ";
  if (kind != nullptr)
    line += color_ ? fmt::format("{}{}:{} ", color, kind, kPlain) : fmt::format("{}: ", kind);
  line += printable(message) + "\n";
  std::fwrite(line.data(), 1, line.size(), stderr);
}

void Console::status(std::string_view line) {
  if (!stderr_is_terminal_) return;
  const std::scoped_lock lock(mutex_);
  clear_status();
  status_ = printable(line).substr(0, terminal_width() - 1);
  std::fwrite(status_.data(), 1, status_.size(), stderr);
  std::fflush(stderr);
}

void Console::clear_status() {
  if (status_.empty()) return;
  std::fputs("\r\033[K", stderr);
  status_.clear();
}

Exit Console::finish(Exit code) {
  status({});
  if (std::fflush(stdout) != 0 && out_errno_ == 0) out_errno_ = errno;
  if (out_errno_ == 0) return code;
  if (out_errno_ == EPIPE) return Exit::kPipeClosed;
  error(fmt::format("standard output: {}; free space, or send the output elsewhere",
                    std::strerror(out_errno_)));
  return Exit::kFileAccess;
}

std::string printable(std::string_view text) {
  std::string result;
  result.reserve(text.size());
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7F) {
      result += fmt::format("\\x{:02x}", byte);
    } else {
      result += c;
    }
  }
  return result;
}

namespace {

/// Whether a text holds this name, and not only as a part of a longer one, such as that of its sidecar.
bool names(std::string_view text, std::string_view name) {
  constexpr std::string_view kEnds = " :;,`'\")";
  for (std::size_t at = text.find(name); at != std::string_view::npos; at = text.find(name, at + 1)) {
    const std::size_t end = at + name.size();
    if (end == text.size() || kEnds.find(text[end]) != std::string_view::npos) return true;
  }
  return false;
}

}  // namespace

std::string message_for(std::string_view file, const Error& error) {
  const std::size_t slash = file.find_last_of('/');
  const std::string quoted_name =
      fmt::format("\"{}\"", slash == std::string_view::npos ? file : file.substr(slash + 1));
  std::string message(file);
  if (error.finding.starts_with(quoted_name)) {
    message += error.finding.substr(quoted_name.size());  // readers of bytes know no folder
  } else if (names(error.finding, file)) {
    message = error.finding;
  } else {
    message += ": " + error.finding;
  }
  if (!error.remedy.empty()) message += "; " + error.remedy;
  return message;
}

Exit refuse(Console& console, const Error& error) {
  console.error(error.remedy.empty() ? error.finding : error.finding + "; " + error.remedy);
  return exit_for(error.status);
}

Exit refuse(Console& console, std::string_view file, const Error& error) {
  console.error(message_for(file, error));
  return exit_for(error.status);
}

}  // namespace sqmap::apps
