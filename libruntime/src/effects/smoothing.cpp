// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/effects/smoothing.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>

namespace sqmap::runtime {

namespace {

constexpr Vec3f kDirections[] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
constexpr std::size_t kNeighbours = std::size(kDirections);
constexpr std::size_t kTogether = 64;  ///< contacts whose neighbours are asked for in one batch, on the stack

}  // namespace

std::span<const Parameter<Smoothing>> Smoothing::parameters() noexcept {
  static constexpr Parameter<Smoothing> kTable[] = {{"radius_m", &Smoothing::radius_m, 0, 1e3F}};
  return kTable;
}

void Smoothing::touch(Touches& touches) noexcept {
  const float h = radius_m;
  if (!(h > 0)) return;  // no neighbours
  std::array<Vec3f, kNeighbours * kTogether> places_m, normals;
  std::array<float, kNeighbours * kTogether> distances_m;
  std::array<Contact*, kTogether> owners;
  std::size_t owner_count = 0;

  const auto smooth = [&](Contact& contact, std::size_t first) {
    float sum_m = contact.depth_m;
    Vec3f sum = contact.normal, gradient;
    for (std::size_t k = 0; k < kNeighbours; ++k) {
      const float distance_m = distances_m[first + k];
      const bool is_known = std::isfinite(distance_m);
      const float depth_m = is_known ? std::clamp(-distance_m, contact.depth_m - h, contact.depth_m + h)
                                     : contact.depth_m - h * dot(kDirections[k], contact.normal);
      sum_m += depth_m;
      gradient = gradient - (depth_m / (2 * h)) * kDirections[k];
      sum = sum + (is_known ? normals[first + k] : contact.normal);
    }
    contact.depth_m = std::max(sum_m / (kNeighbours + 1), 0.0F);
    const Vec3f unit =
        normalized(gradient + (std::max(0.0F, 1 - 2 * norm(gradient)) / (kNeighbours + 1)) * sum);
    if (dot(unit, unit) > 0) contact.normal = unit;  // all cancels: keep the contact's own
    contact.surface_m = contact.position_m + contact.depth_m * contact.normal;
  };
  const auto smooth_all = [&] {
    const std::size_t count = std::exchange(owner_count, 0);
    Answers answers;
    answers.signed_distance_m = std::span(distances_m).first(kNeighbours * count);
    answers.normal = std::span(normals).first(kNeighbours * count);
    touches.field.instance->query(std::span(places_m).first(kNeighbours * count), answers,
                                  touches.field.options);
    for (std::size_t i = 0; i < count; ++i) smooth(*owners[i], kNeighbours * i);
  };

  for (Contact& contact : touches.contacts) {
    if (!(contact.depth_m > 0)) continue;
    for (std::size_t k = 0; k < kNeighbours; ++k)
      places_m[kNeighbours * owner_count + k] = contact.position_m + h * kDirections[k];
    owners[owner_count++] = &contact;
    if (owner_count == kTogether) smooth_all();
  }
  if (owner_count > 0) smooth_all();
}

}  // namespace sqmap::runtime
