// SPDX-License-Identifier: Apache-2.0
#include "files.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <set>
#include <string_view>
#include <system_error>
#include <tuple>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace sqmap::apps {
namespace {

constexpr int kAttempts = 10;

/// A file descriptor that closes itself.
class Descriptor {
 public:
  explicit Descriptor(int fd) noexcept : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const noexcept { return fd_; }
  /// Closes now, so that errors the system reports late are seen. 0 or errno.
  int close() noexcept {
    const int fd = std::exchange(fd_, -1);
    return ::close(fd) == 0 ? 0 : errno;
  }

 private:
  int fd_;
};

Result<std::vector<std::uint8_t>> read_all(int fd, const std::string& name, std::uint64_t max_bytes) {
  std::vector<std::uint8_t> bytes;
  std::size_t used = 0;
  for (;;) {
    if (used == bytes.size()) bytes.resize(used + (used < (1U << 16) ? (1U << 16) : used));
    const ssize_t count = ::read(fd, bytes.data() + used, bytes.size() - used);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0)
      return Error{Status::kFileUnreadable, fmt::format("{}: {}", name, std::strerror(errno)), ""};
    if (count == 0) break;
    used += static_cast<std::size_t>(count);
    if (used > max_bytes)
      return Error{Status::kFileUnreadable, fmt::format("{}: more than {} bytes", name, max_bytes), ""};
  }
  bytes.resize(used);
  return bytes;
}

/// Whether it is called as the temporary files of replace() are.
bool is_temporary(std::string_view name) {
  const std::string_view start = kTemporaryPrefix, letters = "XXXXXX", end = ".tmp";
  return name.size() == start.size() + letters.size() + end.size() && name.starts_with(start) &&
         name.ends_with(end);
}

/// Writes beside a file, then takes its place. 0 or errno; ENOENT also where the temporary file was removed.
int replace(const std::filesystem::path& target, std::span<const std::uint8_t> bytes) {
  std::string temporary = (target.parent_path() / kTemporaryPrefix).string() + "XXXXXX.tmp";
  Descriptor file(::mkostemps(temporary.data(), 4, O_CLOEXEC));
  if (file.get() < 0) return errno;
  // Held until the file is renamed or its process is gone: remove_abandoned() leaves it alone that long.
  std::ignore = ::flock(file.get(), LOCK_EX);
  struct stat made {};
  if (::fstat(file.get(), &made) == 0 && made.st_nlink == 0) return ENOENT;
  int code = write_all(file.get(), bytes);
  const mode_t mask = ::umask(0);  // mkostemps makes private files; the result gets what any new file would
  ::umask(mask);
  if (code == 0 && ::fchmod(file.get(), 0666 & ~mask) != 0) code = errno;
  if (code == 0 && ::fsync(file.get()) != 0)
    code = errno;  // else a power cut may leave the name without the bytes
  if (code == 0 && std::rename(temporary.c_str(), target.c_str()) != 0) code = errno;
  if (const int close_code = file.close(); code == 0) code = close_code;
  if (code != 0) ::unlink(temporary.c_str());
  return code;
}

template <class Failed>
Outcome write_through(const std::filesystem::path& path, std::span<const std::uint8_t> bytes, Failed failed) {
  Descriptor file(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
  if (file.get() < 0) return failed(errno);
  int code = write_all(file.get(), bytes);
  if (const int close_code = file.close(); code == 0) code = close_code;
  if (code != 0) return failed(code);
  return Done{};
}

}  // namespace

int write_all(int fd, std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(fd, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return errno;
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
  return 0;
}

Result<std::vector<std::uint8_t>> read_file(const std::filesystem::path& path, std::uint64_t max_bytes) {
  const std::string name = path.string();
  // O_NONBLOCK: opening a pipe without a writer must not wait for one.
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.get() < 0) {
    const Status status =
        errno == ENOENT || errno == ENOTDIR ? Status::kFileMissing : Status::kFileUnreadable;
    return Error{status, fmt::format("{}: {}", name, std::strerror(errno)), "check the path"};
  }
  struct stat info {};
  if (::fstat(file.get(), &info) != 0)
    return Error{Status::kFileUnreadable, fmt::format("{}: {}", name, std::strerror(errno)), ""};
  if (!S_ISREG(info.st_mode))
    return Error{Status::kFileUnreadable, fmt::format("{}: not a regular file", name), "name a file"};
  return read_all(file.get(), name, max_bytes);
}

Result<std::vector<std::uint8_t>> read_stdin(std::uint64_t max_bytes) {
  return read_all(STDIN_FILENO, "standard input", max_bytes);
}

Outcome write_file(const std::filesystem::path& path, std::span<const std::uint8_t> bytes) {
  const auto failed = [&](int code) {
    return Error{Status::kFileUnwritable, fmt::format("{}: {}", path.string(), std::strerror(code)),
                 "check the folder, its permissions and the free space"};
  };
  std::error_code link_code;
  std::filesystem::path target = path;
  if (std::filesystem::is_symlink(path, link_code)) {
    target = std::filesystem::weakly_canonical(path, link_code);
    if (link_code) return failed(link_code.value());
  }
  struct stat old {};
  const bool exists = ::stat(target.c_str(), &old) == 0;
  if (exists && S_ISDIR(old.st_mode)) return failed(EISDIR);
  if (exists && S_ISREG(old.st_mode) && static_cast<std::uint64_t>(old.st_size) == bytes.size()) {
    const auto held = read_file(target, bytes.size());
    if (held && std::ranges::equal(held.value(), bytes)) return Done{};
  }
  // rename() would put a file in the place of a device such as /dev/null.
  if (exists && !S_ISREG(old.st_mode)) return write_through(target, bytes, failed);
  // Once more where somebody took the temporary file for abandoned: between its making and its lock, or where
  // another machine does not see the lock.
  int code = ENOENT;
  for (int attempt = 0; attempt < kAttempts && code == ENOENT; ++attempt) code = replace(target, bytes);
  if (code == 0) return Done{};
  return failed(code);
}

Outcome write_file(const std::filesystem::path& path, const std::string& text) {
  return write_file(path, std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

void remove_abandoned(std::span<const std::filesystem::path> files) {
  namespace fs = std::filesystem;
  std::error_code code;
  std::set<fs::path> folders;
  for (const fs::path& file : files) {
    const fs::path target = fs::is_symlink(file, code) ? fs::weakly_canonical(file, code) : file;
    folders.insert(target.has_parent_path() ? target.parent_path() : fs::path("."));
  }
  for (const fs::path& folder : folders) {
    std::vector<fs::path> found;
    fs::directory_iterator entry(folder, code);
    for (; !code && entry != fs::directory_iterator(); entry.increment(code))
      if (is_temporary(entry->path().filename().native())) found.push_back(entry->path());
    for (const fs::path& path : found) {
      const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
      if (file.get() >= 0 && ::flock(file.get(), LOCK_EX | LOCK_NB) == 0) ::unlink(path.c_str());
    }
  }
}

}  // namespace sqmap::apps
