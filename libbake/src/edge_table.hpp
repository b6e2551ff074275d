// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace sqmap::bake {

using Face = std::array<std::uint32_t, 3>;

/// Side k of face f is number 3 f + k and runs from corner k to corner k + 1.
inline std::uint32_t next_side(std::uint32_t side) { return side % 3 == 2 ? side - 2 : side + 1; }
inline std::uint32_t previous_side(std::uint32_t side) { return side % 3 == 0 ? side + 2 : side - 1; }
inline std::uint32_t side_begin(const std::vector<Face>& faces, std::uint32_t side) {
  return faces[side / 3][side % 3];
}
inline std::uint32_t side_end(const std::vector<Face>& faces, std::uint32_t side) {
  return side_begin(faces, next_side(side));
}

/// The sides of all faces, gathered by undirected edge. Faces must not repeat a vertex.
class EdgeTable {
 public:
  EdgeTable(const std::vector<Face>& faces, std::size_t vertex_count);

  /// Calls visit(std::span<const std::uint32_t> sides) for every edge, sides ascending.
  template <class Visit>
  void for_each_edge(const Visit& visit) const {
    for (std::size_t begin = 0; begin < sides_.size();) {
      std::size_t end = begin + 1;
      while (end < sides_.size() && low_[end] == low_[begin] && high_[end] == high_[begin]) ++end;
      visit(std::span(sides_).subspan(begin, end - begin));
      begin = end;
    }
  }
  bool has_edge(std::uint32_t a, std::uint32_t b) const;

  static constexpr std::uint32_t kBoundary = 0xFFFFFFFF;  ///< no other face has this edge
  static constexpr std::uint32_t kBlocked =
      0xFFFFFFFE;  ///< three or more faces, or two that disagree in direction
  /// For each side, the other one of its edge where exactly two faces meet in opposite directions.
  std::vector<std::uint32_t> twins(const std::vector<Face>& faces) const;

 private:
  std::vector<std::size_t> first_;  ///< of the sides by their lower vertex; shape [vertices + 1]
  std::vector<std::uint32_t> sides_, low_, high_;
};

}  // namespace sqmap::bake
