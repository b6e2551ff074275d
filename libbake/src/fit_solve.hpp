// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>

#include "sqmap/bake/fit.hpp"

#include "fit_model.hpp"

namespace sqmap::bake::fit {

/// A superquadric on its way to the optimum.
struct Candidate {
  Placed at;
  int iterations{};
  FitStop stop{};  ///< of the last run
};

/// Levenberg-Marquardt (Ceres) on the residuals of paper eq. (3), the root inside: sqrt(a1 a2 a3) (beta^2 -
/// 1), heavier for points outside. Exact where the points lie on a superquadric.
void solve_surface(Candidate& candidate, std::span<const Vec3d> points, const Bounds& bounds,
                   int max_iterations);

/// Minimises the inflated volume, log V + 3 log |beta|_p, with p = first_p, 4 first_p, ... last_p; as p grows
/// the p-norm becomes the largest beta. The scale drops out, so no point needs to be bounded on the way.
/// Ceres has no solver for it: its line searches do not take bounds.
void solve_volume(Candidate& candidate, std::span<const Vec3d> points, const Bounds& bounds,
                  int max_iterations, double first_p, double last_p);

}  // namespace sqmap::bake::fit
