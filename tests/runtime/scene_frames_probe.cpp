// SPDX-License-Identifier: Apache-2.0
// scene_frames_probe FRAMES [EFFECT...]: frames of a scene with the reaction and the effects named, for the
// test that counts their instructions. Exit code 0 when the contacts push.
#include <cstdlib>

#include "sqmap/runtime/scene.hpp"

#include "touch_shapes.hpp"

int main(int argc, char** argv) {
  using namespace sqmap;
  if (argc < 2) return 2;
  const Asset asset = test::asset_of(
      {test::traced_part(
          {{1, 1, 1}, 1, 1}, {}, 17, 32, 1, 1,
          [](const Vec3d& origin_m, const Vec3d& direction, bool& inside) {
            return test::union_crossings_m({{{}, test::kBallRadius_m}}, origin_m, direction, inside);
          })},
      2 * test::kBallRadius_m);
  runtime::SceneOptions options;
  options.effects = {{"reaction", {}}};
  for (int i = 2; i < argc; ++i) options.effects.push_back({argv[i], {}});
  const std::vector<runtime::SceneObject> objects{{&asset, {}}};
  auto scene = runtime::Scene::build(objects, {test::sphere_points(300, 0.2, {})}, options);
  if (!scene) return 2;
  bool pushes = true;
  const long frames = std::strtol(argv[1], nullptr, 10);
  for (long frame = 0; frame < frames; ++frame) {
    const double x_m = 0.95 + 1e-4 * static_cast<double>(frame % 100);
    pushes = scene.value().frame({{}, {x_m, 0, 0}}, {}, 1e-3F).wrench.force_n.x > 0 && pushes;
  }
  return pushes ? 0 : 1;
}
