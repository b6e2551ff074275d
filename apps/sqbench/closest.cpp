// SPDX-License-Identifier: GPL-3.0-or-later
#include "closest.hpp"

#include <cmath>
#include <map>
#include <utility>

namespace sqmap::bench {

OnTriangle nearest_on_triangle(const Vec3d& p, const std::array<Vec3d, 3>& corner) noexcept {
  const Vec3d normal = cross(corner[1] - corner[0], corner[2] - corner[0]);
  const double area = dot(normal, normal);
  bool is_within = area > 0;
  double weight[3] = {};  // of the corners, times area, for the foot on the plane
  for (int k = 0; k < 3; ++k) {
    const Vec3d& a = corner[static_cast<std::size_t>((k + 1) % 3)];
    const Vec3d& b = corner[static_cast<std::size_t>((k + 2) % 3)];
    weight[k] = dot(normal, cross(b - a, p - a));
    is_within = is_within && weight[k] > 0;
  }
  if (is_within) {
    const double height = dot(normal, p - corner[0]) / area;
    return {p - height * normal, 6};
  }
  OnTriangle best{corner[0], 0};
  double best_square = INFINITY;
  for (int k = 0; k < 3; ++k) {
    const Vec3d& a = corner[static_cast<std::size_t>(k)];
    const Vec3d& b = corner[static_cast<std::size_t>((k + 1) % 3)];
    const Vec3d ab = b - a;
    const double along = dot(ab, p - a), length = dot(ab, ab);
    const OnTriangle here = along <= 0        ? OnTriangle{a, k}
                            : along >= length ? OnTriangle{b, (k + 1) % 3}
                                              : OnTriangle{a + (along / length) * ab, 3 + k};
    const Vec3d d = p - here.point_m;
    if (dot(d, d) < best_square) {
      best_square = dot(d, d);
      best = here;
    }
  }
  return best;
}

Pseudonormals::Pseudonormals(const bake::Mesh& mesh) {
  std::vector<Vec3d> vertex(mesh.vertices_m.size());
  std::map<std::pair<std::uint32_t, std::uint32_t>, Vec3d> edge;
  std::vector<Vec3d> face_normal;
  face_normal.reserve(mesh.faces.size());
  const auto key = [](std::uint32_t a, std::uint32_t b) { return std::pair{std::min(a, b), std::max(a, b)}; };
  for (const auto& face : mesh.faces) {
    const Vec3d normal = normalized(cross(mesh.vertices_m[face[1]] - mesh.vertices_m[face[0]],
                                          mesh.vertices_m[face[2]] - mesh.vertices_m[face[0]]));
    face_normal.push_back(normal);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = face[k], b = face[(k + 1) % 3], c = face[(k + 2) % 3];
      const Vec3d ab = normalized(mesh.vertices_m[b] - mesh.vertices_m[a]);
      const Vec3d ac = normalized(mesh.vertices_m[c] - mesh.vertices_m[a]);
      vertex[a] = vertex[a] + std::atan2(norm(cross(ab, ac)), dot(ab, ac)) * normal;
      edge[key(a, b)] = edge[key(a, b)] + normal;
    }
  }
  vertices_.reserve(vertex.size());
  for (const Vec3d& n : vertex) vertices_.push_back(cast<float>(n));
  faces_.reserve(mesh.faces.size());
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    Face face{mesh.faces[f], cast<float>(face_normal[f]), {}};
    for (std::size_t k = 0; k < 3; ++k)
      face.edge[k] = cast<float>(edge[key(face.vertex[k], face.vertex[(k + 1) % 3])]);
    faces_.push_back(face);
  }
}

Vec3d Pseudonormals::at(std::uint32_t face, int feature) const noexcept {
  const Face& here = faces_[face];
  const auto k = static_cast<std::size_t>(feature);
  return cast<double>(k < 3 ? vertices_[here.vertex[k]] : k < 6 ? here.edge[k - 3] : here.normal);
}

std::size_t Pseudonormals::bytes() const noexcept {
  return sizeof(*this) + faces_.capacity() * sizeof(Face) + vertices_.capacity() * sizeof(Vec3f);
}

}  // namespace sqmap::bench
