// SPDX-License-Identifier: GPL-3.0-or-later
#include "curvature.hpp"

#include <cmath>
#include <numbers>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace sqmap::bake {
namespace {

struct VertexMeasure {
  double area{}, deficit{};
  BendTensor bend;  // sum over edges of length times angle times the projector on the edge
};

double corner_angle(const Vec3d& at, const Vec3d& b, const Vec3d& c) {
  const Vec3d u = b - at, v = c - at;
  return std::atan2(norm(cross(u, v)), dot(u, v));
}

std::vector<VertexMeasure> vertex_measures(const Surface& surface) {
  std::vector<VertexMeasure> measures(surface.points.size());
  for (std::size_t v = 0; v < measures.size(); ++v)
    if (!surface.on_boundary[v]) {
      measures[v].area = surface.vertex_area[v];
      measures[v].deficit = 2 * std::numbers::pi;
    }
  for (const auto& face : surface.faces)
    for (int corner = 0; corner < 3; ++corner)
      if (!surface.on_boundary[face[corner]])
        measures[face[corner]].deficit -=
            corner_angle(surface.points[face[corner]], surface.points[face[(corner + 1) % 3]],
                         surface.points[face[(corner + 2) % 3]]);
  for (const Link& link : surface.links) {
    const Vec3d along = normalized(surface.points[link.vertex[1]] - surface.points[link.vertex[0]]);
    for (const std::uint32_t v : link.vertex)
      if (!surface.on_boundary[v]) measures[v].bend.add(0.5 * link.length * link.bend_rad, along);
  }
  return measures;
}

}  // namespace

Curvature curvature(const Surface& surface, double radius) {
  const std::vector<VertexMeasure> measures = vertex_measures(surface);
  const std::size_t point_count = surface.points.size();
  Curvature result{std::vector<double>(point_count, 0), std::vector<BendTensor>(point_count)};
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, point_count, 512), [&](const auto& range) {
    std::vector<std::uint32_t> seen(point_count, 0xFFFFFFFF), window;
    for (std::size_t centre = range.begin(); centre != range.end(); ++centre) {
      const auto start = static_cast<std::uint32_t>(centre);
      window.assign(1, start);
      seen[centre] = start;
      VertexMeasure sum;
      for (std::size_t next = 0; next < window.size(); ++next) {
        const VertexMeasure& measure = measures[window[next]];
        sum.area += measure.area;
        sum.deficit += measure.deficit;
        sum.bend.add(1, measure.bend);
        for (const std::uint32_t f : surface.faces_of_vertex[window[next]])
          for (const std::uint32_t w : surface.faces[f]) {
            if (seen[w] == start) continue;
            seen[w] = start;
            const Vec3d offset = surface.points[w] - surface.points[centre];
            if (dot(offset, offset) < radius * radius) window.push_back(w);
          }
      }
      if (!(sum.area > 0)) continue;
      result.gaussian[centre] = sum.deficit / sum.area;
      result.bend[centre].add(1 / sum.area, sum.bend);
    }
  });
  return result;
}

}  // namespace sqmap::bake
