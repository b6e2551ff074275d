// SPDX-License-Identifier: Apache-2.0
#include "picture.hpp"

#include <utility>

#include <fmt/format.h>

#include "../common/glb_writer.hpp"

namespace sqmap::apps {
namespace {

constexpr GlbScene::Color kMovingColor{0.9F, 0.9F, 0.85F, 1};

/// A part's surface in the world. glTF could hold the placement in nodes; written out, mirrored triangles can
/// be turned round.
TriangleSurface placed(TriangleSurface surface, const Pose& object_from_part,
                       const runtime::Placement& placement) {
  const Rotation<double> part = rotation(object_from_part.orientation),
                         world = rotation(placement.world_from_object.orientation);
  const auto turned = [&](Vec3d v) {
    if (placement.mirrored) v.x = -v.x;
    return world.apply(v);
  };
  for (Vec3f& p : surface.points_m)
    p = cast<float>(turned(placement.scale * (part.apply(cast<double>(p)) + object_from_part.translation_m)) +
                    placement.world_from_object.translation_m);
  for (Vec3f& n : surface.normals) n = cast<float>(turned(part.apply(cast<double>(n))));
  if (placement.mirrored)
    for (auto& triangle : surface.triangles) std::swap(triangle[1], triangle[2]);
  return surface;
}

}  // namespace

TriangleSurface moved(TriangleSurface surface, const Pose& pose) {
  const Rotation<double> turn = rotation(pose.orientation);
  for (Vec3f& p : surface.points_m) p = cast<float>(turn.apply(cast<double>(p)) + pose.translation_m);
  return surface;
}

Result<std::vector<std::uint8_t>> picture_glb(std::span<const DrawnObject> objects, const std::string& name,
                                              const TriangleSurface& moving) {
  GlbScene scene;
  for (const DrawnObject& object : objects) {
    const std::size_t group = scene.add_group(object.name);
    for (std::size_t i = 0; i < object.asset->parts.size(); ++i) {
      const Part& part = object.asset->parts[i];
      scene.add_mesh(group, fmt::format("part {:02}", i),
                     placed(mapped_surface(part, 0), part.object_from_part, object.placement),
                     part_color(i, 1));
    }
  }
  scene.add_mesh(GlbScene::kRoot, name, moving, kMovingColor);
  return scene.bytes();
}

}  // namespace sqmap::apps
