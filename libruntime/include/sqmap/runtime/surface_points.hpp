// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sqmap/asset/asset.hpp"
#include "sqmap/asset/result.hpp"

namespace sqmap::runtime {

/// Points of the surface that an asset's maps represent, object frame [m], so that two bundles can meet where
/// no mesh is at hand:
///
///     const auto points = surface_points_m(other_asset, 0.005);
///     const auto body = PointBody::build(points.value());
///     instance.contacts(body.value(), where_the_other_is, contacts, {});
///
/// They are places where a node's ray crosses the mesh (r - D n, paper eq. 22), all crossings that are
/// stored, thinned to the one nearest to the centre in each cube of a grid of this spacing; so they are no
/// denser than the nodes. The same points in the same order every time. Allocates. Errors: kInvalidAsset;
/// kBadOption for a spacing that is not in [1e-6, 1] of R_max.
Result<std::vector<Vec3f>> surface_points_m(const Asset& asset, double spacing_m);

}  // namespace sqmap::runtime
