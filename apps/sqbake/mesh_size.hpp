// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>

#include "sqmap/bake/mesh.hpp"

namespace sqmap::apps {

/// Diagonal of the bounding box [m]; 0 for a mesh without vertices.
double diagonal_m(const bake::Mesh& mesh);

/// What looks like a wrong --unit: an object below a millimetre or above a kilometre.
std::optional<std::string> size_warning(const bake::Mesh& mesh);

}  // namespace sqmap::apps
