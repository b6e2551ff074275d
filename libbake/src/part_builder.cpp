// SPDX-License-Identifier: GPL-3.0-or-later
#include "part_builder.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "fit_bend.hpp"

namespace sqmap::bake {

BoundingSphere sphere_of(const Superquadric& shape, const Pose& object_from_part) {
  return bounding_sphere(shape, object_from_part);
}

Result<FittedPart> fit_part(const SolidSet& set, const Solid& solid, const FitOptions& options) {
  const std::vector<Vec3d> points_m = set.points(solid);
  auto fit = fit_superquadric(points_m, options);
  if (!fit) return fit.error();
  // A box wants sharper edges than the usual bound on exponents allows. On other parts that bound costs 2-3 %
  // of volume and buys smoother maps.
  constexpr double kWorthSharpEdges = 0.9;
  int iterations = fit.value().iterations;
  const Superquadric& shape = fit.value().shape;
  if (std::min(shape.e1, shape.e2) < 1.01 * options.min_exponent) {
    FitOptions sharp = options;
    sharp.min_exponent = kMinExponent;
    auto boxy = fit_superquadric(points_m, sharp);
    if (boxy) iterations += boxy.value().iterations;
    if (boxy && boxy.value().volume_m3 < kWorthSharpEdges * fit.value().volume_m3) fit = std::move(boxy);
  }
  Part part;
  part.shape = fit.value().shape;
  part.object_from_part = fit.value().object_from_part;
  part.sphere = sphere_of(part.shape, part.object_from_part);
  part.volume_m3 = set.volume_m3(solid);
  return FittedPart{std::move(part), {iterations, fit.value().stop}};
}

std::optional<FittedPart> bend_part(const SolidSet& set, const Solid& solid, const FittedPart& straight,
                                    const FitOptions& options) {
  Fit start;
  start.shape = straight.part.shape;
  start.object_from_part = straight.part.object_from_part;
  start.volume_m3 = volume_m3(start.shape);
  start.iterations = straight.fit.iterations;
  const auto fit = fit_bent(set.vertices_m, solid.triangles, start, options);
  if (!fit) return std::nullopt;
  FittedPart bent{straight.part, {fit->iterations, fit->stop}};
  bent.part.shape = fit->shape;
  bent.part.object_from_part = fit->object_from_part;
  bent.part.sphere = sphere_of(fit->shape, fit->object_from_part);
  return bent;
}

double draft_map(Part& part, const MeshQueries& queries, std::uint32_t quadrant_cells) {
  const RayField field =
      trace_map(part.shape, part.object_from_part, 2 * quadrant_cells + 1, 4 * quadrant_cells, queries);
  part.map = quantise(field, {1, 1, 16});
  const MapGrid grid(part.shape, field.rows, field.cols);
  const CoarseningError by_rows = coarsening_error(field, grid, 2, 1);
  const CoarseningError by_cols = coarsening_error(field, grid, 1, 2);
  // About what such a map is chosen by: interpolated depth counts less than occupancy.
  const auto loss_m = [](const CoarseningError& e) { return e.depth_m / 4 + e.occupancy_m; };
  // Texels are spent best where rows and columns lose alike.
  return 2 * std::sqrt(loss_m(by_rows) * loss_m(by_cols));
}

}  // namespace sqmap::bake
