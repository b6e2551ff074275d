// SPDX-License-Identifier: GPL-3.0-or-later
#include "mesh_order.hpp"

#include <algorithm>
#include <numeric>
#include <tuple>

namespace sqmap::bake {

Mesh in_own_order(const Mesh& mesh) {
  const std::vector<Vec3d>& points_m = mesh.vertices_m;
  std::vector<std::uint32_t> order(points_m.size());
  std::iota(order.begin(), order.end(), 0U);
  // Sums depend on the order of their terms: it must be settled before the mean is taken.
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t i, std::uint32_t k) {
    const Vec3d &a = points_m[i], &b = points_m[k];
    return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
  });
  Vec3d sum_m;
  for (const std::uint32_t i : order) sum_m = sum_m + points_m[i];
  const Vec3d mean_m = (1 / static_cast<double>(std::max<std::size_t>(1, points_m.size()))) * sum_m;
  std::vector<double> square(points_m.size());
  for (std::size_t i = 0; i < square.size(); ++i) square[i] = dot(points_m[i] - mean_m, points_m[i] - mean_m);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t i, std::uint32_t k) { return square[i] < square[k]; });

  Mesh result;
  std::vector<std::uint32_t> place(points_m.size());
  for (const std::uint32_t i : order) {
    place[i] = static_cast<std::uint32_t>(result.vertices_m.size());
    result.vertices_m.push_back(points_m[i]);
  }
  std::vector<std::array<std::uint32_t, 3>> faces = mesh.faces;
  for (auto& face : faces) {
    for (std::uint32_t& v : face) v = place[v];
    std::rotate(face.begin(), std::min_element(face.begin(), face.end()), face.end());
  }
  std::vector<std::uint32_t> face_order(faces.size());
  std::iota(face_order.begin(), face_order.end(), 0U);
  std::stable_sort(face_order.begin(), face_order.end(),
                   [&](std::uint32_t i, std::uint32_t k) { return faces[i] < faces[k]; });
  for (const std::uint32_t f : face_order) {
    result.faces.push_back(faces[f]);
    result.source_face.push_back(mesh.source_face[f]);
  }
  return result;
}

}  // namespace sqmap::bake
