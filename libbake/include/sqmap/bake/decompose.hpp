// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "sqmap/asset/asset.hpp"
#include "sqmap/asset/result.hpp"
#include "sqmap/bake/mesh.hpp"
#include "sqmap/bake/progress.hpp"

namespace sqmap::bake {

/// Natural parts by salience (paper section 3). Every number is dimensionless: lengths are relative to the
/// square root of the component's area, areas to the component's area.
struct DecomposeOptions {
  int source_count = 100;       ///< farthest-point sources of the protrusion sum (eq. 4), in [1, 1000]
  double window = 0.12;         ///< radius of the geodesic window of a salient feature (eq. 5), in (0, 1]
  double locale_width = 0.015;  ///< geodesic width of one locale, in [0.005, 0.5]
  /// Least strength of the border of a part, in [0, 1]: how concave the border is (1: it turns as sharply
  /// inwards all around as a circle of its own length), less where the part hardly sticks out of it.
  double boundary_strength = 0.15;
  /// Share of its convex hull that a segment must lose by a weak cut, in [0, 1]. Cuts of twice the default
  /// strength need no such proof, weaker ones do.
  double min_hull_gain = 0.05;
  double k_h = 0.3;   ///< share of a locale's area that must be hyperbolic, in [0, 1]
  double t_h = 10.0;  ///< mean |Gaussian curvature| there times the component's area, >= 0
  bool use_boundary_strength = true;
  bool use_hyperbolic = true;
  bool join_components =
      false;  ///< one segment for the whole mesh, however many components it has; nothing is cut
  double min_part_area = 0.02;  ///< smallest part cut off, in (0, 0.5]; components smaller than this share of
                                ///< the whole mesh stay whole

  /// Errors: kBadOption.
  Outcome check() const;
};

/// A partition of the faces.
struct Decomposition {
  std::vector<std::uint32_t> label;  ///< segment of each face, 0 .. reasons.size() - 1; shape [faces]
  std::vector<CutReason> reasons;    ///< the last cut that separated each segment
};

/// Cuts each component along borders of its locales. Segments are connected over edges, unless components are
/// joined, and numbered by descending area (ties: by centroid). The result does not depend on the number of
/// threads, nor on vertices that carry no shape, as where faces are cut into coplanar ones. Errors:
/// kBadOption; kCancelled; kInvalidMesh when `prepared.component` does not match the faces.
Result<Decomposition> decompose(const PreparedMesh& prepared, const DecomposeOptions& options,
                                const Progress& progress);

/// Degree of protrusion p(u) of every face (dual vertex), paper eq. (4), as mean geodesic distance / square
/// root of the component's area; shape [faces]. Sampled at `source_count` farthest-point sources, each
/// weighted by the area of its Voronoi cell. Geodesic distances by CGAL's heat method, by fast marching where
/// that does not apply (non-manifold edges, needles).
std::vector<double> protrusion(const PreparedMesh& prepared, int source_count);

/// Gaussian curvature at every face (paper eq. 5-7) [1/m^2]; shape [faces]. Angle deficits summed over a
/// window, over its area. The window has a fixed radius of 0.03 sqrt(component area), not the paper's 2
/// sqrt(face area), which would shrink with every subdivision and so give another curvature, and other parts,
/// for the same surface; coarse meshes widen it to the faces around a vertex.
std::vector<double> gaussian_curvature(const PreparedMesh& prepared);

}  // namespace sqmap::bake
