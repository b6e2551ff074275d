// SPDX-License-Identifier: Apache-2.0
//
// A mass on a spring that is pressed into an object, and the energy it has: what a haptic device would be
// fed.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include "sqmap/runtime/object.hpp"
#include "sqmap/runtime/scene.hpp"

namespace sqmap::test {

/// The mass, its spring and the loop. With these numbers one step is 1/85 of a period in contact.
struct Press {
  double mass_kg = 0.1;
  double coupling_n_per_m = 50;    ///< of the spring, whose other end is held below the surface
  double stiffness_n_per_m = 500;  ///< of the reaction
  double damping_n_s_per_m = 0;
  double step_s = 1e-3;
  int frames = 60000;     ///< a minute
  double below_m = 0.03;  ///< where the spring is held
  double above_m = 0.03;  ///< where the mass is let go
  double aside_m = 0.02;  ///< and how far to the side
};

/// The largest energy ever and the last, as shares of the energy at the start. `most_of_probe` is that of the
/// mass and its spring alone, without what the reaction would store at the contact's depth.
struct Energy {
  double most{}, last{}, most_of_probe{};
  int contacts{};
};

/// Lets the mass go and follows it. The spring and the reaction push back and forth, step by step (symplectic
/// Euler); the energy of a frame takes the mean of the velocities before and after it, with which that rule
/// keeps the energy of a spring to (omega step)^2 / 8, here 0.07 %. Energy held by bristles of friction is
/// not counted; it was drawn from what is.
inline Energy press(runtime::Scene& scene, const Press& how, const Vec3d& surface_m, const Vec3d& normal,
                    const Vec3d& aside) {
  const Vec3d handle_m = surface_m - how.below_m * normal;
  Vec3d p = surface_m + how.above_m * normal + how.aside_m * aside, v;
  const auto of_probe = [&](const Vec3d& velocity) {
    return 0.5 * how.mass_kg * dot(velocity, velocity) +
           0.5 * how.coupling_n_per_m * dot(handle_m - p, handle_m - p);
  };
  Energy result;
  double start = 0;
  for (int frame = 0; frame < how.frames; ++frame) {
    const runtime::FrameResult answer = scene.frame({{}, p}, p, static_cast<float>(how.step_s));
    const auto touching = scene.contacts(0);
    const Vec3d force_n = cast<double>(answer.wrench.force_n) + how.coupling_n_per_m * (handle_m - p) -
                          how.damping_n_s_per_m * v;
    const Vec3d after = v + (how.step_s / how.mass_kg) * force_n;
    const double depth_m = touching.empty() ? 0 : touching[0].depth_m;
    const double of_contact = 0.5 * how.stiffness_n_per_m * depth_m * depth_m;
    if (frame == 0) start = of_probe(v) + of_contact;
    const double probe = of_probe(frame == 0 ? v : 0.5 * (v + after));
    result.last = (probe + of_contact) / start;
    result.most = std::max(result.most, result.last);
    result.most_of_probe = std::max(result.most_of_probe, probe / start);
    result.contacts += touching.empty() ? 0 : 1;
    v = after;
    p = p + how.step_s * v;
  }
  return result;
}

/// A place on the surface that an object represents.
struct SurfacePlace {
  Vec3d point_m, normal;
};

/// Places where the map has an answer and the space above is free, from random points near the surface.
inline std::vector<SurfacePlace> surface_places(const runtime::Object& object, std::size_t count,
                                                double clearance_m, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  // Not std::uniform_real_distribution, whose numbers differ between standard libraries.
  const auto unit = [&random] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };
  const BoundingSphere& sphere = object.sphere();
  std::vector<SurfacePlace> places;
  constexpr int kTriesPerPlace = 2000;
  for (std::size_t tries = 0; places.size() < count && tries < count * kTriesPerPlace; ++tries) {
    const Vec3d p_m = sphere.centre_m + sphere.radius_m * Vec3d{unit(), unit(), unit()};
    const runtime::Answer answer = object.query(cast<float>(p_m), {runtime::Layer::kThree});
    if (!(answer.signed_distance_m * answer.signed_distance_m < clearance_m * clearance_m))
      continue;  // NaN: none
    const Vec3d on_m = cast<double>(answer.surface_m), n = cast<double>(answer.normal);
    if (!(dot(n, n) > 0.5)) continue;
    if (object.query(cast<float>(on_m + clearance_m * n), {runtime::Layer::kThree}).inside) continue;
    places.push_back({on_m, n});
  }
  return places;
}

/// Some unit vector across the normal.
inline Vec3d across(const Vec3d& normal) {
  const Vec3d other = std::abs(normal.z) < 0.7 ? Vec3d{0, 0, 1} : Vec3d{1, 0, 0};
  return normalized(cross(normal, other));
}

}  // namespace sqmap::test
