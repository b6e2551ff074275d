// SPDX-License-Identifier: GPL-3.0-or-later
#include "surface.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace sqmap::bake {
namespace {

struct HalfEdge {
  std::uint32_t low, high;  // vertices, low < high
  std::uint32_t face;
  bool forward;  // the face runs from low to high
};

double signed_volume(const Surface& surface) {
  double six_volumes = 0;
  for (const auto& [a, b, c] : surface.faces)
    six_volumes += dot(surface.points[a], cross(surface.points[b], surface.points[c]));
  return six_volumes / 6;
}

void measure_faces(Surface& surface) {
  const std::size_t face_count = surface.faces.size();
  surface.area.resize(face_count);
  surface.normal.resize(face_count);
  surface.centroid.resize(face_count);
  for (std::size_t f = 0; f < face_count; ++f) {
    const Vec3d& a = surface.points[surface.faces[f][0]];
    const Vec3d& b = surface.points[surface.faces[f][1]];
    const Vec3d& c = surface.points[surface.faces[f][2]];
    const Vec3d twice_area = cross(b - a, c - a);
    surface.area[f] = 0.5 * norm(twice_area);
    surface.normal[f] = normalized(twice_area);
    surface.centroid[f] = (1.0 / 3.0) * (a + b + c);
  }
}

// Moves to the area-weighted centroid and scales to unit area.
void normalise(Surface& surface) {
  measure_faces(surface);
  double area = 0;
  Vec3d moment{};
  for (std::size_t f = 0; f < surface.faces.size(); ++f) {
    area += surface.area[f];
    moment = moment + surface.area[f] * surface.centroid[f];
  }
  surface.scale_m = std::sqrt(area);
  if (!(area > 0)) return;
  const Vec3d centre = (1 / area) * moment;
  for (Vec3d& p : surface.points) p = (1 / surface.scale_m) * (p - centre);
}

double bend_rad(const Surface& surface, const HalfEdge& a, const HalfEdge& b) {
  if (a.forward == b.forward) return 0;  // orientations disagree: neither convex nor concave
  const Vec3d& na = surface.normal[a.face];
  const Vec3d& nb = surface.normal[b.face];
  const Vec3d along = normalized(surface.points[a.high] - surface.points[a.low]);
  const double sine = dot(cross(na, nb), along);
  return std::atan2(a.forward ? sine : -sine, dot(na, nb));
}

void link_faces(Surface& surface) {
  std::vector<HalfEdge> half_edges;
  half_edges.reserve(3 * surface.faces.size());
  for (std::uint32_t f = 0; f < surface.faces.size(); ++f)
    for (int corner = 0; corner < 3; ++corner) {
      const std::uint32_t u = surface.faces[f][corner], v = surface.faces[f][(corner + 1) % 3];
      half_edges.push_back({std::min(u, v), std::max(u, v), f, u < v});
    }
  std::sort(half_edges.begin(), half_edges.end(), [](const HalfEdge& a, const HalfEdge& b) {
    if (a.low != b.low) return a.low < b.low;
    return a.high != b.high ? a.high < b.high : a.face < b.face;
  });

  surface.on_boundary.assign(surface.points.size(), 0);
  surface.is_closed = true;
  for (std::size_t begin = 0; begin < half_edges.size();) {
    std::size_t end = begin + 1;
    while (end < half_edges.size() && half_edges[end].low == half_edges[begin].low &&
           half_edges[end].high == half_edges[begin].high)
      ++end;
    const std::uint32_t low = half_edges[begin].low, high = half_edges[begin].high;
    if (end - begin != 2) {
      surface.is_closed = false;
      surface.on_boundary[low] = surface.on_boundary[high] = 1;
    }
    for (std::size_t i = begin; i + 1 < end; ++i)
      surface.links.push_back({{half_edges[i].face, half_edges[i + 1].face},
                               {low, high},
                               norm(surface.points[high] - surface.points[low]),
                               bend_rad(surface, half_edges[i], half_edges[i + 1])});
    begin = end;
  }
}

}  // namespace

Rows group_rows(std::size_t row_count, std::span<const std::array<std::uint32_t, 2>> pairs) {
  Rows rows;
  rows.begin.assign(row_count + 1, 0);
  for (const auto& pair : pairs) ++rows.begin[pair[0] + 1];
  for (std::size_t i = 0; i < row_count; ++i) rows.begin[i + 1] += rows.begin[i];
  rows.values.resize(pairs.size());
  std::vector<std::uint32_t> next(rows.begin.begin(), rows.begin.end() - 1);
  for (const auto& pair : pairs) rows.values[next[pair[0]]++] = pair[1];
  return rows;
}

Surface make_surface(const Triangles& triangles) {
  Surface surface;
  surface.points = triangles.points;
  surface.faces = triangles.faces;
  normalise(surface);
  measure_faces(surface);
  link_faces(surface);
  if (surface.is_closed && signed_volume(surface) < 0) {
    for (Vec3d& n : surface.normal) n = -n;
    for (Link& link : surface.links) link.bend_rad = -link.bend_rad;
  }

  std::vector<std::array<std::uint32_t, 2>> pairs;
  for (std::uint32_t i = 0; i < surface.links.size(); ++i)
    for (const std::uint32_t f : surface.links[i].face) pairs.push_back({f, i});
  surface.links_of_face = group_rows(surface.faces.size(), pairs);

  pairs.clear();
  surface.vertex_normal.assign(surface.points.size(), {});
  surface.vertex_area.assign(surface.points.size(), 0);
  for (std::uint32_t f = 0; f < surface.faces.size(); ++f)
    for (const std::uint32_t v : surface.faces[f]) {
      pairs.push_back({v, f});
      surface.vertex_normal[v] = surface.vertex_normal[v] + surface.area[f] * surface.normal[f];
      surface.vertex_area[v] += surface.area[f] / 3;
    }
  surface.faces_of_vertex = group_rows(surface.points.size(), pairs);
  for (Vec3d& n : surface.vertex_normal) n = normalized(n);
  return surface;
}

Triangles extract(const std::vector<Vec3d>& points,
                  const std::vector<std::array<std::uint32_t, 3>>& all_faces,
                  std::span<const std::uint32_t> faces) {
  Triangles part;
  part.faces.reserve(faces.size());
  std::unordered_map<std::uint32_t, std::uint32_t> index_of;
  for (const std::uint32_t f : faces) {
    std::array<std::uint32_t, 3> face{};
    for (int corner = 0; corner < 3; ++corner) {
      const auto [entry, is_new] =
          index_of.try_emplace(all_faces[f][corner], static_cast<std::uint32_t>(part.points.size()));
      if (is_new) part.points.push_back(points[entry->first]);
      face[corner] = entry->second;
    }
    part.faces.push_back(face);
  }
  return part;
}

}  // namespace sqmap::bake
