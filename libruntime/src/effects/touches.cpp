// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/effects/touches.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "sqmap/runtime/contacts.hpp"

namespace sqmap::runtime {
namespace {

bool is_finite(const Vec3f& v) noexcept {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

bool is_finite(const Placement& placement) noexcept {
  const Quaternion& q = placement.world_from_object.orientation;
  const Vec3d& t_m = placement.world_from_object.translation_m;
  return std::isfinite(q.w + q.x + q.y + q.z + placement.scale) && std::isfinite(t_m.x + t_m.y + t_m.z);
}

/// Shortest decimal text of a float that a message needs.
std::string text_of(float value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", static_cast<double>(value));
  return text;
}

}  // namespace

Found find_touches(const Field& field, const BodyState& body, std::span<Contact> room) noexcept {
  Found found;
  if (body.body == nullptr) {
    for (const Vec3f& p : body.points_m) found.is_finite = found.is_finite && is_finite(p);
    found.count = all_contacts(*field.instance, body.points_m, room, field.options).written;
    return found;
  }
  found.is_finite = is_finite(body.at);
  if (!found.is_finite) return found;
  const ContactQuery query{field.options};
  const std::size_t count = body.budget != nullptr
                                ? field.instance->contacts(*body.body, body.at, room, query, *body.budget)
                                : field.instance->contacts(*body.body, body.at, room, query);
  found.count = std::min(count, room.size());
  return found;
}

Wrench total(const Touches& touches) noexcept {
  Wrench wrench;
  for (const Vec3f& force_n : touches.force_n) wrench.force_n = wrench.force_n + force_n;
  wrench.contacts = static_cast<std::uint32_t>(touches.contacts.size());
  return finite_or_zero(wrench);
}

Wrench finite_or_zero(const Wrench& wrench) noexcept {
  if (wrench.is_finite && is_finite(wrench.force_n) && is_finite(wrench.torque_nm)) return wrench;
  return {{}, {}, false, wrench.contacts};
}

Outcome check_range(const char* effect, const char* name, float value, float least, float most,
                    bool is_whole) {
  const bool ok =
      value >= least && value <= most && (!is_whole || value == std::floor(value));  // NaN: not ok
  if (ok) return Done{};
  return Error{Status::kBadOption,
               std::string(effect) + "." + name + " = " + text_of(value) + ", must be " +
                   (is_whole ? "a whole number " : "") + "in [" + text_of(least) + ", " + text_of(most) + "]",
               "choose a value in that range"};
}

}  // namespace sqmap::runtime
