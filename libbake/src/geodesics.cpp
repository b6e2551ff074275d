// SPDX-License-Identifier: GPL-3.0-or-later
#include "geodesics.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <queue>
#include <unordered_map>

#include <tbb/parallel_for.h>

#include "heat_method.hpp"

namespace sqmap::bake {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

using QueueItem = std::pair<float, std::uint32_t>;
using MinQueue = std::priority_queue<QueueItem, std::vector<QueueItem>, std::greater<>>;

// Distance at the corner c of a triangle from the distances at a and b, for a front that is straight within
// the triangle (unfolded into its plane, the source is the point at distances da and db on the far side of
// ab).
float distance_across(const Vec3d& pa, const Vec3d& pb, const Vec3d& pc, float da, float db) {
  const Vec3d ab = pb - pa, ac = pc - pa;
  const double base = norm(ab);
  const auto along_edges = static_cast<float>(std::min(da + norm(ac), db + norm(pc - pb)));
  if (!(base > 0)) return along_edges;
  const double a = da, b = db;
  const double source_x = (a * a - b * b + base * base) / (2 * base);
  const double source_y2 = a * a - source_x * source_x;
  if (!(source_y2 >= 0)) return along_edges;  // no such triangle (or NaN)
  const double x = dot(ac, ab) / base;
  const double y = std::sqrt(std::max(0.0, dot(ac, ac) - x * x));
  const double source_y = -std::sqrt(source_y2);
  // The straight line from the source must enter through the edge ab.
  const double t = y - source_y > 0 ? source_x + (x - source_x) * (-source_y / (y - source_y)) : -1;
  if (!(t >= 0 && t <= base)) return along_edges;
  return static_cast<float>(std::hypot(x - source_x, y - source_y));
}

// A triangle below this height over longest edge is a needle: its cotangents drown the rest of the matrix.
constexpr double kNeedleRatio = 1e-4;

bool has_needles(const Surface& surface) {
  for (std::size_t f = 0; f < surface.faces.size(); ++f) {
    double longest2 = 0;
    for (int corner = 0; corner < 3; ++corner) {
      const Vec3d edge =
          surface.points[surface.faces[f][(corner + 1) % 3]] - surface.points[surface.faces[f][corner]];
      longest2 = std::max(longest2, dot(edge, edge));
    }
    if (!(2 * surface.area[f] > kNeedleRatio * longest2)) return true;
  }
  return false;
}

// Intrinsic distance is at least the straight line. Heat distances undercut it a little near the source and
// on coarse meshes; a solution far below it, or absurdly long, is a failed solve.
bool is_plausible(const Surface& surface, std::uint32_t source, const std::vector<float>& distance) {
  double sum = 0, straight_sum = 0;
  for (std::size_t v = 0; v < distance.size(); ++v) {
    if (!std::isfinite(distance[v])) return false;
    sum += surface.vertex_area[v] * distance[v];
    straight_sum += surface.vertex_area[v] * norm(surface.points[v] - surface.points[source]);
  }
  return sum > 0.9 * straight_sum && sum < 20 * straight_sum;
}

}  // namespace

std::vector<Source> farthest_point_sources(const Surface& surface, std::size_t count) {
  const std::size_t point_count = surface.points.size();
  count = std::min(count, point_count);
  std::vector<Source> sources;
  if (count == 0) return sources;
  std::vector<float> distance(point_count, kInfinity);
  std::vector<std::uint32_t> owner(point_count, 0);

  std::uint32_t next = 0;
  for (std::uint32_t v = 1; v < point_count; ++v)
    if (dot(surface.points[v], surface.points[v]) > dot(surface.points[next], surface.points[next])) next = v;
  MinQueue queue;
  while (sources.size() < count && distance[next] > 0) {
    const auto index = static_cast<std::uint32_t>(sources.size());
    sources.push_back({next, 0});
    distance[next] = 0;
    owner[next] = index;
    queue.emplace(0.0F, next);
    while (!queue.empty()) {  // spreads only where the new source is nearer than all before
      const auto [d, v] = queue.top();
      queue.pop();
      if (d > distance[v]) continue;
      for (const std::uint32_t f : surface.faces_of_vertex[v])
        for (const std::uint32_t w : surface.faces[f]) {
          const auto via = static_cast<float>(d + norm(surface.points[w] - surface.points[v]));
          if (!(via < distance[w])) continue;
          distance[w] = via;
          owner[w] = index;
          queue.emplace(via, w);
        }
    }
    next = static_cast<std::uint32_t>(std::max_element(distance.begin(), distance.end()) - distance.begin());
  }
  for (std::size_t v = 0; v < point_count; ++v) sources[owner[v]].area += surface.vertex_area[v];
  return sources;
}

std::vector<float> fast_marching(const Surface& surface, std::span<const std::uint32_t> vertices) {
  std::vector<float> distance(surface.points.size(), kInfinity);
  std::vector<std::uint8_t> done(surface.points.size(), 0);
  MinQueue queue;
  for (const std::uint32_t v : vertices) {
    distance[v] = 0;
    queue.emplace(0.0F, v);
  }
  while (!queue.empty()) {
    const std::uint32_t v = queue.top().second;
    queue.pop();
    if (done[v]) continue;
    done[v] = 1;
    for (const std::uint32_t f : surface.faces_of_vertex[v]) {
      const auto& face = surface.faces[f];
      const int corner = face[0] == v ? 0 : face[1] == v ? 1 : 2;
      for (int turn = 1; turn <= 2; ++turn) {
        const std::uint32_t w = face[(corner + turn) % 3], third = face[(corner + 3 - turn) % 3];
        if (done[w]) continue;
        const float via = done[third]
                              ? distance_across(surface.points[v], surface.points[third], surface.points[w],
                                                distance[v], distance[third])
                              : static_cast<float>(distance[v] + norm(surface.points[w] - surface.points[v]));
        if (!(via < distance[w])) continue;
        distance[w] = via;
        queue.emplace(via, w);
      }
    }
  }
  return distance;
}

std::vector<std::vector<float>> distances_from_each(const Surface& surface,
                                                    std::span<const std::uint32_t> vertices) {
  std::vector<std::vector<float>> distances(vertices.size());
  const bool use_heat = !has_needles(surface);
  // One solver a block: it holds scratch. Blocks are few because each factors the matrix again.
  constexpr std::size_t kBlocks = 2;
  tbb::parallel_for(std::size_t{0}, kBlocks, [&](std::size_t block) {
    const std::size_t begin = vertices.size() * block / kBlocks,
                      end = vertices.size() * (block + 1) / kBlocks;
    if (begin == end) return;
    const std::unique_ptr<HeatSolver> solver = use_heat ? make_heat_solver(surface) : nullptr;
    for (std::size_t i = begin; i < end; ++i) {
      if (solver) distances[i] = solver->distances(vertices[i]);
      if (!solver || distances[i].empty() || !is_plausible(surface, vertices[i], distances[i]))
        distances[i] = fast_marching(surface, vertices.subspan(i, 1));
    }
  });
  return distances;
}

std::vector<double> vertex_protrusion(const Surface& surface, std::span<const Source> sources,
                                      std::span<const std::vector<float>> distances) {
  std::vector<double> protrusion(surface.points.size(), 0);
  for (std::size_t i = 0; i < sources.size(); ++i)
    for (std::size_t v = 0; v < protrusion.size(); ++v)
      protrusion[v] += sources[i].area * static_cast<double>(distances[i][v]);
  return protrusion;
}

bool is_largest_within(const Surface& surface, std::span<const double> value, std::uint32_t vertex,
                       double window) {
  std::unordered_map<std::uint32_t, float> distance{{vertex, 0.0F}};
  MinQueue queue;
  queue.emplace(0.0F, vertex);
  while (!queue.empty()) {
    const auto [d, v] = queue.top();
    queue.pop();
    if (d > distance[v]) continue;
    if (value[v] > value[vertex] || (value[v] == value[vertex] && v < vertex)) return false;
    for (const std::uint32_t f : surface.faces_of_vertex[v])
      for (const std::uint32_t w : surface.faces[f]) {
        const auto via = static_cast<float>(d + norm(surface.points[w] - surface.points[v]));
        if (!(via < window)) continue;
        const auto [entry, is_new] = distance.try_emplace(w, via);
        if (!is_new && !(via < entry->second)) continue;
        entry->second = via;
        queue.emplace(via, w);
      }
  }
  return true;
}

std::vector<double> face_means(const Surface& surface, std::span<const double> at_vertices) {
  std::vector<double> means(surface.faces.size());
  for (std::size_t f = 0; f < means.size(); ++f) {
    const auto& [a, b, c] = surface.faces[f];
    means[f] = (at_vertices[a] + at_vertices[b] + at_vertices[c]) / 3;
  }
  return means;
}

}  // namespace sqmap::bake
