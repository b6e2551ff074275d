// SPDX-License-Identifier: GPL-3.0-or-later
#include "long_edges.hpp"

#include <algorithm>
#include <array>
#include <unordered_map>
#include <unordered_set>
#include <utility>

namespace sqmap::bake {
namespace {

using Face = std::array<std::uint32_t, 3>;

std::uint64_t edge_key(std::uint32_t a, std::uint32_t b) {
  return (std::uint64_t{std::min(a, b)} << 32) | std::max(a, b);
}

/// `choose`: called once a round; returns which edges between two points of `fine` are halved.
template <class Choose>
FineTriangles split(const Triangles& input, std::size_t max_faces, const Choose& choose) {
  FineTriangles split{input, std::vector<std::uint32_t>(input.faces.size())};
  for (std::uint32_t f = 0; f < input.faces.size(); ++f) split.source_face[f] = f;
  std::vector<Vec3d>& points = split.triangles.points;
  for (bool changed = true; changed && split.triangles.faces.size() < max_faces;) {
    changed = false;
    std::unordered_map<std::uint64_t, std::uint32_t> midpoint;
    const auto is_chosen = choose(split.triangles);
    std::vector<Face> next;
    std::vector<std::uint32_t> next_source;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) -> std::int64_t {
      if (!is_chosen(std::min(a, b), std::max(a, b))) return -1;  // same order for both faces
      const Vec3d pa = points[std::min(a, b)], pb = points[std::max(a, b)];
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

}  // namespace

FineTriangles split_edges(const Triangles& input,
                          const std::function<bool(const Vec3d& a, const Vec3d& b)>& is_long,
                          std::size_t max_faces) {
  return split(input, max_faces, [&](const Triangles& fine) {
    std::unordered_set<std::uint64_t> chosen;
    for (const Face& face : fine.faces) {
      bool any = false;
      double longest = -1;
      std::uint64_t key = 0;
      for (std::size_t i = 0; i < 3; ++i) {
        const std::uint32_t a = std::min(face[i], face[(i + 1) % 3]),
                            b = std::max(face[i], face[(i + 1) % 3]);
        any = any || is_long(fine.points[a], fine.points[b]);
        const double length = norm(fine.points[b] - fine.points[a]);
        if (length < longest || (length == longest && edge_key(a, b) > key)) continue;
        longest = length;
        key = edge_key(a, b);
      }
      if (any) chosen.insert(key);
    }
    return [chosen = std::move(chosen)](std::uint32_t a, std::uint32_t b) {
      return chosen.contains(edge_key(a, b));
    };
  });
}

FineTriangles split_long_edges(const Triangles& input, double longest_edge, std::size_t max_faces) {
  return split(input, max_faces, [=](const Triangles& fine) {
    return [&fine, longest_edge](std::uint32_t a, std::uint32_t b) {
      return norm(fine.points[b] - fine.points[a]) > longest_edge;
    };
  });
}

}  // namespace sqmap::bake
