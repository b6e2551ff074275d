// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "surface.hpp"

namespace sqmap::bake {

/// A sample of the surface that stands for the points nearest to it.
struct Source {
  std::uint32_t vertex;
  double area;  ///< of its Voronoi cell; the areas of all sources sum to 1
};

/// Farthest-point sources, each next one the vertex farthest along edges from all before; the first is the
/// vertex farthest from the centroid. At most `count`, fewer on small meshes.
std::vector<Source> farthest_point_sources(const Surface& surface, std::size_t count);

/// Geodesic distance of every vertex from each source vertex; shape [vertices][points].
///
/// By CGAL's heat method where the surface is manifold and free of needles, otherwise (and for any source
/// whose heat solution is not finite or not plausible) by fast marching. The same numbers for any number of
/// threads.
std::vector<std::vector<float>> distances_from_each(const Surface& surface,
                                                    std::span<const std::uint32_t> vertices);

/// Geodesic distance of every vertex from the nearest of `vertices` by fast marching over the triangles
/// (Kimmel and Sethian 1998). Works on any triangles; obtuse corners cost accuracy. Shape [points]; infinity
/// where unreachable.
std::vector<float> fast_marching(const Surface& surface, std::span<const std::uint32_t> vertices);

/// Protrusion (paper eq. 4) at the vertices: mean geodesic distance to the whole surface; shape [points].
std::vector<double> vertex_protrusion(const Surface& surface, std::span<const Source> sources,
                                      std::span<const std::vector<float>> distances);

/// True when no vertex within `window` (along edges) of `vertex` has a larger value, nor an equal one and a
/// lower index.
bool is_largest_within(const Surface& surface, std::span<const double> value, std::uint32_t vertex,
                       double window);

/// Mean of the three vertex values of each face; shape [faces].
std::vector<double> face_means(const Surface& surface, std::span<const double> at_vertices);

}  // namespace sqmap::bake
