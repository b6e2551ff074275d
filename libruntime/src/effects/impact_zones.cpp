// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/effects/impact_zones.hpp"

#include <algorithm>

namespace sqmap::runtime {

std::span<const Parameter<ImpactZones>> ImpactZones::parameters() noexcept {
  static constexpr Parameter<ImpactZones> kTable[] = {{"by_depth", &ImpactZones::by_depth, 0, 1, true}};
  return kTable;
}

void ImpactZones::set_zones(std::span<const std::uint32_t> zone_of_point) {
  zone_of_point_.assign(zone_of_point.begin(), zone_of_point.end());
}

void ImpactZones::prepare(std::size_t point_count) {
  std::uint32_t last = 0;
  if (!zone_of_point_.empty()) {
    zone_of_point_.resize(point_count, 0);
    for (const std::uint32_t zone : zone_of_point_) last = std::max(last, zone);
  }
  sum_.assign(std::size_t{last} + 1, 0);
}

void ImpactZones::touch(Touches& touches) noexcept {
  const auto zone_of = [&](const Contact& contact) -> std::size_t {
    return zone_of_point_.empty() ? 0 : zone_of_point_[contact.point];
  };
  const auto share_of = [&](const Contact& contact) {
    const float weight_m2 = touches.body.weight_m2.empty() ? 1 : touches.body.weight_m2[contact.point];
    return weight_m2 * (by_depth > 0 ? contact.depth_m : contact.depth_m > 0 ? 1.0F : 0.0F);
  };
  // Only zones that are touched: a hand has few contacts and many zones.
  for (const Contact& contact : touches.contacts) sum_[zone_of(contact)] = 0;
  for (const Contact& contact : touches.contacts) sum_[zone_of(contact)] += share_of(contact);
  for (std::size_t i = 0; i < touches.contacts.size(); ++i) {
    const float sum = sum_[zone_of(touches.contacts[i])];
    const float share = sum > 0 ? share_of(touches.contacts[i]) / sum : 0;
    touches.force_n[i] = share * touches.force_n[i];
  }
}

}  // namespace sqmap::runtime
