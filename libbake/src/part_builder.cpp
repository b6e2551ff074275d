// SPDX-License-Identifier: GPL-3.0-or-later
#include "part_builder.hpp"

#include <algorithm>
#include <cmath>

namespace sqmap::bake {

namespace {

// Shares of the error target given to interpolation and to quantisation. A uniform quantiser of step q errs
// by q/4 on average, so a step equal to the target takes a quarter of it.
constexpr double kInterpolationShare = 0.7;
// Rays that pass silhouettes and seams between texels put a share of space on the wrong side. As a mean
// length over all rays it may be this share of the depth target.
constexpr double kOccupancyShare = 0.5;
constexpr double kStepShare = 1.0;
constexpr std::uint32_t kLeastQuadrantCells = 4;

std::uint32_t rows_of(std::uint32_t quadrant_cells) { return 2 * quadrant_cells + 1; }
std::uint32_t cols_of(std::uint32_t quadrant_cells) { return 4 * quadrant_cells; }

std::uint32_t bits_for(const RayField& field, double step_m) {
  double most = 0;
  for (const double depth_m : field.depth_m) most = std::max(most, depth_m);
  const double codes = most / step_m + 2;
  return static_cast<std::uint32_t>(std::clamp(std::ceil(std::log2(codes)), 4.0, 16.0));
}

}  // namespace

Result<Part> fit_part(const SolidSet& set, const Cell& cell, const FitOptions& options) {
  const std::vector<Vec3d> points_m = set.points(cell.solid);
  auto fit = fit_superquadric(points_m, options);
  if (!fit) return fit.error();
  // A box wants sharper edges than the usual bound on exponents allows. On other parts that bound costs 2-3 %
  // of volume and buys smoother maps.
  constexpr double kWorthSharpEdges = 0.9;
  const Superquadric& shape = fit.value().shape;
  if (std::min(shape.e1, shape.e2) < 1.01 * options.min_exponent) {
    FitOptions sharp = options;
    sharp.min_exponent = kMinExponent;
    auto boxy = fit_superquadric(points_m, sharp);
    if (boxy && boxy.value().volume_m3 < kWorthSharpEdges * fit.value().volume_m3) fit = std::move(boxy);
  }
  Part part;
  part.shape = fit.value().shape;
  part.object_from_part = fit.value().object_from_part;
  part.sphere = {part.object_from_part.translation_m, bounding_radius_m(part.shape)};
  part.segment = cell.segment;
  part.reason = cell.reason;
  part.volume_m3 = set.volume_m3(cell.solid);
  return part;
}

void map_part(Part& part, const MeshQueries& queries, const MapTarget& target) {
  std::uint32_t finest = std::min(32U, target.max_quadrant_cells);
  for (;;) {
    const std::uint32_t rows = rows_of(finest), cols = cols_of(finest);
    const RayField field = trace_map(part.shape, part.object_from_part, rows, cols, queries);
    const MapGrid grid(part.shape, rows, cols);
    const auto meets = [&](const CoarseningError& error, double depth_gain, double occupancy_gain) {
      return error.depth_m <= depth_gain * kInterpolationShare * target.error_m &&
             error.occupancy_m <= occupancy_gain * kOccupancyShare * target.error_m;
    };
    MapPlan best;
    for (std::uint32_t row_stride = finest / kLeastQuadrantCells; row_stride >= 1; row_stride /= 2) {
      for (std::uint32_t col_stride = finest / kLeastQuadrantCells; col_stride >= 1; col_stride /= 2) {
        if (row_stride * col_stride <= best.row_stride * best.col_stride) continue;
        if (meets(coarsening_error(field, grid, row_stride, col_stride), 1, 1)) {
          best.row_stride = row_stride;
          best.col_stride = col_stride;
        }
      }
    }
    // The field's own error is unseen; it is foretold from the next coarser map, at the rates of bilinear
    // interpolation (second order) and of silhouettes (first order).
    const bool exhausted = !meets(coarsening_error(field, grid, 2, 2), 4, 2);
    if (exhausted && finest < target.max_quadrant_cells) {
      finest *= 2;
      continue;
    }
    best.bits = bits_for(field, kStepShare * target.error_m);
    part.map = quantise(field, best);
    return;
  }
}

void draft_map(Part& part, const MeshQueries& queries, std::uint32_t quadrant_cells) {
  const RayField field =
      trace_map(part.shape, part.object_from_part, rows_of(quadrant_cells), cols_of(quadrant_cells), queries);
  part.map = quantise(field, {1, 1, 16});
}

}  // namespace sqmap::bake
