// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <numeric>
#include <utility>

#include "edge_table.hpp"
#include "repair_steps.hpp"

namespace sqmap::bake {
namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFF;

Face sorted(Face face) {
  std::ranges::sort(face);
  return face;
}

/// True when the corners ascend, up to a turn of the triangle.
bool is_even(const Face& f) { return (f[0] < f[1]) + (f[1] < f[2]) + (f[2] < f[0]) == 2; }

/// Of the faces that remain, `is_wall` marks those that had a copy in the opposite direction. Patches of
/// walls are kept unless each edge of their rim holds exactly two other faces: then they part two solids that
/// touch there.
std::vector<bool> inner_walls(const Mesh& mesh, const std::vector<bool>& is_wall) {
  std::vector<std::uint32_t> patch(mesh.faces.size());
  std::iota(patch.begin(), patch.end(), 0U);
  const auto root = [&](std::uint32_t face) {
    while (patch[face] != face) face = patch[face] = patch[patch[face]];
    return face;
  };
  const EdgeTable edges(mesh.faces, mesh.vertices_m.size());
  edges.for_each_edge([&](std::span<const std::uint32_t> sides) {
    std::uint32_t joined = kNone;
    for (const std::uint32_t s : sides) {
      if (!is_wall[s / 3]) continue;
      const std::uint32_t own = root(s / 3);
      if (joined != kNone) patch[std::max(own, joined)] = std::min(own, joined);
      joined = std::min(own, joined);
    }
  });
  std::vector<bool> has_rim(mesh.faces.size()), is_torn(mesh.faces.size()), inner(mesh.faces.size());
  edges.for_each_edge([&](std::span<const std::uint32_t> sides) {
    const auto walls = std::ranges::count_if(sides, [&](std::uint32_t s) { return is_wall[s / 3]; });
    const auto others = static_cast<std::ptrdiff_t>(sides.size()) - walls;
    for (const std::uint32_t s : sides) {
      if (!is_wall[s / 3]) continue;
      if (others == 2) has_rim[root(s / 3)] = true;
      if (others == 1 || others > 2 || (others == 0 && walls == 1)) is_torn[root(s / 3)] = true;
    }
  });
  for (std::uint32_t f = 0; f < inner.size(); ++f)
    inner[f] = is_wall[f] && has_rim[root(f)] && !is_torn[root(f)];
  return inner;
}

}  // namespace

std::uint32_t drop_duplicates(Mesh& mesh) {
  std::vector<std::pair<Face, std::uint32_t>> order(mesh.faces.size());
  for (std::uint32_t f = 0; f < order.size(); ++f) order[f] = {sorted(mesh.faces[f]), f};
  std::ranges::sort(order);

  std::vector<bool> keep(mesh.faces.size(), true), is_wall(mesh.faces.size());
  bool has_walls = false;
  for (std::size_t i = 1, first = 0; i < order.size(); ++i) {
    if (order[i].first != order[first].first) {
      first = i;
      continue;
    }
    const std::uint32_t kept = order[first].second, copy = order[i].second;
    keep[copy] = false;
    if (is_even(mesh.faces[kept]) != is_even(mesh.faces[copy])) is_wall[kept] = has_walls = true;
  }
  std::vector<bool> wall_of_kept;
  for (std::size_t f = 0; f < keep.size(); ++f)
    if (keep[f]) wall_of_kept.push_back(is_wall[f]);
  std::uint32_t dropped = keep_faces(mesh, keep);
  if (has_walls) {
    std::vector<bool> stays = inner_walls(mesh, wall_of_kept);
    stays.flip();
    dropped += keep_faces(mesh, stays);
  }
  return dropped;
}

}  // namespace sqmap::bake
