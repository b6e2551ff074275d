// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "sqmap/asset/asset.hpp"
#include "sqmap/asset/result.hpp"
#include "sqmap/bake/mesh.hpp"
#include "sqmap/bake/progress.hpp"

namespace sqmap::bake {

/// Natural parts by salience (paper section 3). All lengths are relative to sqrt(area of the component).
struct DecomposeOptions {
  int source_count = 100;           ///< farthest-point sources of the protrusion sum (eq. 4)
  double window = 0.12;             ///< radius of the geodesic window of a salient feature (eq. 5)
  double locale_width = 0.01;       ///< geodesic width of one locale
  double boundary_strength = 0.0;   ///< 0: default chosen by the implementer; documented there
  double k_h = 0.7;                 ///< share of a locale's area that must be hyperbolic, in [0, 1]
  double t_h = 2.0;                 ///< mean |Gaussian curvature| of those points, times component area [-]
  bool use_boundary_strength = true;
  bool use_hyperbolic = true;
  double min_part_area = 0.01;      ///< smallest part, share of the component's area

  Outcome check() const;
};

/// A partition of the faces.
struct Decomposition {
  std::vector<std::uint32_t> label;  ///< segment of each face, 0 .. reasons.size() - 1; shape [faces]
  std::vector<CutReason> reasons;    ///< why each segment was cut off
};

/// Cuts each component at its locales. Segments are edge-connected, numbered by a geometric rule (not by discovery).
/// Deterministic. Errors: kBadOption, kCancelled.
Result<Decomposition> decompose(const PreparedMesh& prepared, const DecomposeOptions& options,
                                const Progress& progress);

/// Degree of protrusion p(u) of every face (dual vertex), paper eq. (4), normalised to mean geodesic distance / the
/// square root of the component's area. Geodesic distances by CGAL's heat method from `source_count` farthest-point
/// sources, each weighted by the area of its Voronoi cell; shape [faces].
std::vector<double> protrusion(const PreparedMesh& prepared, int source_count);

/// Gaussian curvature at every face over the geodesic window 2 sqrt(area) (paper eq. 5-7) [1/m^2]; shape [faces].
/// Angle deficits summed over the window divided by its area.
std::vector<double> gaussian_curvature(const PreparedMesh& prepared);

}  // namespace sqmap::bake
