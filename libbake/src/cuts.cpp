// SPDX-License-Identifier: GPL-3.0-or-later
#include "cuts.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <queue>
#include <unordered_map>

#include "components.hpp"
#include "min_cut.hpp"

namespace sqmap::bake {
namespace {

// Half width of the band a border may move in: in radii of the border, but not narrower than a few edges of
// the working mesh, nor so wide that a waist would slide along the trunk.
constexpr double kBandRadii = 1.5, kMinBand = 0.03, kMaxBand = 0.08;
// Price of an edge: exp(-kConcavityGain x) of its length, x = minus the curvature across it times the
// border's radius, within these bounds.
constexpr double kConcavityGain = 2, kMostConvex = -1, kMostConcave = 2;
// A side that sticks out like a limb ten times as long as thick has the full strength of its border.
constexpr double kFullProtrusion = 20;
// Integer units of capacity per unit of length (the whole surface has area 1).
constexpr double kCapacityUnits = 1e9;

// Dual-graph distance of each face from the border, where below `limit`; infinity elsewhere.
std::vector<double> border_distance(const Surface& surface, std::span<const std::uint8_t> side,
                                    double limit) {
  std::vector<double> distance(surface.faces.size(), std::numeric_limits<double>::infinity());
  using Item = std::pair<double, std::uint32_t>;
  std::priority_queue<Item, std::vector<Item>, std::greater<>> queue;
  for (const Link& link : surface.links)
    if (side[link.face[0]] != side[link.face[1]])
      for (const std::uint32_t f : link.face) {
        if (distance[f] == 0) continue;
        distance[f] = 0;
        queue.emplace(0.0, f);
      }
  while (!queue.empty()) {
    const auto [d, f] = queue.top();
    queue.pop();
    if (d > distance[f]) continue;
    for (const std::uint32_t link : surface.links_of_face[f]) {
      const std::uint32_t g = surface.other_face(surface.links[link], f);
      const double via = d + norm(surface.centroid[g] - surface.centroid[f]);
      if (!(via < distance[g]) || via > limit) continue;
      distance[g] = via;
      queue.emplace(via, g);
    }
  }
  return distance;
}

}  // namespace

std::vector<double> bend_across_links(const Surface& surface, const Curvature& curvature) {
  std::vector<double> bend(surface.links.size());
  for (std::size_t i = 0; i < bend.size(); ++i) {
    const auto [a, b] = surface.links[i].vertex;
    const Vec3d along = normalized(surface.points[b] - surface.points[a]);
    bend[i] = 0.5 * (curvature.bend[a].across(along) + curvature.bend[b].across(along));
  }
  return bend;
}

double protrusion_ratio(double area, double length2) {
  return length2 > 0 ? 4 * std::numbers::pi * area / length2 : 0;
}

double border_strength(const Border& border, double area) {
  const double protrusion = std::log(std::max(1.0, protrusion_ratio(area, border.length2)));
  return border.concavity * std::min(1.0, protrusion / std::log(kFullProtrusion));
}

Border measure_border(const Surface& surface, std::span<const double> link_bend,
                      std::span<const std::uint32_t> links) {
  Border border;
  // Links that share a vertex belong to one curve.
  Components curves(links.size());
  std::unordered_map<std::uint32_t, std::uint32_t> link_at;
  for (std::uint32_t i = 0; i < links.size(); ++i)
    for (const std::uint32_t v : surface.links[links[i]].vertex) {
      const auto [entry, is_new] = link_at.try_emplace(v, i);
      if (!is_new) curves.join(i, entry->second);
    }
  std::vector<double> curve_length(links.size(), 0);
  for (std::uint32_t i = 0; i < links.size(); ++i) {
    curve_length[curves.find(i)] += surface.links[links[i]].length;
    border.length += surface.links[links[i]].length;
  }
  if (!(border.length > 0)) return border;
  for (std::uint32_t i = 0; i < links.size(); ++i) {
    if (curves.find(i) == i) border.length2 += curve_length[i] * curve_length[i];
    const double radius = curve_length[curves.find(i)] / (2 * std::numbers::pi);
    border.concavity +=
        surface.links[links[i]].length / border.length * std::clamp(-link_bend[links[i]] * radius, -1.0, 1.0);
  }
  return border;
}

std::vector<std::uint8_t> refine_border(const Surface& surface, std::span<const double> link_bend,
                                        std::vector<std::uint8_t> side) {
  double length = 0;
  for (const Link& link : surface.links)
    if (side[link.face[0]] != side[link.face[1]]) length += link.length;
  const double radius = length / (2 * std::numbers::pi),
               limit = std::clamp(kBandRadii * radius, kMinBand, kMaxBand);
  const std::vector<double> distance = border_distance(surface, side, limit);

  // Nodes: the faces of the band, then the two terminals, which stand for all faces beyond the band.
  constexpr std::uint32_t kNoNode = 0xFFFFFFFF;
  std::vector<std::uint32_t> node(surface.faces.size(), kNoNode), face_of_node;
  for (std::uint32_t f = 0; f < surface.faces.size(); ++f)
    if (std::isfinite(distance[f])) {
      node[f] = static_cast<std::uint32_t>(face_of_node.size());
      face_of_node.push_back(f);
    }
  const auto source = static_cast<std::uint32_t>(face_of_node.size()), sink = source + 1;
  bool has_source = false, has_sink = false;
  std::vector<FlowEdge> edges;
  for (std::uint32_t i = 0; i < surface.links.size(); ++i) {
    const Link& link = surface.links[i];
    std::uint32_t a = node[link.face[0]], b = node[link.face[1]];
    if (a == kNoNode && b == kNoNode) continue;
    if (a == kNoNode) a = side[link.face[0]] ? source : sink;
    if (b == kNoNode) b = side[link.face[1]] ? source : sink;
    has_source |= a == source || b == source;
    has_sink |= a == sink || b == sink;
    const double x = std::clamp(-link_bend[i] * radius, kMostConvex, kMostConcave);
    edges.push_back({a, b,
                     static_cast<std::int64_t>(
                         std::llround(kCapacityUnits * link.length * std::exp(-kConcavityGain * x)))});
  }
  if (!has_source || !has_sink) return side;
  const std::vector<std::uint8_t> reached = minimum_cut(face_of_node.size() + 2, edges, source, sink);
  for (std::uint32_t i = 0; i < face_of_node.size(); ++i) side[face_of_node[i]] = reached[i];
  return side;
}

}  // namespace sqmap::bake
