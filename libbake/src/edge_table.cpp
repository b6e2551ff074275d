// SPDX-License-Identifier: GPL-3.0-or-later
#include "edge_table.hpp"

#include <utility>

namespace sqmap::bake {

EdgeTable::EdgeTable(const std::vector<Face>& faces, std::size_t vertex_count) : first_(vertex_count + 1) {
  const auto side_count = static_cast<std::uint32_t>(3 * faces.size());
  const auto low = [&](std::uint32_t s) { return std::min(side_begin(faces, s), side_end(faces, s)); };
  const auto high = [&](std::uint32_t s) { return std::max(side_begin(faces, s), side_end(faces, s)); };

  // Counting sort by the lower vertex, then each vertex's few sides by the other end: linear, unlike one big
  // sort.
  for (std::uint32_t s = 0; s < side_count; ++s) ++first_[low(s) + 1];
  for (std::size_t v = 0; v < vertex_count; ++v) first_[v + 1] += first_[v];
  std::vector<std::size_t> at(first_.begin(), first_.end() - 1);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> by_low(side_count);  // (high, side)
  for (std::uint32_t s = 0; s < side_count; ++s) by_low[at[low(s)]++] = {high(s), s};

  sides_.resize(side_count);
  low_.resize(side_count);
  high_.resize(side_count);
  for (std::size_t v = 0; v < vertex_count; ++v) {
    std::sort(by_low.begin() + static_cast<std::ptrdiff_t>(first_[v]),
              by_low.begin() + static_cast<std::ptrdiff_t>(first_[v + 1]));
    for (std::size_t i = first_[v]; i < first_[v + 1]; ++i) {
      low_[i] = static_cast<std::uint32_t>(v);
      high_[i] = by_low[i].first;
      sides_[i] = by_low[i].second;
    }
  }
}

bool EdgeTable::has_edge(std::uint32_t a, std::uint32_t b) const {
  const auto [low, high] = std::minmax(a, b);
  return std::binary_search(high_.begin() + static_cast<std::ptrdiff_t>(first_[low]),
                            high_.begin() + static_cast<std::ptrdiff_t>(first_[low + 1]), high);
}

std::vector<std::uint32_t> EdgeTable::twins(const std::vector<Face>& faces) const {
  std::vector<std::uint32_t> twin(sides_.size(), kBoundary);
  for_each_edge([&](std::span<const std::uint32_t> sides) {
    if (sides.size() == 1) return;
    const bool is_manifold = sides.size() == 2 && side_begin(faces, sides[0]) == side_end(faces, sides[1]);
    for (const std::uint32_t s : sides) twin[s] = is_manifold ? sides[0] + sides[1] - s : kBlocked;
  });
  return twin;
}

}  // namespace sqmap::bake
