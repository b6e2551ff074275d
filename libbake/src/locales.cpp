// SPDX-License-Identifier: GPL-3.0-or-later
#include "locales.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "components.hpp"

namespace sqmap::bake {
namespace {

// Piece of a level line inside one triangle.
struct Segment {
  double length;
  double bend;  // curvature across the line
  std::uint32_t loop;
};

std::uint32_t vertex_beyond(const std::array<std::uint32_t, 3>& face,
                            std::span<const std::uint8_t> is_beyond) {
  return is_beyond[face[0]] ? face[0] : is_beyond[face[1]] ? face[1] : face[2];
}

Segment slice(const Surface& surface, const Curvature& curvature, std::span<const float> distance,
              const std::array<std::uint32_t, 3>& face, double level) {
  Vec3d end[2];
  BendTensor bend;
  int count = 0;
  for (int corner = 0; corner < 3; ++corner) {
    const std::uint32_t a = face[corner], b = face[(corner + 1) % 3];
    if ((distance[a] > level) == (distance[b] > level) || count == 2) continue;
    const double t = (level - distance[a]) / (static_cast<double>(distance[b]) - distance[a]);
    end[count++] = (1 - t) * surface.points[a] + t * surface.points[b];
    bend.add(0.5 * (1 - t), curvature.bend[a]);
    bend.add(0.5 * t, curvature.bend[b]);
  }
  return {norm(end[1] - end[0]), bend.across(normalized(end[1] - end[0])), Loop::kNone};
}

}  // namespace

std::vector<Loop> find_loops(const Surface& surface, const Curvature& curvature,
                             std::span<const float> distance, double spacing, double min_area) {
  const std::size_t point_count = surface.points.size();
  std::vector<Loop> loops;
  float longest = 0;
  for (const float d : distance)
    if (std::isfinite(d)) longest = std::max(longest, d);
  const auto level_count = static_cast<std::uint32_t>(std::min(4096.0, longest / spacing));
  if (level_count == 0) return loops;

  const auto level_above = [&](float d) {  // smallest k with k * spacing >= d
    return static_cast<std::uint32_t>(std::clamp(std::ceil(d / spacing), 0.0, level_count + 1.0));
  };
  std::vector<std::array<std::uint32_t, 2>> pairs;  // (level, face) of each crossing
  for (std::uint32_t f = 0; f < surface.faces.size(); ++f) {
    const auto [a, b, c] = surface.faces[f];
    const auto [low, high] = std::minmax({distance[a], distance[b], distance[c]});
    for (std::uint32_t k = std::max(1U, level_above(low)); k <= level_count && k * spacing < high; ++k)
      pairs.push_back({k, f});
  }
  const Rows crossings = group_rows(level_count + 1, pairs);
  std::vector<std::uint32_t> order(point_count);
  std::iota(order.begin(), order.end(), 0U);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return distance[a] != distance[b] ? distance[a] > distance[b] : a < b;
  });

  // Components hold positions in `order`, so that a root is the farthest vertex of its component.
  std::vector<std::uint32_t> position(point_count);
  for (std::uint32_t i = 0; i < point_count; ++i) position[order[i]] = i;
  Components components(point_count);
  std::vector<double> area(point_count);
  for (std::size_t i = 0; i < point_count; ++i) area[i] = surface.vertex_area[order[i]];
  std::vector<std::uint32_t> loop_of_root(point_count, Loop::kNone);
  std::vector<std::uint8_t> is_beyond(point_count, 0);
  std::vector<Segment> segments;
  std::vector<std::uint32_t> crossed;
  std::vector<double> curve_length;
  std::vector<std::uint32_t> segment_of_link(surface.links.size(), 0), level_of_link(surface.links.size(), 0);
  std::size_t next = 0, previous_begin = 0;
  for (std::uint32_t k = level_count; k >= 1; --k) {
    const double level = k * spacing;
    for (; next < point_count && distance[order[next]] > level; ++next) {
      const std::uint32_t v = order[next];
      is_beyond[v] = 1;
      for (const std::uint32_t f : surface.faces_of_vertex[v])
        for (const std::uint32_t w : surface.faces[f]) {
          if (!is_beyond[w] || w == v) continue;
          const std::uint32_t a = components.find(position[v]), b = components.find(position[w]);
          if (a == b) continue;
          const double sum = area[a] + area[b];
          area[components.join(a, b)] = sum;
        }
    }
    const std::size_t begin = loops.size();
    segments.clear();
    crossed.clear();
    for (const std::uint32_t f : crossings[k]) {
      const std::uint32_t root = components.find(position[vertex_beyond(surface.faces[f], is_beyond)]);
      if (area[root] < min_area) continue;
      if (loop_of_root[root] == Loop::kNone || loop_of_root[root] < begin) {
        loop_of_root[root] = static_cast<std::uint32_t>(loops.size());
        Loop loop;
        loop.level = level;
        loop.seed = order[root];
        loop.area = area[root];
        loops.push_back(loop);
      }
      segments.push_back(slice(surface, curvature, distance, surface.faces[f], level));
      segments.back().loop = loop_of_root[root];
      loops[loop_of_root[root]].length += segments.back().length;
      crossed.push_back(f);
    }
    Components curves(segments.size());  // segments that meet in an edge belong to one curve
    for (std::uint32_t i = 0; i < segments.size(); ++i)
      for (const std::uint32_t link : surface.links_of_face[crossed[i]]) {
        const auto [a, b] = surface.links[link].vertex;
        if (is_beyond[a] == is_beyond[b]) continue;
        if (level_of_link[link] == k) curves.join(i, segment_of_link[link]);
        level_of_link[link] = k;
        segment_of_link[link] = i;
      }
    curve_length.assign(segments.size(), 0);
    for (std::uint32_t i = 0; i < segments.size(); ++i) curve_length[curves.find(i)] += segments[i].length;
    for (std::uint32_t i = 0; i < segments.size(); ++i) {
      Loop& loop = loops[segments[i].loop];
      if (curves.find(i) == i) loop.length2 += curve_length[i] * curve_length[i];
      if (!(loop.length > 0)) continue;
      const double radius = curve_length[curves.find(i)] / (2 * std::numbers::pi);
      loop.concavity += segments[i].length / loop.length * std::clamp(-segments[i].bend * radius, -1.0, 1.0);
    }
    for (std::size_t i = previous_begin; i < begin; ++i) {
      const std::uint32_t parent = loop_of_root[components.find(position[loops[i].seed])];
      if (parent != Loop::kNone && parent >= begin) loops[i].parent = parent;
    }
    previous_begin = begin;
  }
  return loops;
}

std::vector<std::uint8_t> faces_beyond(const Surface& surface, std::span<const float> distance,
                                       const Loop& loop) {
  std::vector<std::uint8_t> beyond(surface.faces.size(), 0);
  const auto is_far = [&](std::uint32_t f) {
    const auto& [a, b, c] = surface.faces[f];
    return (static_cast<double>(distance[a]) + distance[b] + distance[c]) / 3 > loop.level;
  };
  std::vector<std::uint32_t> stack;
  const auto visit = [&](std::uint32_t f) {
    if (beyond[f] || !is_far(f)) return;
    beyond[f] = 1;
    stack.push_back(f);
  };
  for (const std::uint32_t f : surface.faces_of_vertex[loop.seed]) visit(f);
  while (!stack.empty()) {
    const std::uint32_t f = stack.back();
    stack.pop_back();
    for (const std::uint32_t link : surface.links_of_face[f])
      visit(surface.other_face(surface.links[link], f));
  }
  return beyond;
}

}  // namespace sqmap::bake
