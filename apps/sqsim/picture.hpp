// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "sqmap/asset/asset.hpp"
#include "sqmap/runtime/instance.hpp"

#include "../common/part_surface.hpp"

namespace sqmap::apps {

/// An object to draw: the surface that its maps represent, in the colours of its parts.
struct DrawnObject {
  std::string name;
  const Asset* asset;
  runtime::Placement placement;
};

/// A scene as binary glTF: a group an object, and `moving` (a probe or a cloth, world frame) in white.
Result<std::vector<std::uint8_t>> picture_glb(std::span<const DrawnObject> objects, const std::string& name,
                                              const TriangleSurface& moving);

/// The points under a pose.
TriangleSurface moved(TriangleSurface surface, const Pose& pose);

}  // namespace sqmap::apps
