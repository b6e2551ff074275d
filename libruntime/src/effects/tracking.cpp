// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/effects/tracking.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

namespace sqmap::runtime {
namespace {

/// Contacts whose questions reach the object together: 3 KB of stack.
constexpr std::size_t kTogether = 64;

/// A place on the surface and its outward normal.
struct Place {
  Vec3f point_m, normal;
};

/// Looks for the surface under points, seen from their proxies: along the tangent plane, then to a surface
/// known there that faces the same way; else the plane itself. A chart that knows nothing deep below a crease
/// may know more towards the outside.
class Besides {
 public:
  /// The point p with its proxy at g; `target` will be what is found.
  void add(const Vec3f& p_m, const Vec3f& g_m, const Vec3f& normal, Place& target) noexcept {
    target = {p_m - dot(p_m - g_m, normal) * normal, normal};
    target_[count_] = &target;
    depth_m_[count_++] = norm(g_m - p_m);
  }
  void find(const Field& field) noexcept {
    for (const float above : {0.0F, 0.5F, 1.0F}) {
      if (count_ == 0) return;
      for (std::size_t k = 0; k < count_; ++k)
        ask_m_[k] = target_[k]->point_m + (above * depth_m_[k]) * target_[k]->normal;
      field.instance->query(std::span(ask_m_).first(count_),
                            {.signed_distance_m = std::span(distance_m_).first(count_),
                             .normal = std::span(normal_).first(count_),
                             .surface_m = std::span(surface_m_).first(count_)},
                            field.options);
      std::size_t left = 0;
      for (std::size_t k = 0; k < count_; ++k) {
        if (std::isfinite(distance_m_[k]) && dot(normal_[k], target_[k]->normal) > 0) {
          *target_[k] = {surface_m_[k], normal_[k]};
        } else {
          target_[left] = target_[k];
          depth_m_[left++] = depth_m_[k];
        }
      }
      count_ = left;
    }
  }

 private:
  std::size_t count_ = 0;
  std::array<Place*, kTogether> target_;
  std::array<float, kTogether> depth_m_, distance_m_;
  std::array<Vec3f, kTogether> ask_m_, normal_, surface_m_;
};

}  // namespace

std::span<const Parameter<Tracking>> Tracking::parameters() noexcept {
  static constexpr Parameter<Tracking> kTable[] = {{"catch_up_m", &Tracking::catch_up_m, 0, 1e3F},
                                                   {"lose_m", &Tracking::lose_m, 0, 1e6F}};
  return kTable;
}

void Tracking::prepare(std::size_t point_count) { proxies_.assign(point_count, {}); }

bool Tracking::lose_far(const Contact& contact, Proxy& proxy) const noexcept {
  // A proxy that is lost has no normal until it has arrived at the nearest surface.
  if (contact.depth_m > 0 && norm(proxy.place_m - contact.position_m) > contact.depth_m + lose_m)
    proxy.normal = {};
  return proxy.normal == Vec3f{};
}

void Tracking::follow(const Contact& contact, const Vec3f& target_m, const Vec3f& target_normal,
                      Proxy& proxy) const noexcept {
  const Vec3f& p_m = contact.position_m;
  const Vec3f way_m = target_m - proxy.place_m;
  const float length_m = norm(way_m), most_m = 2 * norm(p_m - proxy.point_m) + catch_up_m;
  if (length_m <= most_m) {
    proxy.place_m = target_m;
    proxy.normal = target_normal;
  } else {
    proxy.place_m = proxy.place_m + (most_m / length_m) * way_m;
    // On its way the proxy faces as it pushes.
    if (const Vec3f out = normalized(proxy.place_m - p_m); dot(out, proxy.normal) > 0) proxy.normal = out;
  }
  // A plane that the point has crossed must not pull it in.
  if (dot(proxy.place_m - p_m, proxy.normal) < 0) proxy.place_m = p_m;
}

void Tracking::touch(Touches& touches) noexcept {
  ++frame_;
  for (std::size_t first = 0; first < touches.contacts.size(); first += kTogether)
    touch_some(touches.field,
               touches.contacts.subspan(first, std::min(kTogether, touches.contacts.size() - first)));
}

void Tracking::touch_some(const Field& field, std::span<Contact> contacts) noexcept {
  const auto is_known = [&](const Proxy& proxy) { return proxy.frame + 1 == frame_; };
  std::array<Place, kTogether> target;
  Besides besides;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const Contact& contact = contacts[i];
    Proxy& proxy = proxies_[contact.point];
    if (!is_known(proxy)) continue;
    target[i] = {contact.surface_m, contact.normal};
    const bool is_lost = lose_far(contact, proxy);
    if (is_lost && !(contact.depth_m > 0)) {
      target[i] = {proxy.place_m, proxy.normal};
    } else if (!is_lost && !(dot(contact.normal, proxy.normal) > 0)) {
      besides.add(contact.position_m, proxy.place_m, proxy.normal, target[i]);
    }
  }
  besides.find(field);
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    Contact& contact = contacts[i];
    Proxy& proxy = proxies_[contact.point];
    const bool was_known = is_known(proxy);
    if (!was_known && !(contact.depth_m > 0)) continue;
    if (was_known) follow(contact, target[i].point_m, target[i].normal, proxy);
    // New, or led astray by numbers that are not finite.
    if (!was_known || !std::isfinite(norm(proxy.place_m - contact.position_m)))
      proxy = {contact.surface_m, contact.normal, {}, 0};
    proxy.point_m = contact.position_m;
    proxy.frame = frame_;
    const Vec3f out_m = proxy.place_m - contact.position_m;
    const float depth_m = norm(out_m);
    contact.depth_m = depth_m;
    if (depth_m > 0) contact.normal = (1 / depth_m) * out_m;
    contact.surface_m = proxy.place_m;
  }
}

}  // namespace sqmap::runtime
