// SPDX-License-Identifier: Apache-2.0
//
// Questions asked on every instruction set of this processor.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sqmap/runtime/object.hpp"

namespace sqmap::test {

inline constexpr std::array<runtime::SimdTarget, 4> kTargets{
    runtime::SimdTarget::kBaseline, runtime::SimdTarget::kSse4, runtime::SimdTarget::kAvx2,
    runtime::SimdTarget::kAvx512};

/// Sets each instruction set that this processor has, one after the other, and the one before at the end.
/// @return how many there are; Targets.AreThoseOfTheProcessor says how many there must be
template <class Run>
int for_each_target(const Run& run) {
  const runtime::SimdTarget before = runtime::simd_target();
  int count = 0;
  for (const runtime::SimdTarget target : kTargets) {
    if (!runtime::set_simd_target(target)) continue;
    run(target);
    ++count;
  }
  runtime::set_simd_target(before);
  return count;
}

/// Answers of the batch in use.
struct Batch {
  explicit Batch(std::size_t count)
      : distance_m(count), normal(count), surface_m(count), part(count), layer(count), inside(count) {}
  runtime::Answers answers() { return {distance_m, normal, surface_m, part, layer, inside}; }
  /// Equal to the last bit but for the sign of zero; any NaN equals any.
  bool holds(std::size_t i, const runtime::Answer& one) const {
    return (distance_m[i] == one.signed_distance_m ||
            (std::isnan(distance_m[i]) && std::isnan(one.signed_distance_m))) &&
           normal[i] == one.normal && surface_m[i] == one.surface_m && part[i] == one.part &&
           layer[i] == static_cast<std::uint8_t>(one.layer) && (inside[i] != 0) == one.inside;
  }
  std::vector<float> distance_m;
  std::vector<Vec3f> normal, surface_m;
  std::vector<std::uint32_t> part;
  std::vector<std::uint8_t> layer, inside;
};

/// Whether every instruction set answers the points as they are answered one at a time, to the last bit: what
/// holds of those answers then holds of all. `Asked` is an Object or an Instance.
template <class Asked>
bool every_target_agrees(const Asked& asked, std::span<const Vec3f> points,
                         const runtime::QueryOptions& options) {
  std::vector<runtime::Answer> alone;
  for (const Vec3f& p : points) alone.push_back(asked.query(p, options));
  Batch batch(points.size());
  bool is_same = true;
  for_each_target([&](runtime::SimdTarget) {
    asked.query(points, batch.answers(), options);
    for (std::size_t i = 0; i < points.size(); ++i) is_same = is_same && batch.holds(i, alone[i]);
  });
  return is_same;
}

}  // namespace sqmap::test
