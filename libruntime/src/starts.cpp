// SPDX-License-Identifier: Apache-2.0
//
// The table of starts of layer 3 (StartTable). The nearest patch of every box is searched among the cells of
// a coarser grid, in groups that are passed over where they are surely farther.
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <vector>

#include "chart.hpp"
#include "resident.hpp"

namespace sqmap::runtime {

namespace {

// Cells of the coarser grid. So many rows and columns have names of at most 12 bits, not all of them 1.
constexpr std::uint32_t kMostCandidates = 2048;
constexpr std::uint32_t kGroupShift = 2;  // groups of 4 x 4 candidates

struct Candidate {
  Vec3f point;
  std::uint32_t name;
};
struct Group {
  Vec3f centre;
  float radius;
  std::uint32_t begin, end;
};

/// Cells of the coarser grid along one side of `cells` cells.
std::uint32_t side_of(std::uint32_t cells, std::uint32_t step_shift) noexcept {
  const std::uint32_t first = (1U << step_shift) / 2;
  return cells > first ? ((cells - 1 - first) >> step_shift) + 1 : 0;
}

}  // namespace

StartTable StartTable::of(std::uint32_t rows, std::uint32_t cols, const Vec3f& half_extents) noexcept {
  StartTable table;
  std::uint32_t step = 0;
  while (std::size_t{side_of(rows - 1, step)} * side_of(cols, step) > kMostCandidates) ++step;
  table.step_shift = static_cast<std::uint8_t>(step);
  table.col_bits = static_cast<std::uint8_t>(std::bit_width(side_of(cols, step) - 1));
  // Cubes, as nearly as their number allows: shortest side first, the others share what it leaves.
  int order[] = {0, 1, 2};
  std::stable_sort(std::begin(order), std::end(order),
                   [&](int a, int b) { return half_extents[a] < half_extents[b]; });
  double left = kMostBoxes;
  double volume = double{half_extents.x} * double{half_extents.y} * double{half_extents.z};
  for (int k = 0; k < 3; ++k) {
    const double extent = half_extents[order[k]];
    const double count =
        std::clamp(std::floor(extent / std::pow(volume / left, 1.0 / (3 - k)) + 1e-9), 1.0, left);
    table.boxes[order[k]] = static_cast<std::uint16_t>(count);
    left = std::floor(left / count);
    volume /= extent;
  }
  return table;
}

void Resident::fill_starts(const PartRecord& part) {
  const StartTable& starts = part.starts;
  ShapeTable<float> shape;
  unpack(part, shape);
  const Chart chart(*this, part, shape);
  const std::uint32_t rows = side_of(part.rows - 1, starts.step_shift),
                      cols = side_of(part.cols, starts.step_shift);

  std::vector<Candidate> candidates;
  std::vector<Group> groups;
  const std::uint32_t side = 1U << kGroupShift;
  for (std::uint32_t row = 0; row < rows; row += side) {
    for (std::uint32_t col = 0; col < cols; col += side) {
      Group group{{}, 0, static_cast<std::uint32_t>(candidates.size()), 0};
      for (std::uint32_t r = row; r < std::min(row + side, rows); ++r) {
        for (std::uint32_t c = col; c < std::min(col + side, cols); ++c) {
          Vec3f point;
          if (chart.patch_point(starts.place(r), starts.place(c), point))
            candidates.push_back({point, r << starts.col_bits | c});
        }
      }
      group.end = static_cast<std::uint32_t>(candidates.size());
      if (group.end == group.begin) continue;
      for (std::uint32_t k = group.begin; k < group.end; ++k)
        group.centre =
            group.centre + (1.0F / static_cast<float>(group.end - group.begin)) * candidates[k].point;
      for (std::uint32_t k = group.begin; k < group.end; ++k)
        group.radius = greater(group.radius, norm(candidates[k].point - group.centre));
      groups.push_back(group);
    }
  }
  if (groups.empty()) return;

  std::vector<float> distance(groups.size());
  std::uint32_t bit = 0;
  const auto middle = [&](std::uint32_t k, int axis) {
    const float share = (static_cast<float>(k) + 0.5F) / static_cast<float>(starts.boxes[axis]);
    return (2 * share - 1) / part.inverse_extents[axis];
  };
  for (std::uint32_t z = 0; z < starts.boxes[2]; ++z) {
    for (std::uint32_t y = 0; y < starts.boxes[1]; ++y) {
      for (std::uint32_t x = 0; x < starts.boxes[0]; ++x, bit += StartTable::kBits) {
        const Vec3f p = chart.to_part({middle(x, 0), middle(y, 1), middle(z, 2)});
        for (std::size_t g = 0; g < groups.size(); ++g) distance[g] = norm(groups[g].centre - p);
        const auto closest = std::min_element(distance.begin(), distance.end()) - distance.begin();
        Candidate best{{}, StartTable::kNone};
        float nearest = std::numeric_limits<float>::infinity();
        const auto consider = [&](const Group& group) {
          for (std::uint32_t i = group.begin; i < group.end; ++i) {
            const float here = norm(candidates[i].point - p);
            if (!(here < nearest)) continue;
            nearest = here;
            best = candidates[i];
          }
        };
        consider(groups[static_cast<std::size_t>(closest)]);
        for (std::size_t g = 0; g < groups.size(); ++g)
          if (distance[g] - groups[g].radius < nearest) consider(groups[g]);
        // All ones as yet.
        std::uint8_t* out = bytes_.get() + starts.at + bit / 8;
        const std::uint32_t held = (best.name ^ StartTable::kNone) << (bit % 8);
        out[0] = static_cast<std::uint8_t>(out[0] ^ held);
        out[1] = static_cast<std::uint8_t>(out[1] ^ (held >> 8U));
      }
    }
  }
}

}  // namespace sqmap::runtime
