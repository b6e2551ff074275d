// SPDX-License-Identifier: Apache-2.0
//
// The text of a scene file of sqsim.
#include <cmath>
#include <filesystem>
#include <string_view>

#include "../../apps/sqsim/scene_file.hpp"
#include "formats/bundle_bytes.hpp"
#include "fuzz/target.hpp"

namespace {

bool is_finite(const sqmap::Vec3d& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

constexpr std::string_view kProbeScene = R"({"schema": "sqmap.scene/1", "rate_hz": 1000, "seconds": 2,
 "query": {"layer": 3, "level": 0},
 "objects": [{"bundle": "a.h5", "name": "a", "position_m": [0, 0, 1], "orientation_wxyz": [1, 0, 0, 0],
              "scale": 2, "mirrored": true}],
 "probe": {"points_m": [[0, 0, 0], [0.1, 0, 0]], "keyframes": [{"time_s": 0, "position_m": [0, 0, 3]},
           {"time_s": 1, "position_m": [0, 0, 0], "orientation_wxyz": [0, 1, 0, 0]}], "coupling": {"mass_kg": 0.2}},
 "effects": {"reaction": {}, "friction": {}}})";
constexpr std::string_view kClothScene = R"({"schema": "sqmap.scene/1", "objects": [{"bundle": "a.h5"}],
 "cloth": {"centre_m": [0, 0, 1], "edge_m": 1, "nodes_along_edge": 9, "mass_kg": 0.3, "friction": 0.5}})";

}  // namespace

std::vector<sqmap::fuzz::Bytes> sqmap::fuzz::seeds() {
  return {{kProbeScene.begin(), kProbeScene.end()}, {kClothScene.begin(), kClothScene.end()}};
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const sqmap::test::TemporaryFolder kFolder;
  static const std::string kPath = kFolder.path() + "/scene.json";
  sqmap::test::store(kPath, sqmap::fuzz::Bytes(data, data + size));
  const auto scene = sqmap::apps::read_scene_file(kPath);
  using sqmap::fuzz::require;
  if (!scene) {
    require(!scene.error().finding.empty() && !scene.error().remedy.empty(),
            "a refusal says what was found and what to do");
    return 0;
  }
  const auto& file = scene.value();
  require(file.rate_hz >= 1 && file.rate_hz <= 1e5 && file.seconds > 0 && file.seconds <= 1e5,
          "rate and time in range");
  require(!file.objects.empty(), "a scene has objects");
  for (const auto& object : file.objects)
    require(is_finite(object.placement.world_from_object.translation_m) && object.placement.scale > 0,
            "placements are finite");
  if (file.probe)
    for (const auto& key : file.probe->keyframes)
      require(std::isfinite(key.time_s) && is_finite(key.pose.translation_m), "keyframes are finite");
  return 0;
}
