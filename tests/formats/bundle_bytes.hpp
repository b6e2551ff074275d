// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace sqmap::test {

using Bytes = std::vector<std::uint8_t>;

/// Repairs length and digest in the header of a bundle, written from FORMAT.md section 4 alone, so that what
/// a test did to the other bytes gets as far as HDF5.
void reseal(Bytes& bundle);

/// A folder of its own that goes with the object.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::string& path() const noexcept { return path_; }

 private:
  std::string path_;
};

Bytes load(const std::string& path);
void store(const std::string& path, const Bytes& bytes);

}  // namespace sqmap::test
