// SPDX-License-Identifier: GPL-3.0-or-later
#include "field.hpp"

#include <algorithm>
#include <cmath>

#include "closest.hpp"
#include "cloud.hpp"
#include "model.hpp"
#include "timing.hpp"

namespace sqmap::bench {
namespace {

constexpr unsigned kCoarsest = 16;
/// Half the diagonal of a unit cell. The distance is a Lipschitz function with constant 1, so a trilinear
/// value is wrong by at most this many spacings.
constexpr double kHalfDiagonal = 0.8660254037844387;
/// Float coordinates in Embree's boxes, relative to the size of the object.
constexpr double kBoxRounding = 4e-6;

Field lattice_for(const Model& model, unsigned resolution) {
  Field field;
  // The band, one cell for points on the rim, and a little for the rounding of the queries.
  const double margin_m = 1.02 * kBand * model.r_max_m();
  const Vec3d size = model.high_m - model.low_m + 2 * margin_m * Vec3d{1, 1, 1};
  field.spacing_m = std::max({size.x, size.y, size.z}) / (resolution - 1);
  for (int axis = 0; axis < 3; ++axis) {
    const auto cells = static_cast<std::uint32_t>(std::ceil(size[axis] / field.spacing_m - 1e-9));
    field.nodes[static_cast<std::size_t>(axis)] = std::max(cells, 1U) + 1;
    field.origin_m[axis] =
        (model.low_m[axis] + model.high_m[axis] - field.spacing_m * std::max(cells, 1U)) / 2;
  }
  field.distance_m.resize(std::size_t{field.nodes[0]} * field.nodes[1] * field.nodes[2]);
  return field;
}

void fill(const Model& model, const EmbreeClosest& closest, unsigned resolution, Field& field) {
  Field coarse;
  const bool has_coarse = resolution > kCoarsest;
  if (has_coarse) {
    coarse = lattice_for(model, resolution / 2);
    fill(model, closest, resolution / 2, coarse);
  }
  const double h = field.spacing_m;
  const double guess_error_m = has_coarse ? kHalfDiagonal * coarse.spacing_m * 1.001 : 0;
  const double exact_m = 1.1 * kBand * model.r_max_m() + 2 * h;
  const double rounding_m = kBoxRounding * model.r_max_m();
  const double everything_m = 2 * norm(model.high_m - model.low_m) + model.r_max_m();
  for (std::uint32_t z = 0; z < field.nodes[2]; ++z)
    for (std::uint32_t y = 0; y < field.nodes[1]; ++y)
      for (std::uint32_t x = 0; x < field.nodes[0]; ++x) {
        const Vec3d p = field.node_m(x, y, z);
        float& slot = field.distance_m[field.index(x, y, z)];
        double reach_m = everything_m;
        if (has_coarse) {
          const double guess_m = coarse.sample(p);
          if (std::abs(guess_m) > exact_m + guess_error_m) {
            slot = static_cast<float>(guess_m);
            continue;
          }
          reach_m = std::abs(guess_m) + guess_error_m;
        }
        if (x > 0)
          reach_m = std::min(reach_m, std::abs(double{field.distance_m[field.index(x - 1, y, z)]}) + h);
        auto answer = closest.nearest(p, reach_m + rounding_m);
        if (!answer.is_found) answer = closest.nearest(p, everything_m);  // beside values that are not exact
        const double distance_m = answer.distance_m;
        // Two neighbours whose distances sum to more than their spacing lie on one side of the surface.
        double side = 0;
        const std::uint32_t at[3] = {x, y, z};
        for (int axis = 0; axis < 3 && side == 0; ++axis) {
          if (at[axis] == 0) continue;
          const float before =
              field.distance_m[field.index(x - (axis == 0), y - (axis == 1), z - (axis == 2))];
          if (std::abs(double{before}) + distance_m > 1.0001 * h) side = before < 0 ? -1 : 1;
        }
        if (side == 0) side = model.oracle->inside(p) ? -1 : 1;
        slot = static_cast<float>(side * distance_m);
      }
}

}  // namespace

double Field::sample(const Vec3d& p_m) const noexcept {
  std::uint32_t cell[3];
  double f[3];
  for (int axis = 0; axis < 3; ++axis) {
    const std::uint32_t last = nodes[static_cast<std::size_t>(axis)] - 2;
    const double u = std::clamp((p_m[axis] - origin_m[axis]) / spacing_m, 0.0, last + 1.0);
    cell[axis] = std::min(static_cast<std::uint32_t>(u), last);
    f[axis] = u - cell[axis];
  }
  const auto along_x = [&](std::uint32_t dy, std::uint32_t dz) {
    const std::size_t i = index(cell[0], cell[1] + dy, cell[2] + dz);
    return distance_m[i] + f[0] * (double{distance_m[i + 1]} - distance_m[i]);
  };
  const double low = along_x(0, 0) + f[1] * (along_x(1, 0) - along_x(0, 0));
  const double high = along_x(0, 1) + f[1] * (along_x(1, 1) - along_x(0, 1));
  return low + f[2] * (high - low);
}

Field exact_field(const Model& model, unsigned resolution) {
  const double start_s = wall_s();
  Field field = lattice_for(model, resolution);
  fill(model, EmbreeClosest(model.mesh), resolution, field);
  field.seconds.push_back(wall_s() - start_s);
  return field;
}

}  // namespace sqmap::bench
