// SPDX-License-Identifier: GPL-3.0-or-later
// GNU make's protocol: "POSIX Jobserver Interaction" in its manual.
#include "thread_budget.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <sstream>
#include <string_view>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

namespace sqmap::apps {
namespace {

/// The value of the last --jobserver-auth (or --jobserver-fds, before make 4.2); later ones come from inner
/// makes.
std::string auth_of(const char* makeflags) {
  std::string auth;
  std::istringstream words(makeflags == nullptr ? "" : makeflags);
  for (std::string word; words >> word;)
    for (const std::string_view name : {"--jobserver-auth=", "--jobserver-fds="})
      if (word.starts_with(name)) auth = word.substr(name.size());
  return auth;
}

bool is_pipe(int fd) {
  struct stat info {};
  return ::fstat(fd, &info) == 0 && S_ISFIFO(info.st_mode);
}

/// The same pipe opened anew: O_NONBLOCK on make's own descriptor would hold for make, too.
int reopened(int fd, int flags) {
  return ::open(fmt::format("/proc/self/fd/{}", fd).c_str(), flags | O_NONBLOCK | O_CLOEXEC);
}

}  // namespace

ThreadBudget::ThreadBudget(unsigned limit, const char* makeflags) : limit_(std::max(1U, limit)) {
  const std::string auth = auth_of(makeflags);
  if (auth.empty()) return;
  connect(auth);
  if (read_fd_ >= 0 && write_fd_ >= 0) return;
  limit_ = 1;
  remark_ =
      "make's jobserver cannot be reached, one thread is used; put + in front of the command in the makefile";
}

void ThreadBudget::connect(const std::string& auth) {
  if (auth.starts_with("fifo:")) {
    const std::string path = auth.substr(5);
    read_fd_ = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    write_fd_ = ::open(path.c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC);
    return;
  }
  const std::size_t comma = auth.find(',');
  int reader = -1, writer = -1;
  const char* const end = auth.data() + auth.size();
  if (comma == std::string::npos ||
      std::from_chars(auth.data(), auth.data() + comma, reader).ec != std::errc{} ||
      std::from_chars(auth.data() + comma + 1, end, writer).ec != std::errc{} || !is_pipe(reader) ||
      !is_pipe(writer))
    return;
  read_fd_ = reopened(reader, O_RDONLY);
  write_fd_ = reopened(writer, O_WRONLY);
}

ThreadBudget::~ThreadBudget() {
  give_back(used_);
  if (read_fd_ >= 0) ::close(read_fd_);
  if (write_fd_ >= 0) ::close(write_fd_);
}

unsigned ThreadBudget::take(unsigned most) {
  unsigned taken = 0;
  while (taken < most && used_ < limit_) {
    if (used_ > 0 && read_fd_ >= 0) {  // the first is what make started us with
      char token = 0;
      const ssize_t count = ::read(read_fd_, &token, 1);
      if (count < 0 && errno == EINTR) continue;
      if (count != 1) break;
      tokens_.push_back(token);
    }
    ++used_;
    ++taken;
  }
  return taken;
}

void ThreadBudget::give_back(unsigned count) {
  used_ -= std::min(count, used_);
  while (!tokens_.empty() && tokens_.size() + 1 > std::max(1U, used_)) {
    const ssize_t written = ::write(write_fd_, &tokens_.back(), 1);
    if (written < 0 && errno == EINTR) continue;
    tokens_.pop_back();
  }
}

int ThreadBudget::wake_fd() const noexcept { return used_ < limit_ ? read_fd_ : -1; }

}  // namespace sqmap::apps
