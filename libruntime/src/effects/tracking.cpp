// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/effects/tracking.hpp"

#include <cmath>

namespace sqmap::runtime {
namespace {

/// A place on the surface and its outward normal.
struct Place {
  Vec3f point_m, normal;
};

/// The surface under the point p, seen from a proxy at g: along the tangent plane, then to a surface known
/// there that faces the same way; else the plane itself. A chart that knows nothing deep below a crease may
/// know more towards the outside.
Place beside(const Field& field, const Vec3f& p_m, const Vec3f& g_m, const Vec3f& normal) noexcept {
  const Vec3f on_plane_m = p_m - dot(p_m - g_m, normal) * normal;
  const float depth_m = norm(g_m - p_m);
  for (const float above : {0.0F, 0.5F, 1.0F}) {
    const Answer answer = field.instance->query(on_plane_m + (above * depth_m) * normal, field.options);
    if (std::isfinite(answer.signed_distance_m) && dot(answer.normal, normal) > 0)
      return {answer.surface_m, answer.normal};
  }
  return {on_plane_m, normal};
}

}  // namespace

std::span<const Parameter<Tracking>> Tracking::parameters() noexcept {
  static constexpr Parameter<Tracking> kTable[] = {{"catch_up_m", &Tracking::catch_up_m, 0, 1e3F},
                                                   {"lose_m", &Tracking::lose_m, 0, 1e6F}};
  return kTable;
}

void Tracking::prepare(std::size_t point_count) { proxies_.assign(point_count, {}); }

void Tracking::follow(const Field& field, const Contact& contact, Proxy& proxy) const noexcept {
  const Vec3f& p_m = contact.position_m;
  // A proxy that is lost has no normal until it has arrived at the nearest surface.
  if (contact.depth_m > 0 && norm(proxy.place_m - p_m) > contact.depth_m + lose_m) proxy.normal = {};
  const bool is_lost = proxy.normal == Vec3f{};
  Place target{contact.surface_m, contact.normal};
  if (is_lost && !(contact.depth_m > 0)) {
    target = {proxy.place_m, proxy.normal};
  } else if (!is_lost && !(dot(contact.normal, proxy.normal) > 0)) {
    target = beside(field, p_m, proxy.place_m, proxy.normal);
  }
  const Vec3f way_m = target.point_m - proxy.place_m;
  const float length_m = norm(way_m), most_m = 2 * norm(p_m - proxy.point_m) + catch_up_m;
  if (length_m <= most_m) {
    proxy.place_m = target.point_m;
    proxy.normal = target.normal;
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
  for (Contact& contact : touches.contacts) {
    Proxy& proxy = proxies_[contact.point];
    const bool is_known = proxy.frame + 1 == frame_;
    if (!is_known && !(contact.depth_m > 0)) continue;
    if (is_known) follow(touches.field, contact, proxy);
    // New, or led astray by numbers that are not finite.
    if (!is_known || !std::isfinite(norm(proxy.place_m - contact.position_m)))
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
