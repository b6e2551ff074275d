// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "../common/console.hpp"
#include "job_list.hpp"
#include "records.hpp"

namespace sqmap::apps {

/// Prints each job as it would be baked: as text its input, output and the settings that are not built in; as
/// JSON a record of type "plan" with all settings and where they come from.
void print_plan(Console& console, const JobList& list, RecordFormat format);

}  // namespace sqmap::apps
