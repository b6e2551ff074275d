// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "sqmap/asset/result.hpp"

#include "job_list.hpp"

namespace sqmap::apps {

/// Files beside a mesh that its import reads or looks for: material libraries of OBJ, buffers of glTF. Only
/// those in the mesh's folder and below, as read_mesh opens no others.
std::vector<std::filesystem::path> side_files(const std::filesystem::path& mesh);

/// One rule a job: its bundle depends on the mesh, the side files that exist, and the files its settings come
/// from; then a rule without recipe for each of those, so that make does not stop where one is gone. A
/// depfile that is right already is left untouched. Errors: kFileUnwritable; kBadOption for a file name with
/// a line feed, which neither make nor ninja can express.
Outcome write_depfile(const std::filesystem::path& path, const std::vector<Job>& jobs);

}  // namespace sqmap::apps
