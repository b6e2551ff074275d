// SPDX-License-Identifier: Apache-2.0
#include "sqmap/asset/map_grid.hpp"

#include <array>
#include <cassert>
#include <numbers>

namespace sqmap {

namespace {

// Samples of the curve whose chords stand for its arc length. Stored maps depend on it (FORMAT.md S6): a
// change is a major format step.
constexpr int kArcSamples = 2048;

double angle_rad(double sample) { return sample * (std::numbers::pi / 2) / kArcSamples; }

/// Directions of the samples; the same for every curve.
struct Directions {
  std::array<double, kArcSamples + 1> cosine, sine;

  static const Directions& all() {
    static const Directions directions = [] {
      Directions d;
      for (int k = 0; k <= kArcSamples; ++k) {
        d.cosine[k] = k == kArcSamples ? 0 : std::cos(angle_rad(k));
        d.sine[k] = std::sin(angle_rad(k));
      }
      return d;
    }();
    return directions;
  }
};

SuperellipsePoint<double> mirrored(SuperellipsePoint<double> p, bool flip_c, bool flip_s) noexcept {
  if (flip_c) {
    p.c = -p.c;
    p.c_power = -p.c_power;
  }
  if (flip_s) {
    p.s = -p.s;
    p.s_power = -p.s_power;
  }
  return p;
}

}  // namespace

std::vector<SuperellipsePoint<double>> quadrant_nodes(double alpha_m, double beta_m, double e,
                                                      std::uint32_t cells, double taper) {
  assert(alpha_m > 0 && beta_m > 0 && cells >= 1);
  const Directions& directions = Directions::all();
  std::vector<double> length(kArcSamples + 1);
  double c = alpha_m, s = 0;
  for (int k = 1; k <= kArcSamples; ++k) {
    const double cosine = directions.cosine[k], sine = directions.sine[k];
    const double n = superellipse_norm<double>(cosine, sine, e);
    const double next_c = alpha_m * cosine / n * (1 + taper * (sine / n)), next_s = beta_m * sine / n;
    length[k] = length[k - 1] + std::hypot(next_c - c, next_s - s);
    c = next_c;
    s = next_s;
  }

  std::vector<SuperellipsePoint<double>> nodes(cells + 1);
  nodes.front() = superellipse_point<double>(1, 0, e);
  nodes.back() = superellipse_point<double>(0, 1, e);
  int sample = 0;
  for (std::uint32_t k = 1; k < cells; ++k) {
    const double target = length.back() * k / cells;
    while (length[sample + 1] < target) ++sample;
    const double step = length[sample + 1] - length[sample];
    const double angle = angle_rad(sample + (step > 0 ? (target - length[sample]) / step : 0));
    nodes[k] = superellipse_point<double>(std::cos(angle), std::sin(angle), e);
  }
  return nodes;
}

MapGrid::MapGrid(const Superquadric& shape, std::uint32_t rows, std::uint32_t cols)
    : shape_(shape),
      rows_(rows),
      cols_(cols),
      eta_(quadrant_nodes(std::sqrt(shape.semi_axes_m.x * shape.semi_axes_m.y), shape.semi_axes_m.z, shape.e1,
                          (rows - 1) / 2, shape.taper)),
      omega_(quadrant_nodes(shape.semi_axes_m.x, shape.semi_axes_m.y, shape.e2, cols / 4)) {
  assert(rows >= 3 && rows % 2 == 1 && cols >= 4 && cols % 4 == 0);
  if (shape.taper != 0)
    eta_below_ = quadrant_nodes(std::sqrt(shape.semi_axes_m.x * shape.semi_axes_m.y), shape.semi_axes_m.z,
                                shape.e1, (rows - 1) / 2, -shape.taper);
}

SuperellipsePoint<double> MapGrid::eta(std::uint32_t row) const noexcept {
  const std::uint32_t equator = (rows_ - 1) / 2;
  if (row >= equator) return eta_[row - equator];
  return mirrored((eta_below_.empty() ? eta_ : eta_below_)[equator - row], false, true);
}

SuperellipsePoint<double> MapGrid::omega(std::uint32_t col) const noexcept {
  const std::uint32_t cells = cols_ / 4, quadrant = col / cells, k = col % cells;
  switch (quadrant) {
    case 0:
      return mirrored(omega_[k], true, true);
    case 1:
      return mirrored(omega_[cells - k], false, true);
    case 2:
      return omega_[k];
    default:
      return mirrored(omega_[cells - k], true, false);
  }
}

}  // namespace sqmap
