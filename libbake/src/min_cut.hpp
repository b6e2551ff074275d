// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace sqmap::bake {

/// An undirected edge of a flow network.
struct FlowEdge {
  std::uint32_t a, b;
  std::int64_t capacity;  ///< in both directions, >= 0
};

/// Minimum cut between two nodes (Dinic 1970). Integer capacities, so the result is exact and the same
/// everywhere; of several minimum cuts the one nearest the source. Returns for each node whether it is on the
/// source's side.
std::vector<std::uint8_t> minimum_cut(std::size_t node_count, std::span<const FlowEdge> edges,
                                      std::uint32_t source, std::uint32_t sink);

}  // namespace sqmap::bake
