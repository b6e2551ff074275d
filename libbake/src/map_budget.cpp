// SPDX-License-Identifier: GPL-3.0-or-later
#include "map_budget.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include <tbb/parallel_for.h>

namespace sqmap::bake {

namespace {

// Cells a quadrant of the fields that maps are chosen from. 48 and its doubles divide into steps of 4/3 to
// 3/2.
constexpr std::uint32_t kFirstQuadrantCells = 48;
constexpr std::uint32_t kMostQuadrantCells = 192;
constexpr std::uint32_t kLeastQuadrantCells = 4;
// What may be lost, in targets, were it the only loss: to interpolated depth, and to occupancy (rays that
// pass silhouettes and seams between texels put a share of space on the wrong side). A bound of errors over
// whole rays; what points near the surface meet is less, by a factor found on the sample meshes.
constexpr double kInterpolationShare = 1.6;
constexpr double kOccupancyShare = 1.15;
// A uniform quantiser of step q errs by q/4 on average.
constexpr double kStepShare = 1.0;

/// One direction of a map at each stride of its field.
struct Strided {
  std::uint32_t stride;
  double error;  ///< in units of the target; the other direction kept as it is
};

/// A traced part with what coarser maps of it would lose. The losses of both directions add.
struct Candidate {
  std::uint32_t quadrant_cells{};
  RayField field;
  std::vector<Strided> rows, cols;
  double own_error{};  ///< of the field itself, foretold from its coarser halves
  std::uint32_t bits{};
  double hit_share{};

  double bytes(const Strided& row, const Strided& col) const {
    const double texels = (2.0 * quadrant_cells / row.stride + 1) * (4.0 * quadrant_cells / col.stride);
    return texels * bits / 8;
  }
};

struct Choice {
  std::size_t row{}, col{};
  double error{}, bytes{};
};

double error_of(const CoarseningError& e, double target_m, double depth_gain, double occupancy_gain) {
  return (e.depth_m * depth_gain / kInterpolationShare + e.occupancy_m * occupancy_gain / kOccupancyShare) /
         target_m;
}

std::uint32_t bits_for(const RayField& field, double step_m) {
  double most = 0;
  for (const double depth_m : field.depth_m) most = std::max(most, depth_m);
  const double codes = most / step_m + 2;
  return static_cast<std::uint32_t>(std::clamp(std::ceil(std::log2(codes)), 4.0, 16.0));
}

Candidate trace(const Part& part, const MeshQueries& queries, std::uint32_t quadrant_cells, double target_m) {
  Candidate candidate;
  candidate.quadrant_cells = quadrant_cells;
  const std::uint32_t rows = 2 * quadrant_cells + 1, cols = 4 * quadrant_cells;
  candidate.field = trace_map(part.shape, part.object_from_part, rows, cols, queries);
  const RayField& field = candidate.field;
  const MapGrid grid(part.shape, rows, cols);
  candidate.bits = bits_for(field, kStepShare * target_m);
  std::size_t hits = 0;
  for (std::uint32_t texel = 0; texel < rows * cols; ++texel) hits += field.has_hit(texel);
  candidate.hit_share = static_cast<double>(hits) / (rows * cols);
  for (std::uint32_t stride = 1; stride * kLeastQuadrantCells <= quadrant_cells; ++stride) {
    if (quadrant_cells % stride != 0) continue;
    const CoarseningError row = coarsening_error(field, grid, stride, 1);
    const CoarseningError col = coarsening_error(field, grid, 1, stride);
    candidate.rows.push_back({stride, error_of(row, target_m, 1, 1)});
    candidate.cols.push_back({stride, error_of(col, target_m, 1, 1)});
    // Against the field, a map of twice the spacing shows 3/4 of its error in depth (second order) and 1/2 in
    // occupancy (first order); the rest is the field's own.
    if (stride == 2) {
      candidate.own_error = error_of(row, target_m, 1.0 / 3, 1) + error_of(col, target_m, 1.0 / 3, 1);
    }
  }
  return candidate;
}

/// The map of least error plus price.
Choice choose(const Candidate& candidate, double weight, double price) {
  Choice best;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t r = 0; r < candidate.rows.size(); ++r) {
    for (std::size_t c = 0; c < candidate.cols.size(); ++c) {
      const double error = candidate.rows[r].error + candidate.cols[c].error + candidate.own_error;
      const double bytes = candidate.bytes(candidate.rows[r], candidate.cols[c]);
      const double cost = weight * error + price * bytes;
      if (cost < least) {
        least = cost;
        best = {r, c, error, bytes};
      }
    }
  }
  return best;
}

class Allotment {
 public:
  Allotment(const std::vector<Candidate>& candidates, const std::vector<double>& weights)
      : candidates_(candidates), weights_(weights) {}

  std::vector<Choice> at(double price) const {
    std::vector<Choice> choices;
    for (std::size_t k = 0; k < candidates_.size(); ++k)
      choices.push_back(choose(candidates_[k], weights_[k], price));
    return choices;
  }
  double error(const std::vector<Choice>& choices) const {
    double sum = 0;
    for (std::size_t k = 0; k < choices.size(); ++k) sum += weights_[k] * choices[k].error;
    return sum;
  }
  /// In the file: texels without a crossing deflate to almost nothing, the others to some three quarters.
  double stored_bytes(const std::vector<Choice>& choices) const {
    double sum = 0;
    for (std::size_t k = 0; k < choices.size(); ++k)
      sum += 0.75 * candidates_[k].hit_share * choices[k].bytes;
    return sum;
  }
  /// The price at which `fits(choices)` changes. `fits` holds at all prices below it, or at all above.
  template <class Fits>
  double price_where(Fits fits, bool holds_below) const {
    double low = 1e-12, high = 1e6;  // target shares a byte
    constexpr int kHalvings = 60;
    for (int i = 0; i < kHalvings; ++i) {
      const double price = std::sqrt(low * high);
      (fits(at(price)) == holds_below ? low : high) = price;
    }
    return holds_below ? low : high;
  }

 private:
  const std::vector<Candidate>& candidates_;
  const std::vector<double>& weights_;
};

}  // namespace

bool map_parts(std::vector<Part>& parts, const std::vector<double>& area_m2, const MeshQueries& queries,
               const MapTarget& target) {
  const double total_m2 = std::accumulate(area_m2.begin(), area_m2.end(), 0.0);
  std::vector<double> weights;
  for (const double a : area_m2) weights.push_back(a / total_m2);

  std::vector<Candidate> candidates(parts.size());
  const Allotment allotment(candidates, weights);
  std::vector<std::uint32_t> wanted(parts.size(), kFirstQuadrantCells);
  const auto meets_target = [&](const std::vector<Choice>& c) { return allotment.error(c) <= 1; };
  const auto in_budget = [&](const std::vector<Choice>& c) {
    return allotment.stored_bytes(c) <= static_cast<double>(target.max_bytes);
  };
  std::vector<Choice> choices;
  bool by_budget = false;
  for (bool traced = true; traced;) {
    tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t k) {
      if (candidates[k].quadrant_cells != wanted[k])
        candidates[k] = trace(parts[k], queries, wanted[k], target.error_m);
    });
    choices = allotment.at(allotment.price_where(meets_target, true));
    by_budget = !in_budget(choices);
    if (by_budget) choices = allotment.at(allotment.price_where(in_budget, false));
    // Where a field is taken as it is, a finer one might be worth its bytes.
    traced = false;
    for (std::size_t k = 0; k < parts.size(); ++k) {
      if (choices[k].row != 0 && choices[k].col != 0) continue;
      if (wanted[k] >= kMostQuadrantCells) continue;
      wanted[k] *= 2;
      traced = true;
    }
  }
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t k) {
    const Candidate& c = candidates[k];
    parts[k].map = quantise(c.field, {c.rows[choices[k].row].stride, c.cols[choices[k].col].stride, c.bits});
  });
  return by_budget;
}

}  // namespace sqmap::bake
