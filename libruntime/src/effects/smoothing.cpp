// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/effects/smoothing.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>

namespace sqmap::runtime {

std::span<const Parameter<Smoothing>> Smoothing::parameters() noexcept {
  static constexpr Parameter<Smoothing> kTable[] = {{"radius_m", &Smoothing::radius_m, 0, 1e3F}};
  return kTable;
}

namespace {

constexpr std::size_t kNeighbours = 6;
constexpr std::size_t kTogether = 64;  ///< contacts whose neighbours are asked for in one batch, on the stack

}  // namespace

void Smoothing::touch(Touches& touches) noexcept {
  const float h = radius_m;
  const Vec3f steps_m[kNeighbours] = {{h, 0, 0}, {-h, 0, 0}, {0, h, 0}, {0, -h, 0}, {0, 0, h}, {0, 0, -h}};
  std::array<Vec3f, kNeighbours * kTogether> places_m, normals;
  std::array<float, kNeighbours * kTogether> distances_m;
  std::array<Contact*, kTogether> owners;
  std::size_t owner_count = 0;

  const auto smooth = [&] {
    const std::size_t count = kNeighbours * std::exchange(owner_count, 0);
    Answers answers;
    answers.signed_distance_m = std::span(distances_m).first(count);
    answers.normal = std::span(normals).first(count);
    touches.field.instance->query(std::span(places_m).first(count), answers, touches.field.options);
    for (std::size_t first = 0; first < count; first += kNeighbours) {
      Contact& contact = *owners[first / kNeighbours];
      float depth_m = contact.depth_m;
      Vec3f normal = contact.normal;
      for (std::size_t i = first; i < first + kNeighbours; ++i) {
        const bool is_known = std::isfinite(distances_m[i]);
        depth_m += is_known ? -distances_m[i] : contact.depth_m;
        normal = normal + (is_known ? normals[i] : contact.normal);
      }
      contact.depth_m = std::max(depth_m / (kNeighbours + 1), 0.0F);
      const Vec3f unit = normalized(normal);
      if (dot(unit, unit) > 0) contact.normal = unit;  // normals that cancel: keep the contact's own
      contact.surface_m = contact.position_m + contact.depth_m * contact.normal;
    }
  };

  for (Contact& contact : touches.contacts) {
    if (!(contact.depth_m > 0)) continue;
    for (std::size_t k = 0; k < kNeighbours; ++k)
      places_m[kNeighbours * owner_count + k] = contact.position_m + steps_m[k];
    owners[owner_count++] = &contact;
    if (owner_count == kTogether) smooth();
  }
  if (owner_count > 0) smooth();
}

}  // namespace sqmap::runtime
