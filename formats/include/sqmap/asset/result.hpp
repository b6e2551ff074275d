// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cassert>
#include <string>
#include <utility>
#include <variant>

namespace sqmap {

/// Why an operation failed. Stable numbers, append only: they appear in reports.
enum class Status : int {
  kBadOption = 1,           ///< an option is outside its documented range
  kFileMissing = 2,         ///< the path names nothing
  kFileUnreadable = 3,      ///< the path is a directory, a pipe, or may not be read
  kFileUnwritable = 4,      ///< the output cannot be written (no space, no permission)
  kUnknownFormat = 5,       ///< no importer for this file
  kInvalidMesh = 6,         ///< the mesh has nothing that can be baked (no faces, NaN coordinates, ...)
  kInvalidAsset = 7,        ///< the bundle is damaged or breaks a rule of formats/FORMAT.md
  kUnsupportedVersion = 8,  ///< the bundle is newer (or far older) than this reader
  kBakeFailed = 9,          ///< a stage could not reach a valid result
  kCancelled = 10,          ///< the caller asked to stop
};

/// A failure: what was found, what was required, where; and what the user can do about it.
struct Error {
  Status status;
  std::string finding;  ///< e.g. `vertex 17 of "hand.off" has a NaN coordinate`
  std::string remedy;   ///< e.g. `remove the vertex, or export the mesh again`; may be empty
};

/// A value or the Error that explains its absence.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::move(value)) {}
  Result(Error error) : state_(std::move(error)) {}

  bool ok() const noexcept { return std::holds_alternative<T>(state_); }
  explicit operator bool() const noexcept { return ok(); }

  /// The value. Precondition: ok().
  T& value() & noexcept { return *std::get_if<T>(&state_); }
  const T& value() const& noexcept { return *std::get_if<T>(&state_); }
  T value() && noexcept { return std::move(*std::get_if<T>(&state_)); }
  /// The error. Precondition: !ok().
  const Error& error() const noexcept { return *std::get_if<Error>(&state_); }

 private:
  std::variant<T, Error> state_;
};

/// The value of an operation that has none.
struct Done {};
using Outcome = Result<Done>;

}  // namespace sqmap
