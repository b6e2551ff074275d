// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "surface.hpp"

namespace sqmap::bake {

/// Geodesic distances by the heat method (Crane, Weischedel, Wardetzky 2013; CGAL Heat_method_3, mode
/// Direct). The intrinsic Delaunay mode is not used: it does not terminate on needle triangles (CGAL issue
/// 5010). Not thread-safe.
class HeatSolver {
 public:
  virtual ~HeatSolver() = default;
  /// Distance of each vertex from `vertex`; empty when the solve failed. Values may be non-finite: check
  /// them.
  virtual std::vector<float> distances(std::uint32_t vertex) = 0;
};

/// Null when CGAL's mesh cannot hold the surface (an edge of three faces, faces of unlike orientation, a
/// vertex with several fans, an unused vertex) or the matrices cannot be factored.
std::unique_ptr<HeatSolver> make_heat_solver(const Surface& surface);

}  // namespace sqmap::bake
