// SPDX-License-Identifier: GPL-3.0-or-later
#include "min_cut.hpp"

#include <algorithm>
#include <limits>

namespace sqmap::bake {
namespace {

class Network {
 public:
  Network(std::size_t node_count, std::span<const FlowEdge> edges)
      : begin_(node_count + 1, 0),
        target_(2 * edges.size()),
        twin_(2 * edges.size()),
        residual_(2 * edges.size()) {
    for (const FlowEdge& edge : edges) {
      ++begin_[edge.a + 1];
      ++begin_[edge.b + 1];
    }
    for (std::size_t v = 0; v < node_count; ++v) begin_[v + 1] += begin_[v];
    std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
    for (const FlowEdge& edge : edges) {
      const std::uint32_t forward = next[edge.a]++, backward = next[edge.b]++;
      target_[forward] = edge.b;
      target_[backward] = edge.a;
      twin_[forward] = backward;
      twin_[backward] = forward;
      residual_[forward] = residual_[backward] = edge.capacity;
    }
  }

  // Levels by breadth-first search from the source; true when the sink is reached.
  bool level(std::uint32_t source, std::uint32_t sink) {
    level_.assign(begin_.size() - 1, kUnreached);
    level_[source] = 0;
    queue_.assign(1, source);
    for (std::size_t i = 0; i < queue_.size(); ++i)
      for (std::uint32_t arc = begin_[queue_[i]]; arc < begin_[queue_[i] + 1]; ++arc)
        if (residual_[arc] > 0 && level_[target_[arc]] == kUnreached) {
          level_[target_[arc]] = level_[queue_[i]] + 1;
          queue_.push_back(target_[arc]);
        }
    return level_[sink] != kUnreached;
  }

  // Saturates every shortest path of the current levels. Iterative: paths may be as long as the mesh.
  void block(std::uint32_t source, std::uint32_t sink) {
    next_arc_.assign(begin_.begin(), begin_.end() - 1);
    path_.clear();
    std::uint32_t v = source;
    while (true) {
      if (v == sink) {
        std::int64_t flow = std::numeric_limits<std::int64_t>::max();
        for (const std::uint32_t arc : path_) flow = std::min(flow, residual_[arc]);
        std::size_t first_saturated = path_.size();
        for (std::size_t i = path_.size(); i-- > 0;) {
          residual_[path_[i]] -= flow;
          residual_[twin_[path_[i]]] += flow;
          if (residual_[path_[i]] == 0) first_saturated = i;
        }
        v = target_[twin_[path_[first_saturated]]];
        path_.resize(first_saturated);
        continue;
      }
      std::uint32_t& arc = next_arc_[v];
      while (arc < begin_[v + 1] && !(residual_[arc] > 0 && level_[target_[arc]] == level_[v] + 1)) ++arc;
      if (arc < begin_[v + 1]) {
        path_.push_back(arc);
        v = target_[arc];
      } else if (path_.empty()) {
        return;
      } else {
        v = target_[twin_[path_.back()]];
        path_.pop_back();
        ++next_arc_[v];
      }
    }
  }

  std::vector<std::uint8_t> reached() const {
    std::vector<std::uint8_t> side(level_.size());
    for (std::size_t v = 0; v < side.size(); ++v) side[v] = level_[v] != kUnreached;
    return side;
  }

 private:
  static constexpr std::uint32_t kUnreached = 0xFFFFFFFF;
  std::vector<std::uint32_t> begin_, target_, twin_;
  std::vector<std::int64_t> residual_;
  std::vector<std::uint32_t> level_, queue_, next_arc_, path_;
};

}  // namespace

std::vector<std::uint8_t> minimum_cut(std::size_t node_count, std::span<const FlowEdge> edges,
                                      std::uint32_t source, std::uint32_t sink) {
  Network network(node_count, edges);
  while (network.level(source, sink)) network.block(source, sink);
  return network.reached();
}

}  // namespace sqmap::bake
