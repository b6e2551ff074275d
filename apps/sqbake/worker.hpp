// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace sqmap::apps {

/// What `sqbake worker MESH` does: see worker_messages.hpp. Returns or ends the process with an exit code.
int run_worker(const char* mesh);

}  // namespace sqmap::apps
