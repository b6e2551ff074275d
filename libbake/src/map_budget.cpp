// SPDX-License-Identifier: GPL-3.0-or-later
#include "map_budget.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include <tbb/parallel_for.h>

#include "sqmap/asset/miss_run.hpp"

#include "part_builder.hpp"

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
constexpr double kOccupancyShare = 1.12;
// A uniform quantiser of step q errs by q/4 on average.
constexpr double kStepShare = 1.0;
constexpr std::uint32_t kMostBits = 16;
// Texels without a crossing deflate to almost nothing, the others to some three quarters.
constexpr double kStoredShare = 0.75;

/// Cells a quadrant along each direction of a field.
struct Quadrant {
  std::uint32_t rows{kFirstQuadrantCells}, cols{kFirstQuadrantCells};
  bool operator==(const Quadrant&) const = default;
};

/// One direction of a map at each stride of its field.
struct Strided {
  std::uint32_t stride;
  double error_m;  ///< what it loses, the other direction kept as it is
};

}  // namespace

/// With what coarser maps of it would lose. The losses of both directions add.
struct TracedShape {
  PlacedShape placed;
  Quadrant cells;  ///< of the field
  RayField field;
  std::vector<Strided> rows, cols;
  double own_error_m{};  ///< of the field itself, foretold from its coarser halves
  double deepest_m{}, hit_share{};
  double held_share{};  ///< of the texels, those that a loaded object holds
  bool has_seam{};
};

namespace {

/// A shape that a part may have.
struct Candidate {
  PlacedShape placed;
  Quadrant wanted;
  std::shared_ptr<const TracedShape> traced;

  bool is_traced_in(const std::shared_ptr<const TracedShape>& other) const {
    return other && other->cells == wanted && other->placed == placed;
  }
};

struct Choice {
  std::size_t candidate{}, row{}, col{};
  double error_m{}, texels{};
};

double error_m(const CoarseningError& e, double depth_gain, double occupancy_gain) {
  return e.depth_m * depth_gain / kInterpolationShare + e.occupancy_m * occupancy_gain / kOccupancyShare;
}

/// The strides of a direction, and what it would lose to them.
template <class ErrorAt>
std::vector<Strided> strides(std::uint32_t quadrant_cells, ErrorAt error_at) {
  std::vector<Strided> out;
  for (std::uint32_t stride = 1; stride * kLeastQuadrantCells <= quadrant_cells; ++stride) {
    if (quadrant_cells % stride == 0) out.push_back({stride, error_m(error_at(stride), 1, 1)});
  }
  return out;
}

TracedShape trace(const PlacedShape& placed, const MeshQueries& queries, const Quadrant& cells) {
  TracedShape traced;
  traced.placed = placed;
  traced.cells = cells;
  const std::uint32_t rows = 2 * cells.rows + 1, cols = 4 * cells.cols;
  traced.field = trace_map(placed.shape, placed.object_from_part, rows, cols, queries);
  const RayField& field = traced.field;
  const MapGrid grid(placed.shape, rows, cols);
  for (const double depth_m : field.depth_m) traced.deepest_m = std::max(traced.deepest_m, depth_m);
  std::size_t hits = 0;
  for (std::uint32_t texel = 0; texel < rows * cols; ++texel) hits += field.has_hit(texel);
  traced.hit_share = static_cast<double>(hits) / (rows * cols);
  std::size_t held = 0;
  for (std::uint32_t row = 0; row < rows; ++row) {
    const MissRun run = longest_miss_run(cols, [&](std::uint32_t col) {
      const std::uint32_t texel = row * cols + col;
      return field.has_hit(texel)             ? RayKind::kHit
             : field.start_inside[texel] != 0 ? RayKind::kInnerMiss
                                              : RayKind::kMiss;
    });
    held += cols - run.count;
  }
  traced.held_share = static_cast<double>(held) / (rows * cols);
  traced.has_seam = std::ranges::any_of(field.start_inside, [](std::uint8_t s) { return s != 0; });
  const auto by_rows = [&](std::uint32_t stride) { return coarsening_error(field, grid, stride, 1); };
  const auto by_cols = [&](std::uint32_t stride) { return coarsening_error(field, grid, 1, stride); };
  traced.rows = strides(cells.rows, by_rows);
  traced.cols = strides(cells.cols, by_cols);
  // Against the field, a map of twice the spacing shows 3/4 of its error in depth (second order) and 1/2 in
  // occupancy (first order); the rest is the field's own.
  traced.own_error_m = error_m(by_rows(2), 1.0 / 3, 1) + error_m(by_cols(2), 1.0 / 3, 1);
  return traced;
}

/// The candidates of each part.
using Candidates = std::vector<std::vector<Candidate>>;

/// The trade of error for bytes at one target.
class Allotment {
 public:
  Allotment(const Candidates& candidates, const std::vector<double>& weights, double target_m,
            std::size_t most_shapes, TexelCost cost)
      : candidates_(candidates),
        weights_(weights),
        target_m_(target_m),
        most_shapes_(most_shapes),
        cost_(cost) {}

  /// The maps of least error plus price [m a byte].
  std::vector<Choice> at(double price) const {
    std::vector<Choice> choices;
    for (std::size_t k = 0; k < candidates_.size(); ++k)
      choices.push_back(choose(candidates_[k], weights_[k], price));
    return choices;
  }
  double mean_error_m(const std::vector<Choice>& choices) const {
    double sum = 0;
    for (std::size_t k = 0; k < choices.size(); ++k) sum += weights_[k] * choices[k].error_m;
    return sum;
  }
  /// In the file.
  double stored_bytes(const std::vector<Choice>& choices) const {
    double sum = 0;
    for (std::size_t k = 0; k < choices.size(); ++k) {
      const TracedShape& traced = *candidates_[k][choices[k].candidate].traced;
      sum += kStoredShare * traced.hit_share * choices[k].texels * bits(traced) / 8;
    }
    return sum;
  }
  std::uint32_t bits(const TracedShape& traced) const {
    const double codes = traced.deepest_m / (kStepShare * target_m_) + 2;
    return static_cast<std::uint32_t>(std::clamp(std::ceil(std::log2(codes)), 4.0, double(kMostBits)));
  }
  /// The price at which `fits(choices)` changes. `fits` holds at all prices below it, or at all above.
  template <class Fits>
  double price_where(Fits fits, bool holds_below) const {
    double low = 1e-12 * target_m_, high = 1e6 * target_m_;
    constexpr int kHalvings = 60;
    for (int i = 0; i < kHalvings; ++i) {
      const double price = std::sqrt(low * high);
      (fits(at(price)) == holds_below ? low : high) = price;
    }
    return holds_below ? low : high;
  }

 private:
  Choice choose(const std::vector<Candidate>& candidates, double weight, double price) const {
    Choice best;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < std::min(candidates.size(), most_shapes_); ++k) {
      const TracedShape& traced = *candidates[k].traced;
      const bool held_only = cost_ == TexelCost::kHeld;
      const double texel_bits =
          held_only ? traced.held_share * (bits(traced) + (traced.has_seam ? 1 : 0)) : bits(traced);
      const double row_bytes = held_only ? 3 : 0;
      for (std::size_t r = 0; r < traced.rows.size(); ++r) {
        for (std::size_t c = 0; c < traced.cols.size(); ++c) {
          const Strided &row = traced.rows[r], &col = traced.cols[c];
          const double error_m = row.error_m + col.error_m + traced.own_error_m;
          const double rows = 2.0 * traced.cells.rows / row.stride + 1;
          const double texels = rows * 4.0 * traced.cells.cols / col.stride;
          const double bytes = row_bytes * rows + texels * texel_bits / 8;
          const double cost = weight * error_m + price * bytes;
          if (cost < least) {
            least = cost;
            best = {k, r, c, error_m, texels};
          }
        }
      }
    }
    return best;
  }

  const Candidates& candidates_;
  const std::vector<double>& weights_;
  double target_m_;
  std::size_t most_shapes_;
  TexelCost cost_;
};

}  // namespace

double stored_bytes(const std::vector<Part>& parts) {
  double bits = 0;
  for (const Part& part : parts) {
    const auto misses = std::ranges::count(part.map.code, part.map.miss_code());
    bits += part.map.bits * double(static_cast<std::ptrdiff_t>(part.map.code.size()) - misses);
  }
  return kStoredShare * bits / 8;
}

struct MapDrawer::Impl {
  const MeshQueries& queries;
  std::vector<double> weights;  ///< sum 1
  Candidates candidates;
  TracedShapes known, used;

  void trace_wanted(std::size_t most_shapes) {
    std::vector<Candidate*> wanted;
    for (std::vector<Candidate>& of_part : candidates)
      for (std::size_t i = 0; i < std::min(of_part.size(), most_shapes); ++i)
        if (!of_part[i].is_traced_in(of_part[i].traced)) wanted.push_back(&of_part[i]);
    tbb::parallel_for(std::size_t{0}, wanted.size(), [&](std::size_t i) {
      Candidate& candidate = *wanted[i];
      const auto here = std::ranges::find_if(known, [&](const auto& t) { return candidate.is_traced_in(t); });
      candidate.traced =
          here != known.end()
              ? *here
              : std::make_shared<const TracedShape>(trace(candidate.placed, queries, candidate.wanted));
    });
    for (const Candidate* candidate : wanted) used.push_back(candidate->traced);
  }

  /// Where a direction of a field is taken as it is, a finer one might be worth its bytes.
  bool want_finer(const std::vector<Choice>& choices) {
    bool any = false;
    const auto finer = [&](std::uint32_t& cells, std::size_t choice) {
      if (choice != 0 || cells >= kMostQuadrantCells) return;
      cells *= 2;
      any = true;
    };
    for (std::size_t k = 0; k < choices.size(); ++k) {
      Quadrant& wanted = candidates[k][choices[k].candidate].wanted;
      finer(wanted.rows, choices[k].row);
      finer(wanted.cols, choices[k].col);
    }
    return any;
  }
};

MapDrawer::MapDrawer(const std::vector<std::vector<PlacedShape>>& shapes, const std::vector<double>& area_m2,
                     const MeshQueries& queries, TracedShapes known)
    : impl_(std::make_unique<Impl>(Impl{queries, {}, {}, std::move(known), {}})) {
  const double total_m2 = std::accumulate(area_m2.begin(), area_m2.end(), 0.0);
  for (const double a : area_m2) impl_->weights.push_back(a / total_m2);
  for (const std::vector<PlacedShape>& of_part : shapes) {
    std::vector<Candidate>& candidates = impl_->candidates.emplace_back(of_part.size());
    for (std::size_t i = 0; i < of_part.size(); ++i) candidates[i].placed = of_part[i];
  }
}

MapDrawer::~MapDrawer() = default;

const TracedShapes& MapDrawer::traced() const { return impl_->used; }

bool MapDrawer::draw(std::vector<Part>& parts, const MapTarget& target, std::size_t most_shapes,
                     TexelCost cost) {
  const Candidates& candidates = impl_->candidates;
  const Allotment allotment(candidates, impl_->weights, target.error_m, most_shapes, cost);
  const auto meets_target = [&](const std::vector<Choice>& c) {
    return allotment.mean_error_m(c) <= target.error_m;
  };
  const auto in_budget = [&](const std::vector<Choice>& c) {
    return allotment.stored_bytes(c) <= static_cast<double>(target.max_bytes);
  };
  std::vector<Choice> choices;
  bool by_budget = false;
  do {
    impl_->trace_wanted(most_shapes);
    choices = allotment.at(allotment.price_where(meets_target, true));
    by_budget = !in_budget(choices);
    if (by_budget) choices = allotment.at(allotment.price_where(in_budget, false));
  } while (impl_->want_finer(choices));
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t k) {
    const TracedShape& c = *candidates[k][choices[k].candidate].traced;
    parts[k].shape = c.placed.shape;
    parts[k].object_from_part = c.placed.object_from_part;
    parts[k].sphere = sphere_of(c.placed.shape, c.placed.object_from_part);
    parts[k].map =
        quantise(c.field, {c.rows[choices[k].row].stride, c.cols[choices[k].col].stride, allotment.bits(c)});
  });
  return by_budget;
}

std::vector<DistanceMap> MapDrawer::finer(std::size_t k, const Part& part) const {
  std::vector<DistanceMap> maps;
  const auto has_drawn = [&](const Candidate& c) {
    return c.traced && c.placed.shape == part.shape && c.placed.object_from_part == part.object_from_part &&
           (c.traced->field.rows - 1) % (part.map.rows - 1) == 0 && c.traced->field.cols % part.map.cols == 0;
  };
  const auto& candidates = impl_->candidates[k];
  const auto candidate = std::ranges::find_if(candidates, has_drawn);
  if (candidate == candidates.end()) return maps;
  const RayField& field = candidate->traced->field;
  const std::uint32_t row_stride = (field.rows - 1) / (part.map.rows - 1);
  const std::uint32_t col_stride = field.cols / part.map.cols;
  // Strides ascend.
  const auto next = [](const std::vector<Strided>& strides, std::uint32_t stride) {
    std::uint32_t below = stride;
    for (const Strided& s : strides)
      if (s.stride < stride) below = s.stride;
    return below;
  };
  const std::uint32_t finer_rows = next(candidate->traced->rows, row_stride);
  const std::uint32_t finer_cols = next(candidate->traced->cols, col_stride);
  if (finer_rows < row_stride) maps.push_back(quantise(field, {finer_rows, col_stride, part.map.bits}));
  if (finer_cols < col_stride) maps.push_back(quantise(field, {row_stride, finer_cols, part.map.bits}));
  if (part.map.bits < kMostBits) maps.push_back(quantise(field, {row_stride, col_stride, part.map.bits + 1}));
  return maps;
}

}  // namespace sqmap::bake
