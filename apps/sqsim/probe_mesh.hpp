// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sqmap/runtime/scene.hpp"

#include "../common/part_surface.hpp"

namespace sqmap::apps {

/// Each triangle cut in four at the middles of its edges; middles are shared.
TriangleSurface subdivided(const TriangleSurface& surface);

/// The vertices as a probe, weighted by a third of the triangles around them. `zone_m` > 0: impact zones are
/// the cubes of that edge that hold vertices, numbered in the order of the vertices.
runtime::Probe probe_of(const TriangleSurface& surface, double zone_m);

}  // namespace sqmap::apps
