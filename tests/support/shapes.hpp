// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <map>
#include <numbers>
#include <numeric>
#include <random>
#include <utility>
#include <vector>

#include "sqmap/asset/vec.hpp"
#include "sqmap/bake/mesh.hpp"

/// Meshes of analytic shapes. Every closed one is manifold, outward and centred at the origin unless it says
/// otherwise; its vertices lie on the shape, so its volume is a little below the shape's.
namespace sqmap::test {

using bake::Mesh;

inline void number_faces(Mesh& mesh) {
  mesh.source_face.resize(mesh.faces.size());
  std::iota(mesh.source_face.begin(), mesh.source_face.end(), 0U);
}

/// What a reader would have made of the mesh.
inline bake::SourceMesh as_source(Mesh mesh) {
  bake::SourceMesh source;
  source.source_face_count = static_cast<std::uint32_t>(mesh.faces.size());
  source.name = "shape.off";
  source.hash = "00000000000000000000000000000000";
  source.mesh = std::move(mesh);
  return source;
}

/// Signed volume by the divergence theorem [m^3].
inline double signed_volume_m3(const Mesh& mesh) {
  double six_volumes = 0;
  for (const auto& [a, b, c] : mesh.faces)
    six_volumes += dot(mesh.vertices_m[a], cross(mesh.vertices_m[b], mesh.vertices_m[c]));
  return six_volumes / 6;
}

/// The mesh with every vertex replaced by map(vertex). A map that mirrors turns the mesh inside out.
template <class Map>
Mesh mapped(Mesh mesh, const Map& map) {
  for (Vec3d& p_m : mesh.vertices_m) p_m = map(p_m);
  return mesh;
}

inline Mesh transformed(Mesh mesh, const Pose& pose, double scale = 1) {
  const Rotation<double> turn = rotation(pose.orientation);
  return mapped(std::move(mesh), [&](const Vec3d& p) { return turn.apply(scale * p) + pose.translation_m; });
}

inline Mesh translated(Mesh mesh, const Vec3d& by_m) { return transformed(std::move(mesh), {{}, by_m}); }

/// All faces turned round.
inline Mesh flipped(Mesh mesh) {
  for (auto& face : mesh.faces) std::swap(face[1], face[2]);
  return mesh;
}

/// All meshes in one, none of their vertices shared.
inline Mesh joined(std::initializer_list<Mesh> meshes) {
  Mesh all;
  for (const Mesh& mesh : meshes) {
    const auto offset = static_cast<std::uint32_t>(all.vertices_m.size());
    all.vertices_m.insert(all.vertices_m.end(), mesh.vertices_m.begin(), mesh.vertices_m.end());
    for (const auto& [a, b, c] : mesh.faces) all.faces.push_back({a + offset, b + offset, c + offset});
  }
  number_faces(all);
  return all;
}

/// Each face cut into four at the midpoints of its edges; the four keep its source face.
inline Mesh subdivided(const Mesh& mesh) {
  Mesh fine;
  fine.vertices_m = mesh.vertices_m;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> midpoints;
  const auto midpoint = [&](std::uint32_t a, std::uint32_t b) {
    const auto next = static_cast<std::uint32_t>(fine.vertices_m.size());
    const auto [at, is_new] = midpoints.try_emplace(std::minmax(a, b), next);
    if (is_new) fine.vertices_m.push_back(0.5 * (mesh.vertices_m[a] + mesh.vertices_m[b]));
    return at->second;
  };
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    const auto [a, b, c] = mesh.faces[f];
    const std::uint32_t ab = midpoint(a, b), bc = midpoint(b, c), ca = midpoint(c, a);
    for (const auto& face : {std::array{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}}) {
      fine.faces.push_back(face);
      fine.source_face.push_back(f < mesh.source_face.size() ? mesh.source_face[f] : bake::kNewFace);
    }
  }
  return fine;
}

/// The same surface with vertices, faces and the first corner of each face in another order.
inline Mesh shuffled(const Mesh& mesh, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto permutation = [&](std::size_t count) {
    std::vector<std::uint32_t> order(count);
    std::iota(order.begin(), order.end(), 0U);
    for (std::size_t i = count; i > 1; --i) std::swap(order[i - 1], order[random() % i]);
    return order;
  };
  const auto new_index = permutation(mesh.vertices_m.size());
  Mesh other;
  other.vertices_m.resize(mesh.vertices_m.size());
  for (std::size_t v = 0; v < new_index.size(); ++v) other.vertices_m[new_index[v]] = mesh.vertices_m[v];
  for (const std::uint32_t f : permutation(mesh.faces.size())) {
    std::array<std::uint32_t, 3> face{};
    const std::size_t turn = random() % 3;
    for (std::size_t k = 0; k < 3; ++k) face[k] = new_index[mesh.faces[f][(k + turn) % 3]];
    other.faces.push_back(face);
    other.source_face.push_back(mesh.source_face[f]);
  }
  return other;
}

/// Icosahedron subdivided `level` times: 20 * 4^level faces, 10 * 4^level + 2 vertices.
inline Mesh ellipsoid(const Vec3d& semi_axes_m, int level) {
  const double g = std::numbers::phi;
  Mesh mesh;
  mesh.vertices_m = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                     {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  mesh.faces = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (int i = 0; i <= level; ++i) {
    if (i > 0) mesh = subdivided(mesh);
    mesh = mapped(std::move(mesh), [](const Vec3d& p) { return normalized(p); });
  }
  number_faces(mesh);
  return mapped(std::move(mesh), [&](const Vec3d& p) {
    return Vec3d{semi_axes_m.x * p.x, semi_axes_m.y * p.y, semi_axes_m.z * p.z};
  });
}

inline Mesh sphere(double radius_m, int level, const Vec3d& centre_m = {}) {
  return translated(ellipsoid({radius_m, radius_m, radius_m}, level), centre_m);
}

/// 8 vertices, 12 faces.
inline Mesh box(const Vec3d& half_m, const Vec3d& centre_m = {}) {
  Mesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.vertices_m.push_back(centre_m + Vec3d{i & 1 ? half_m.x : -half_m.x, i & 2 ? half_m.y : -half_m.y,
                                               i & 4 ? half_m.z : -half_m.z});
  mesh.faces = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  number_faces(mesh);
  return mesh;
}

/// A box with a box-shaped cavity whose faces look into the cavity: walls of the given thickness.
inline Mesh hollow_box(const Vec3d& half_m, double wall_m) {
  return joined({box(half_m), flipped(box(half_m - Vec3d{wall_m, wall_m, wall_m}))});
}

/// A closed plate, thickness along z.
inline Mesh thin_sheet(double side_m, double thickness_m) {
  return box({side_m / 2, side_m / 2, thickness_m / 2});
}

/// An open square grid of 2 * cells^2 faces in the plane z = 0, looking up: 4 * cells boundary edges.
inline Mesh open_sheet(double side_m, std::uint32_t cells) {
  Mesh mesh;
  for (std::uint32_t j = 0; j <= cells; ++j)
    for (std::uint32_t i = 0; i <= cells; ++i)
      mesh.vertices_m.push_back({side_m * (double(i) / cells - 0.5), side_m * (double(j) / cells - 0.5), 0});
  for (std::uint32_t j = 0; j < cells; ++j)
    for (std::uint32_t i = 0; i < cells; ++i) {
      const std::uint32_t a = j * (cells + 1) + i, b = a + 1, c = b + cells + 1, d = a + cells + 1;
      mesh.faces.push_back({a, b, c});
      mesh.faces.push_back({a, c, d});
    }
  number_faces(mesh);
  return mesh;
}

/// Surface of revolution about z. The profile (radius, z) climbs from pole to pole, both on the axis.
inline Mesh revolved(const std::vector<std::pair<double, double>>& profile_m, std::uint32_t segments) {
  Mesh mesh;
  const auto rings = static_cast<std::uint32_t>(profile_m.size()) - 2;
  const std::uint32_t top = rings * segments, bottom = top + 1;
  for (std::uint32_t j = 1; j <= rings; ++j)
    for (std::uint32_t i = 0; i < segments; ++i) {
      const double angle_rad = 2 * std::numbers::pi * i / segments;
      const auto [r, z] = profile_m[j];
      mesh.vertices_m.push_back({r * std::cos(angle_rad), r * std::sin(angle_rad), z});
    }
  mesh.vertices_m.push_back({0, 0, profile_m.back().second});
  mesh.vertices_m.push_back({0, 0, profile_m.front().second});
  for (std::uint32_t i = 0; i < segments; ++i) {
    const std::uint32_t k = (i + 1) % segments, last = (rings - 1) * segments;
    mesh.faces.push_back({bottom, k, i});
    for (std::uint32_t j = 0; j + 1 < rings; ++j) {
      const std::uint32_t low = j * segments, high = low + segments;
      mesh.faces.push_back({low + i, low + k, high + k});
      mesh.faces.push_back({low + i, high + k, high + i});
    }
    mesh.faces.push_back({last + i, last + k, top});
  }
  number_faces(mesh);
  return mesh;
}

inline Mesh cylinder(double radius_m, double half_height_m, std::uint32_t segments) {
  const double r = radius_m, h = half_height_m;
  return revolved({{0, -h}, {r, -h}, {r, h}, {0, h}}, segments);
}

/// Base in the plane z = 0, apex at z = height.
inline Mesh cone(double radius_m, double height_m, std::uint32_t segments) {
  return revolved({{0, 0}, {radius_m, 0}, {0, height_m}}, segments);
}

/// Half circles of `steps` chords each, for the profiles of capsule() and two_spheres().
inline void append_arc(std::vector<std::pair<double, double>>& profile_m, double radius_m, double centre_z_m,
                       double from_rad, double to_rad, int steps) {
  for (int i = 0; i <= steps; ++i) {
    const double eta_rad = from_rad + (to_rad - from_rad) * i / steps;
    const bool on_axis = std::abs(std::abs(eta_rad) - std::numbers::pi / 2) < 1e-12;
    profile_m.emplace_back(on_axis ? 0 : radius_m * std::cos(eta_rad),
                           centre_z_m + radius_m * std::sin(eta_rad));
  }
}

/// A cylinder along z, -half_length .. half_length, with half spheres on its ends.
inline Mesh capsule(double radius_m, double half_length_m, std::uint32_t segments) {
  const double quarter_rad = std::numbers::pi / 2;
  const int steps = static_cast<int>(segments / 4) + 1;
  std::vector<std::pair<double, double>> profile_m;
  append_arc(profile_m, radius_m, -half_length_m, -quarter_rad, 0, steps);
  append_arc(profile_m, radius_m, half_length_m, 0, quarter_rad, steps);
  return revolved(profile_m, segments);
}

/// Union of two overlapping spheres of equal radius at z = -+half_distance, one closed surface with a crease
/// at z = 0 (paper Fig. 4). Needs half_distance < radius.
inline Mesh two_spheres(double radius_m, double half_distance_m, std::uint32_t segments) {
  const double quarter_rad = std::numbers::pi / 2, crease_rad = std::asin(half_distance_m / radius_m);
  const int steps = static_cast<int>(segments / 2);
  std::vector<std::pair<double, double>> profile_m;
  append_arc(profile_m, radius_m, -half_distance_m, -quarter_rad, crease_rad, steps);
  profile_m.pop_back();  // both arcs end on the crease
  append_arc(profile_m, radius_m, half_distance_m, -crease_rad, quarter_rad, steps);
  return revolved(profile_m, segments);
}

/// Tube of `sides` sides round the axis z; genus 1; 2 * rings * sides faces.
inline Mesh torus(double major_m, double minor_m, std::uint32_t rings, std::uint32_t sides) {
  Mesh mesh;
  for (std::uint32_t i = 0; i < rings; ++i)
    for (std::uint32_t j = 0; j < sides; ++j) {
      const double u = 2 * std::numbers::pi * i / rings, v = 2 * std::numbers::pi * j / sides;
      const double r = major_m + minor_m * std::cos(v);
      mesh.vertices_m.push_back({r * std::cos(u), r * std::sin(u), minor_m * std::sin(v)});
    }
  for (std::uint32_t i = 0; i < rings; ++i)
    for (std::uint32_t j = 0; j < sides; ++j) {
      const std::uint32_t here = i * sides, there = (i + 1) % rings * sides, k = (j + 1) % sides;
      mesh.faces.push_back({here + j, there + j, there + k});
      mesh.faces.push_back({here + j, there + k, here + k});
    }
  number_faces(mesh);
  return mesh;
}

/// A round wire wound about z, from z = 0 upwards, with flat ends.
inline Mesh spring(double coil_radius_m, double wire_radius_m, double pitch_m, double turns,
                   std::uint32_t rings_per_turn, std::uint32_t sides) {
  Mesh mesh;
  const auto rings = static_cast<std::uint32_t>(turns * rings_per_turn) + 1;
  const auto centre_m = [&](double u) {
    return Vec3d{coil_radius_m * std::cos(u), coil_radius_m * std::sin(u),
                 pitch_m * u / (2 * std::numbers::pi)};
  };
  const double end_rad = 2 * std::numbers::pi * turns;
  for (std::uint32_t i = 0; i < rings; ++i) {
    const double u = end_rad * i / (rings - 1);
    const Vec3d out{std::cos(u), std::sin(u), 0};
    const Vec3d along =
        normalized(Vec3d{-coil_radius_m * out.y, coil_radius_m * out.x, pitch_m / (2 * std::numbers::pi)});
    const Vec3d up = cross(out, along);
    for (std::uint32_t j = 0; j < sides; ++j) {
      const double v = 2 * std::numbers::pi * j / sides;
      mesh.vertices_m.push_back(centre_m(u) + wire_radius_m * (std::cos(v) * out + std::sin(v) * up));
    }
  }
  const std::uint32_t first = rings * sides, last = first + 1, end = (rings - 1) * sides;
  mesh.vertices_m.push_back(centre_m(0));
  mesh.vertices_m.push_back(centre_m(end_rad));
  for (std::uint32_t j = 0; j < sides; ++j) {
    const std::uint32_t k = (j + 1) % sides;
    mesh.faces.push_back({first, j, k});
    for (std::uint32_t here = 0; here < end; here += sides) {
      mesh.faces.push_back({here + j, here + sides + j, here + sides + k});
      mesh.faces.push_back({here + j, here + sides + k, here + k});
    }
    mesh.faces.push_back({last, end + k, end + j});
  }
  number_faces(mesh);
  return mesh;
}

/// Two arms of a square section `width` at a right angle in the plane z = 0, corner at the origin.
inline Mesh l_shape(double arm_m, double width_m) {
  const double a = arm_m, w = width_m;
  const std::array<Vec3d, 6> outline_m{Vec3d{0, 0, 0}, {a, 0, 0}, {a, w, 0}, {w, w, 0}, {w, a, 0}, {0, a, 0}};
  Mesh mesh;
  for (const double z_m : {-w / 2, w / 2})
    for (const Vec3d& p_m : outline_m) mesh.vertices_m.push_back(p_m + Vec3d{0, 0, z_m});
  for (std::uint32_t i = 0; i < 6; ++i) {
    const std::uint32_t k = (i + 1) % 6;
    mesh.faces.push_back({i, k, k + 6});
    mesh.faces.push_back({i, k + 6, i + 6});
    if (i == 3 || k == 3) continue;  // every cap triangle has the inner corner, vertex 3
    mesh.faces.push_back({9, i + 6, k + 6});
    mesh.faces.push_back({3, k, i});
  }
  number_faces(mesh);
  return mesh;
}

}  // namespace sqmap::test
