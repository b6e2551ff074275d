// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "sqmap/bake/mesh.hpp"

namespace sqmap::bake {

/// The mesh with vertices and faces in an order that follows from the surface alone: vertices by their
/// distance from the mean of all, faces by their vertices, each from its first vertex on. The order in which
/// a file lists them then changes nothing, and a rotated copy lists them alike. Only vertices at the same
/// place keep the order they had.
Mesh in_own_order(const Mesh& mesh);

}  // namespace sqmap::bake
