// SPDX-License-Identifier: Apache-2.0
#include "json_text.hpp"

#include <nlohmann/json.hpp>

namespace sqmap::apps {

using Json = nlohmann::ordered_json;

namespace {

/// Bytes of the UTF-8 sequence that a text begins with; 0 where that is none. RFC 3629, section 4.
std::size_t utf8_length(std::string_view text) {
  const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(text[k]); };
  const unsigned first = byte(0);
  if (first < 0x80) return 1;
  const std::size_t length = first < 0xC2 ? 0 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : first < 0xF5 ? 4 : 0;
  if (length == 0 || text.size() < length) return 0;
  for (std::size_t k = 1; k < length; ++k)
    if ((byte(k) & 0xC0U) != 0x80) return 0;
  const unsigned second = byte(1);
  const bool is_overlong = (first == 0xE0 && second < 0xA0) || (first == 0xF0 && second < 0x90);
  const bool is_surrogate = first == 0xED && second > 0x9F, is_beyond = first == 0xF4 && second > 0x8F;
  return is_overlong || is_surrogate || is_beyond ? 0 : length;
}

}  // namespace

std::string json_name(std::string_view name) {
  std::string text;
  while (!name.empty()) {
    const std::size_t length = utf8_length(name);
    if (length > 0) {
      text += name.substr(0, length);
    } else {  // U+EF00 + byte, which is at least 0x80
      const auto byte = static_cast<unsigned char>(name[0]);
      text += {'\xEE', static_cast<char>(0xBC | (byte >> 6)), static_cast<char>(0x80 | (byte & 0x3F))};
    }
    name.remove_prefix(length > 0 ? length : 1);
  }
  return text;
}

std::string json_line(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string json_text(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

Json to_json(const MeshRecord& mesh) {
  return {{"source_vertices", mesh.source_vertices},
          {"source_faces", mesh.source_faces},
          {"vertices", mesh.vertices},
          {"faces", mesh.faces},
          {"components", mesh.components},
          {"welded_vertices", mesh.welded_vertices},
          {"degenerate_faces", mesh.degenerate_faces},
          {"duplicate_faces", mesh.duplicate_faces},
          {"flipped_faces", mesh.flipped_faces},
          {"filled_holes", mesh.filled_holes},
          {"boundary_edges", mesh.boundary_edges},
          {"non_manifold_edges", mesh.non_manifold_edges},
          {"is_closed", mesh.is_closed},
          {"volume_m3", mesh.volume_m3}};
}

Json to_json(const std::vector<ErrorRow>& errors) {
  Json rows = Json::array();
  for (const ErrorRow& row : errors)
    rows.push_back({{"level", row.level},
                    {"layer", row.layer},
                    {"eq35_percent", row.eq35_percent},
                    {"depth_mean_percent", row.depth_mean_percent},
                    {"depth_p95_percent", row.depth_p95_percent},
                    {"misclassified_3_percent", row.misclassified_3_percent},
                    {"misclassified_05_percent", row.misclassified_05_percent},
                    {"samples_3", row.samples_3},
                    {"samples_05", row.samples_05},
                    {"samples_depth", row.samples_depth}});
  return rows;
}

}  // namespace sqmap::apps
