// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "sqmap/runtime/effects/touches.hpp"

namespace sqmap::runtime {

/// Haptic texture, paper eq. (34): noise n_g on the depth before the reaction force is taken.
///
///     depth <- depth + a g(s / wavelength) min(1, depth / a),   |g| <= 1, s: surface point of the contact
///
/// g is seeded gradient noise in the object's frame: a function of place, never of time, so that a resting
/// probe feels a constant force; continuous; zero mean over the surface. The last factor starts the texture
/// with the contact, where the paper's sum would begin with a jump of k n_g; it also keeps the depth from
/// changing sign without a clamp that would bias its mean. The force field is not conservative: a probe that
/// is driven around over it can gain up to k a times the way it is driven.
/// Sources: Moustakas et al. 2007 (34), Kim et al. 2002; noise after Perlin 2002, with a hash of our own.
struct Texture {
  static constexpr const char* kName = "texture";

  float amplitude_m = 1e-3F;   ///< a
  float wavelength_m = 1e-2F;  ///< edge of the noise's lattice
  float seed = 1;              ///< whole number in [0, 2^24]: another seed, another surface

  static std::span<const Parameter<Texture>> parameters() noexcept;
  void touch(Touches& touches) noexcept;
};

/// Gradient noise at a place given in lattice edges, in [-1, 1]; zero beyond 2^22 edges, where float has no
/// fraction left.
float lattice_noise(const Vec3f& place, std::uint32_t seed) noexcept;

}  // namespace sqmap::runtime
