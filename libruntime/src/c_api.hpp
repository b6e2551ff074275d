// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <new>
#include <utility>

#include "sqmap/asset/result.hpp"
#include "sqmap/runtime/body.hpp"
#include "sqmap/runtime/sweep.hpp"
#include "sqmap/sqmap.h"

/// What a handle of the C interface points to.
struct sqmap_object {  // NOLINT(readability-identifier-naming): a name of C
  sqmap::runtime::Object object;
  sqmap::runtime::Sweeper sweeper;
};

struct sqmap_body {  // NOLINT(readability-identifier-naming): a name of C
  sqmap::runtime::PointBody body;
};

namespace sqmap::runtime {

/// The status of a failure, its texts in `error` where there is one.
sqmap_status c_failure(int status, const char* finding, const char* remedy, sqmap_error* error) noexcept;
inline sqmap_status c_failure(const Error& why, sqmap_error* error) noexcept {
  return c_failure(static_cast<int>(why.status), why.finding.c_str(), why.remedy.c_str(), error);
}

/// Makes a handle of an asset.
sqmap_status c_object(const Asset& asset, sqmap_object** object, sqmap_error* error);

/// Runs `body`, which may allocate. Without exceptions an exhausted memory ends the program, as everywhere in
/// such a build.
template <class Body>
sqmap_status c_guarded(sqmap_error* error, const Body& body) noexcept {
#ifdef __cpp_exceptions
  try {
    return body();
  } catch (const std::bad_alloc&) {
    return c_failure(SQMAP_OUT_OF_MEMORY, "memory is exhausted", "free some, or load fewer objects", error);
  }
#else
  static_cast<void>(error);
  return body();
#endif
}

}  // namespace sqmap::runtime
