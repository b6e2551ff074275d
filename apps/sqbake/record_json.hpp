// SPDX-License-Identifier: GPL-3.0-or-later
// The record of one asset as JSON; apps/sqbake/bake.schema.json describes it.
#pragma once

#include <string>
#include <string_view>

#include "sqmap/asset/result.hpp"

#include "bake_schema.hpp"
#include "records.hpp"

namespace sqmap::apps {

/// One object on one line with its line feed.
std::string record_line(const BakeRecord& record);

/// The inverse, but for `name`. Errors: kBadOption for what is no such record.
Result<BakeRecord> parse_record(std::string_view line);

}  // namespace sqmap::apps
