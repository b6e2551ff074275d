// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "sqmap/asset/result.hpp"

namespace sqmap::apps {

/// Exit codes of every program. Scripts depend on them: do not renumber, append only.
enum class Exit : int {
  kOk = 0,
  kSomeFailed = 1,
  kUsage = 2,
  kFileAccess = 3,
  kBadInput = 4,
  kInternal = 5,
  kUnsupportedVersion = 6,
  kDifferent = 7,
  kLimit = 8,
  kCrashed = 9,
  kDegraded = 10,
  kInterrupted = 130,
  kPipeClosed = 141,
  kTerminated = 143,
};

/// The exit code of a run that ended with this error.
Exit exit_for(Status status) noexcept;

/// Short stable name of a status for machine-readable records, e.g. "invalid-mesh".
const char* status_name(Status status) noexcept;

/// The table of exit codes as --help prints it.
std::string exit_code_table();

}  // namespace sqmap::apps
