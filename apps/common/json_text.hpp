// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "sqmap/asset/asset.hpp"

namespace sqmap::apps {

/// One record on one line with its line feed. Bytes of a file name that are not UTF-8 become U+FFFD; NaN is
/// null.
std::string json_line(const nlohmann::ordered_json& json);
/// The same, indented.
std::string json_text(const nlohmann::ordered_json& json);

nlohmann::ordered_json to_json(const MeshRecord& mesh);
nlohmann::ordered_json to_json(const std::vector<ErrorRow>& errors);

}  // namespace sqmap::apps
