// SPDX-License-Identifier: Apache-2.0
#include "json_text.hpp"

#include <nlohmann/json.hpp>

namespace sqmap::apps {

using Json = nlohmann::ordered_json;

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
