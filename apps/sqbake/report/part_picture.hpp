// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "sqmap/asset/asset.hpp"
#include "sqmap/asset/result.hpp"

namespace sqmap::apps {

/// Two views of an asset side by side, each part in its colour: the superquadrics, and the surface that their
/// maps represent. Parallel projection from the front, the right and above, z up, on a transparent ground.
/// @param side  height of the picture and half its width [pixels], in [16, 1024]
/// @return      a PNG file
/// Errors: kFileUnwritable with libpng's reason.
Result<std::vector<std::uint8_t>> part_picture(const Asset& asset, std::uint32_t side);

}  // namespace sqmap::apps
