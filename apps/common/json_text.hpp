// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "sqmap/asset/asset.hpp"

namespace sqmap::apps {

/// A file name for a record: each byte that is not UTF-8 as one of U+EF80 to U+EFFF, so that names that
/// differ there stay different. These code points are private, and what MirBSD's OPTU-8 uses for this.
std::string json_name(std::string_view name);

/// One record on one line with its line feed. Bytes of other texts that are not UTF-8 become U+FFFD; NaN is
/// null.
std::string json_line(const nlohmann::ordered_json& json);
/// The same, indented.
std::string json_text(const nlohmann::ordered_json& json);

nlohmann::ordered_json to_json(const MeshRecord& mesh);
nlohmann::ordered_json to_json(const std::vector<ErrorRow>& errors);

}  // namespace sqmap::apps
