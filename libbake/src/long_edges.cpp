// SPDX-License-Identifier: GPL-3.0-or-later
#include "long_edges.hpp"

#include <algorithm>
#include <array>
#include <unordered_map>
#include <utility>

namespace sqmap::bake {
namespace {

using Face = std::array<std::uint32_t, 3>;

std::uint64_t edge_key(std::uint32_t a, std::uint32_t b) {
  return (std::uint64_t{std::min(a, b)} << 32) | std::max(a, b);
}

}  // namespace

FineTriangles split_long_edges(const Triangles& input, double longest_edge, std::size_t max_faces) {
  FineTriangles split{input, std::vector<std::uint32_t>(input.faces.size())};
  for (std::uint32_t f = 0; f < input.faces.size(); ++f) split.source_face[f] = f;
  std::vector<Vec3d>& points = split.triangles.points;
  for (bool changed = true; changed && split.triangles.faces.size() < max_faces;) {
    changed = false;
    std::unordered_map<std::uint64_t, std::uint32_t> midpoint;
    std::vector<Face> next;
    std::vector<std::uint32_t> next_source;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) -> std::int64_t {
      const Vec3d pa = points[std::min(a, b)], pb = points[std::max(a, b)];  // same order for both faces
      if (!(norm(pb - pa) > longest_edge)) return -1;
      const auto [entry, is_new] =
          midpoint.try_emplace(edge_key(a, b), static_cast<std::uint32_t>(points.size()));
      if (is_new) points.push_back(0.5 * (pa + pb));
      return entry->second;
    };
    for (std::size_t f = 0; f < split.triangles.faces.size(); ++f) {
      const Face face = split.triangles.faces[f];
      std::array<std::int64_t, 3> mid{};
      int count = 0;
      for (int i = 0; i < 3; ++i) {
        mid[i] = middle(face[i], face[(i + 1) % 3]);
        count += mid[i] >= 0;
      }
      const auto emit = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        next.push_back({a, b, c});
        next_source.push_back(split.source_face[f]);
      };
      if (count == 0) {
        emit(face[0], face[1], face[2]);
        continue;
      }
      changed = true;
      const auto m = [&](int i) { return static_cast<std::uint32_t>(mid[i % 3]); };
      if (count == 3) {
        emit(face[0], m(0), m(2));
        emit(face[1], m(1), m(0));
        emit(face[2], m(2), m(1));
        emit(m(0), m(1), m(2));
      } else if (count == 1) {
        const int i = mid[0] >= 0 ? 0 : mid[1] >= 0 ? 1 : 2;
        emit(face[i], m(i), face[(i + 2) % 3]);
        emit(m(i), face[(i + 1) % 3], face[(i + 2) % 3]);
      } else {
        const int i = mid[0] < 0 ? 0 : mid[1] < 0 ? 1 : 2;  // the edge from i to i + 1 stays
        const std::uint32_t a = face[i], b = face[(i + 1) % 3], c = face[(i + 2) % 3];
        emit(c, m(i + 2), m(i + 1));
        // The quadrilateral a b m(i+1) m(i+2), cut along its shorter diagonal.
        if (norm(points[m(i + 1)] - points[a]) <= norm(points[m(i + 2)] - points[b])) {
          emit(a, b, m(i + 1));
          emit(a, m(i + 1), m(i + 2));
        } else {
          emit(a, b, m(i + 2));
          emit(b, m(i + 1), m(i + 2));
        }
      }
    }
    split.triangles.faces = std::move(next);
    split.source_face = std::move(next_source);
  }
  return split;
}

}  // namespace sqmap::bake
