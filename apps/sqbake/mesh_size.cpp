// SPDX-License-Identifier: GPL-3.0-or-later
#include "mesh_size.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace sqmap::apps {
namespace {

// Haptic and game objects lie far inside this range; outside it the usual cause is millimetres read as
// metres.
constexpr double kSmallestUsual_m = 1e-3;
constexpr double kLargestUsual_m = 1e3;

}  // namespace

double diagonal_m(const bake::Mesh& mesh) {
  if (mesh.vertices_m.empty()) return 0;
  Vec3d low = mesh.vertices_m.front(), high = low;
  for (const Vec3d& v : mesh.vertices_m) {
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], v[axis]);
      high[axis] = std::max(high[axis], v[axis]);
    }
  }
  return norm(high - low);
}

std::optional<std::string> size_warning(const bake::Mesh& mesh) {
  const double size_m = diagonal_m(mesh);
  if (size_m >= kSmallestUsual_m && size_m <= kLargestUsual_m) return std::nullopt;
  return fmt::format("the object is {:.3g} m across; if that is wrong, give the unit with --unit", size_m);
}

}  // namespace sqmap::apps
