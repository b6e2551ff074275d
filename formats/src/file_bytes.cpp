// SPDX-License-Identifier: Apache-2.0
#include "file_bytes.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <string>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace sqmap::io {
namespace {

std::string reason(int error) { return std::generic_category().message(error); }

std::string quoted(const std::filesystem::path& path) { return "\"" + path.string() + "\""; }

class Descriptor {
 public:
  explicit Descriptor(int fd) noexcept : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const noexcept { return fd_; }
  bool ok() const noexcept { return fd_ >= 0; }
  /// Closes and reports, since some file systems announce a failed write only here.
  int close() noexcept { return ::close(std::exchange(fd_, -1)); }

 private:
  int fd_;
};

/// Removes the file unless released.
class Temporary {
 public:
  explicit Temporary(std::filesystem::path path) : path_(std::move(path)) {}
  ~Temporary() {
    if (!released_) ::unlink(path_.c_str());
  }
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;
  void release() noexcept { released_ = true; }

 private:
  std::filesystem::path path_;
  bool released_ = false;
};

bool write_all(int fd, std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    // Linux writes at most 2^31 - 4096 bytes a call.
    const ssize_t count =
        ::write(fd, bytes.data(), std::min<std::size_t>(bytes.size(), std::size_t{1} << 30));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return false;
    if (count == 0) {
      errno = ENOSPC;
      return false;
    }
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
  return true;
}

bool read_all(int fd, std::span<std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::read(fd, bytes.data(), std::min<std::size_t>(bytes.size(), std::size_t{1} << 30));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return false;
    if (count == 0) {
      errno = EIO;
      return false;
    }
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
  return true;
}

Error unwritable(const std::filesystem::path& path, const std::string& why) {
  return {Status::kFileUnwritable, "cannot write " + quoted(path) + ": " + why,
          "choose a folder that may be written and has room"};
}

// The data of a renamed file is safe only once its folder is; some file systems cannot sync folders, which is
// fine.
void sync_folder(const std::filesystem::path& folder) {
  const Descriptor descriptor(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (descriptor.ok()) ::fsync(descriptor.get());
}

}  // namespace

Result<std::vector<std::uint8_t>> read_file(const std::filesystem::path& path, std::uint64_t max_bytes) {
  const auto unreadable = [&](const std::string& why) {
    return Error{Status::kFileUnreadable, "cannot read " + quoted(path) + ": " + why,
                 "give a file that may be read"};
  };
  // O_NONBLOCK: opening a pipe without a writer would wait for ever.
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!file.ok()) {
    if (errno == ENOENT || errno == ENOTDIR)
      return Error{Status::kFileMissing, "no file " + quoted(path), "check the path"};
    return unreadable(reason(errno));
  }
  struct stat info {};
  if (::fstat(file.get(), &info) != 0) return unreadable(reason(errno));
  if (S_ISDIR(info.st_mode)) return unreadable("it is a folder");
  if (!S_ISREG(info.st_mode)) return unreadable("it is not a regular file");
  const auto size = static_cast<std::uint64_t>(info.st_size);
  if (size > max_bytes)
    return Error{Status::kInvalidAsset,
                 quoted(path) + " has " + std::to_string(size) + " bytes, at most " +
                     std::to_string(max_bytes) + " are read",
                 "raise the limit if the file is trusted"};
  std::vector<std::uint8_t> bytes(size);
  if (!read_all(file.get(), bytes)) return unreadable(reason(errno));
  return bytes;
}

Outcome replace_file(const std::filesystem::path& path, std::span<const std::uint8_t> bytes) {
  std::error_code ec;
  std::filesystem::path target = path;
  if (std::filesystem::is_symlink(path, ec)) {
    target = std::filesystem::weakly_canonical(path, ec);
    if (ec) return unwritable(path, ec.message());
  }
  // rename() would replace a device node such as /dev/full by a file.
  struct stat old {};
  const bool exists = ::stat(target.c_str(), &old) == 0;
  if (exists && !S_ISREG(old.st_mode))
    return unwritable(path, S_ISDIR(old.st_mode) ? "it is a folder" : "it is not a regular file");
  if (exists && static_cast<std::uint64_t>(old.st_size) == bytes.size()) {
    const auto held = read_file(target, bytes.size());
    if (held && std::equal(bytes.begin(), bytes.end(), held.value().begin(), held.value().end()))
      return Done{};
  }

  static std::atomic<unsigned> counter{0};
  const std::filesystem::path folder = target.has_parent_path() ? target.parent_path() : ".";
  const std::filesystem::path temporary_path =
      folder / (".sqmap-" + std::to_string(::getpid()) + "-" + std::to_string(counter++) + ".tmp");
  Descriptor file(::open(temporary_path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (!file.ok()) return unwritable(path, reason(errno));
  Temporary temporary(temporary_path);
  if (exists)
    ::fchmod(file.get(), old.st_mode & 07777);  // best effort: the content matters more than the mode
  if (!write_all(file.get(), bytes) || ::fsync(file.get()) != 0 || file.close() != 0)
    return unwritable(path, reason(errno));
  if (::rename(temporary_path.c_str(), target.c_str()) != 0) return unwritable(path, reason(errno));
  temporary.release();
  sync_folder(folder);
  return Done{};
}

}  // namespace sqmap::io
