// SPDX-License-Identifier: GPL-3.0-or-later
#include "segment_limit.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "components.hpp"

namespace sqmap::bake {

namespace {

/// Up to so many segments every pair is looked at; more are first joined to so many along a space-filling
/// curve.
constexpr std::uint32_t kMostCompared = 1024;

struct Group {
  std::uint32_t segment;  ///< its lowest, which is its largest
  double area_m2{};
  Vec3d low, high;

  double diagonal_m() const { return norm(high - low); }
  void take(const Group& other) {
    segment = std::min(segment, other.segment);
    area_m2 += other.area_m2;
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], other.low[axis]);
      high[axis] = std::max(high[axis], other.high[axis]);
    }
  }
};

std::vector<Group> groups_of(const Mesh& mesh, const Decomposition& segments) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const Vec3d nowhere{kInfinity, kInfinity, kInfinity};
  std::vector<Group> groups;
  for (std::uint32_t k = 0; k < segments.reasons.size(); ++k) groups.push_back({k, 0, nowhere, -nowhere});
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    const auto& [a, b, c] = mesh.faces[f];
    const Vec3d corner[3] = {mesh.vertices_m[a], mesh.vertices_m[b], mesh.vertices_m[c]};
    Group& group = groups[segments.label[f]];
    for (const Vec3d& p_m : corner) group.take({group.segment, 0, p_m, p_m});
    group.area_m2 += 0.5 * norm(cross(corner[1] - corner[0], corner[2] - corner[0]));
  }
  return groups;
}

/// Place of a point of the unit box along the Z-order curve, 10 bits an axis.
std::uint32_t curve_place(const Vec3d& p) {
  std::uint32_t place = 0;
  for (int bit = 9; bit >= 0; --bit) {
    for (int axis = 0; axis < 3; ++axis) {
      const auto cell = static_cast<std::uint32_t>(std::clamp(p[axis], 0.0, 1.0) * 1023);
      place = place << 1U | (cell >> static_cast<unsigned>(bit) & 1U);
    }
  }
  return place;
}

void join_along_curve(std::vector<Group>& groups, Components& joined) {
  Group whole = groups.front();
  for (const Group& group : groups) whole.take(group);
  const double longest_m = std::max({whole.high.x - whole.low.x, whole.high.y - whole.low.y,
                                     whole.high.z - whole.low.z, std::numeric_limits<double>::min()});
  std::vector<std::pair<std::uint32_t, std::size_t>> order;
  for (std::size_t k = 0; k < groups.size(); ++k) {
    const Vec3d middle_m = 0.5 * (groups[k].low + groups[k].high);
    order.emplace_back(curve_place((1 / longest_m) * (middle_m - whole.low)), k);
  }
  std::sort(order.begin(), order.end());
  std::vector<Group> runs;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const Group& group = groups[order[i].second];
    if (i * kMostCompared / order.size() == runs.size()) {
      runs.push_back(group);
      continue;
    }
    joined.join(runs.back().segment, group.segment);
    runs.back().take(group);
  }
  groups = std::move(runs);
}

}  // namespace

void join_to_limit(const Mesh& mesh, std::uint32_t most, Decomposition& segments) {
  if (segments.reasons.size() <= most) return;
  std::vector<Group> groups = groups_of(mesh, segments);
  Components joined(groups.size());
  if (groups.size() > kMostCompared) join_along_curve(groups, joined);
  while (groups.size() > most) {
    const auto smallest = std::min_element(groups.begin(), groups.end(), [](const Group& a, const Group& b) {
      return a.area_m2 != b.area_m2 ? a.area_m2 < b.area_m2 : a.segment > b.segment;
    });
    auto best = groups.end();
    double least_m = std::numeric_limits<double>::infinity();
    for (auto other = groups.begin(); other != groups.end(); ++other) {
      if (other == smallest) continue;
      Group both = *other;
      both.take(*smallest);
      const double growth_m = both.diagonal_m() - other->diagonal_m();
      if (best != groups.end() && !(growth_m < least_m)) continue;
      least_m = growth_m;
      best = other;
    }
    joined.join(best->segment, smallest->segment);
    best->take(*smallest);
    groups.erase(smallest);
  }

  std::vector<std::uint32_t> number(segments.reasons.size());
  std::vector<CutReason> reasons;
  for (std::uint32_t k = 0; k < number.size(); ++k) {
    const std::uint32_t root = joined.find(k);  // the lowest, so it has its number by now
    if (root == k) {
      number[k] = static_cast<std::uint32_t>(reasons.size());
      reasons.push_back(segments.reasons[k]);
    }
    number[k] = number[root];
  }
  for (std::uint32_t& label : segments.label) label = number[label];
  segments.reasons = std::move(reasons);
}

}  // namespace sqmap::bake
