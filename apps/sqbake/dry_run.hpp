// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "../common/console.hpp"
#include "bake_run.hpp"
#include "job_list.hpp"

namespace sqmap::apps {

/// Prints each job as it would be baked: as text its input, output and the settings that are not built in; as
/// JSON a record of type "plan" with all settings and where they come from. With --explain also whether the
/// cache has its bundle, and why not: as notes, and in the records.
void print_plan(Console& console, const JobList& list, const BakeArguments& arguments);

}  // namespace sqmap::apps
