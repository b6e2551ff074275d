// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <utility>

#include "tables.hpp"

namespace sqmap::io {

/// Owns one HDF5 identifier (hid_t, int64_t in HDF5 1.10 and later).
class Hdf5Handle {
 public:
  using Close = int (*)(std::int64_t);

  Hdf5Handle() noexcept = default;
  /// A negative id, which is how HDF5 reports failure, makes an empty handle.
  Hdf5Handle(std::int64_t id, Close close) noexcept : id_(id), close_(close) {}
  ~Hdf5Handle() { reset(); }
  Hdf5Handle(Hdf5Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Hdf5Handle& operator=(Hdf5Handle&& other) noexcept {
    reset();
    id_ = std::exchange(other.id_, -1);
    close_ = other.close_;
    return *this;
  }

  explicit operator bool() const noexcept { return id_ >= 0; }
  std::int64_t get() const noexcept { return id_; }
  /// Closes now. False where HDF5 reports that it could not.
  bool reset() noexcept { return id_ < 0 || close_(std::exchange(id_, -1)) >= 0; }

 private:
  std::int64_t id_ = -1;
  Close close_ = nullptr;
};

/// While one lives, this thread alone is inside HDF5 (whose builds are often not thread-safe), HDF5 prints no
/// errors and loads no plugin. The host program's own settings return with its end.
class Hdf5Session {
 public:
  Hdf5Session();
  ~Hdf5Session();
  Hdf5Session(const Hdf5Session&) = delete;
  Hdf5Session& operator=(const Hdf5Session&) = delete;

  /// A file name that no other open file has: HDF5 takes two in-memory files of one name for the same file.
  std::string unique_name() const;

 private:
  std::unique_lock<std::mutex> lock_;
  int (*print_)(std::int64_t, void*) = nullptr;
  void* print_data_ = nullptr;
  unsigned plugin_state_ = 0;
};

/// The little-endian file type of an element (hid_t, owned by HDF5), which is also its type in memory.
std::int64_t hdf5_type(Element element) noexcept;

}  // namespace sqmap::io
