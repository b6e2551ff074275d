// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/effects/touches.hpp"

#include <cmath>
#include <cstdio>
#include <string>

#include "sqmap/runtime/contacts.hpp"

namespace sqmap::runtime {
namespace {

bool is_finite(const Vec3f& v) noexcept {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// Shortest decimal text of a float that a message needs.
std::string text_of(float value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", static_cast<double>(value));
  return text;
}

}  // namespace

Found find_touches(const Field& field, std::span<const Vec3f> points_m, std::span<Contact> room) noexcept {
  Found found;
  for (const Vec3f& p : points_m) found.is_finite = found.is_finite && is_finite(p);
  found.count = all_contacts(*field.instance, points_m, room, field.options).written;
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
