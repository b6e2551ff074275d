// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sqmap/runtime/effects/touches.hpp"

namespace sqmap::runtime {

/// Map smoothing (paper 6.1 and Fig. 13a): depth and normal become those of the depths at the contact and six
/// neighbours, at steps s_i of length h along the axes of A.
///
///     depth <- 1/7 (depth + sum depth_i)
///     g = -1/(2 h^2) sum depth_i s_i              central differences
///     normal <- g + max(0, 1 - 2 |g|) * 1/7 (normal + sum normal_i), then of unit length
///     surface <- point + depth * normal
///
/// Where two places of the surface are equally near, the normal of a neighbour jumps from one to the other
/// and its depth does not: so the direction comes from the depths. Normals count where the depths tell none,
/// as in a sheet thinner than h.
///
/// The paper filters the stored map, whose texels are unequal in size and differ between charts; neighbours
/// at a length in metres also blend across charts. The stencil does not turn with the normal, because one
/// that does jumps where the normal jumps. Bias: on a ball of radius R the depth shrinks by 2 h^2 / (7 (R -
/// depth)), in a hollow it grows by 2 h^2 / (7 (R + depth)), on a plane there is none. Six queries a contact,
/// asked in batches. A neighbour without a distance counts as if the surface were a plane. No depth can
/// differ by more than h from that at the contact; where a map says so, h it is.
struct Smoothing {
  static constexpr const char* kName = "smoothing";

  float radius_m = 5e-3F;  ///< h

  static std::span<const Parameter<Smoothing>> parameters() noexcept;
  void touch(Touches& touches) noexcept;
};

}  // namespace sqmap::runtime
