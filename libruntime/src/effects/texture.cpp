// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/effects/texture.hpp"

#include <algorithm>
#include <cmath>

namespace sqmap::runtime {
namespace {

/// Mixes the bits of a lattice point; the constants are odd numbers with balanced bits.
std::uint32_t hashed(std::int32_t x, std::int32_t y, std::int32_t z, std::uint32_t seed) noexcept {
  std::uint32_t h = seed * 0x9E3779B1U;
  for (const std::int32_t axis : {x, y, z}) {
    h = (h ^ static_cast<std::uint32_t>(axis)) * 0x85EBCA6BU;
    h ^= h >> 15U;
    h *= 0xC2B2AE35U;
    h ^= h >> 13U;
  }
  return h;
}

/// Gradient of a lattice point, one of the twelve edges of a cube (0, +-1, +-1), times d.
float slope(std::uint32_t hash, const Vec3f& d) noexcept {
  const std::uint32_t edge = hash % 12;
  const float a = edge < 8 ? d.x : d.y, b = edge < 4 ? d.y : d.z;
  return ((edge & 1U) != 0 ? -a : a) + ((edge & 2U) != 0 ? -b : b);
}

float fade(float t) noexcept { return t * t * t * (t * (t * 6 - 15) + 10); }
float between(float a, float b, float t) noexcept { return a + t * (b - a); }

}  // namespace

std::span<const Parameter<Texture>> Texture::parameters() noexcept {
  static constexpr Parameter<Texture> kTable[] = {
      {"amplitude_m", &Texture::amplitude_m, 0, 1},
      {"wavelength_m", &Texture::wavelength_m, 1e-6F, 1e3F},
      {"seed", &Texture::seed, 0, 16777216, true},
  };
  return kTable;
}

float lattice_noise(const Vec3f& place, std::uint32_t seed) noexcept {
  constexpr float kFarthest = 4194304;  // 2^22
  const float farthest = std::max({std::abs(place.x), std::abs(place.y), std::abs(place.z)});
  if (!(farthest < kFarthest)) return 0;  // NaN: no texture
  const Vec3f base{std::floor(place.x), std::floor(place.y), std::floor(place.z)};
  const Vec3f d = place - base;
  const auto x = static_cast<std::int32_t>(base.x), y = static_cast<std::int32_t>(base.y),
             z = static_cast<std::int32_t>(base.z);
  const auto corner = [&](int i, int j, int k) {
    return slope(hashed(x + i, y + j, z + k, seed),
                 d - Vec3f{static_cast<float>(i), static_cast<float>(j), static_cast<float>(k)});
  };
  const auto edge = [&](int j, int k) { return between(corner(0, j, k), corner(1, j, k), fade(d.x)); };
  const auto face = [&](int k) { return between(edge(0, k), edge(1, k), fade(d.y)); };
  // Exceeds 1 by a little where all eight gradients point at the middle of an edge.
  return std::clamp(between(face(0), face(1), fade(d.z)), -1.0F, 1.0F);
}

void Texture::touch(Touches& touches) noexcept {
  if (!(amplitude_m > 0)) return;
  const float edges_per_m = 1 / wavelength_m;
  for (Contact& contact : touches.contacts) {
    const float noise = lattice_noise(edges_per_m * contact.surface_m, static_cast<std::uint32_t>(seed));
    contact.depth_m += amplitude_m * noise * std::min(1.0F, contact.depth_m / amplitude_m);
  }
}

}  // namespace sqmap::runtime
