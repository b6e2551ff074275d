// SPDX-License-Identifier: Apache-2.0
#include "exit_codes.hpp"

#include <array>
#include <utility>

#include <fmt/format.h>

namespace sqmap::apps {
namespace {

constexpr std::array<std::pair<Exit, const char*>, 14> kMeanings{{
    {Exit::kOk, "done"},
    {Exit::kSomeFailed, "several inputs: at least one failed, the others are done"},
    {Exit::kUsage, "the command line is wrong; nothing was done"},
    {Exit::kFileAccess, "a file is missing or cannot be read or written"},
    {Exit::kBadInput, "the input file is not usable (mesh, bundle or points)"},
    {Exit::kInternal, "the bake failed, or an internal error"},
    {Exit::kUnsupportedVersion, "the version of the bundle or of the records is not supported"},
    {Exit::kDifferent, "diff: the bundles differ"},
    {Exit::kLimit, "bake: one mesh, which ran into --timeout or --memory"},
    {Exit::kCrashed, "bake: one mesh, on which the baker crashed"},
    {Exit::kDegraded, "bake --strict: one mesh, whose bundle is less than was asked for"},
    {Exit::kInterrupted, "stopped by Ctrl-C"},
    {Exit::kPipeClosed, "stopped because the reader of the output went away"},
    {Exit::kTerminated, "stopped by SIGTERM"},
}};

}  // namespace

Exit exit_for(Status status) noexcept {
  switch (status) {
    case Status::kBadOption:
      return Exit::kUsage;
    case Status::kFileMissing:
    case Status::kFileUnreadable:
    case Status::kFileUnwritable:
      return Exit::kFileAccess;
    case Status::kUnknownFormat:
    case Status::kInvalidMesh:
    case Status::kInvalidAsset:
      return Exit::kBadInput;
    case Status::kUnsupportedVersion:
      return Exit::kUnsupportedVersion;
    case Status::kBakeFailed:
      return Exit::kInternal;
    case Status::kCancelled:
      return Exit::kInterrupted;
  }
  return Exit::kInternal;
}

const char* status_name(Status status) noexcept {
  switch (status) {
    case Status::kBadOption:
      return "bad-option";
    case Status::kFileMissing:
      return "file-missing";
    case Status::kFileUnreadable:
      return "file-unreadable";
    case Status::kFileUnwritable:
      return "file-unwritable";
    case Status::kUnknownFormat:
      return "unknown-format";
    case Status::kInvalidMesh:
      return "invalid-mesh";
    case Status::kInvalidAsset:
      return "invalid-asset";
    case Status::kUnsupportedVersion:
      return "unsupported-version";
    case Status::kBakeFailed:
      return "bake-failed";
    case Status::kCancelled:
      return "cancelled";
  }
  return "internal";
}

std::string exit_code_table() {
  std::string table = "Exit codes:\n";
  for (const auto& [code, meaning] : kMeanings)
    table += fmt::format("  {:>3}  {}\n", static_cast<int>(code), meaning);
  return table;
}

}  // namespace sqmap::apps
