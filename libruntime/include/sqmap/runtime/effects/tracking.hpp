// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sqmap/runtime/effects/touches.hpp"

namespace sqmap::runtime {

/// Temporal coherence of the foot point: each contact keeps a proxy g on the surface, which follows the point
/// p in bounded steps instead of jumping to whatever surface is nearest now.
///
///     g <- g + clip(target - g, 2 |p_t - p_(t-1)| + catch_up)
///     depth <- |g - p|,   normal <- (g - p) / depth
///
/// The target is the contact's foot point where that faces the same way as the proxy, else the place on the
/// surface below which the point has moved (from g along its tangent plane). So, with the reaction's k,
///
///     |F_t - F_(t-1)| <= k (3 |p_t - p_(t-1)| + catch_up)
///
/// as long as a contact lasts. Without it the force jumps where the nearest surface changes sides (medial
/// axis), where charts of neighbouring parts disagree by a little, and where a chart knows that a point is
/// inside but not how deep (beside a seam): such contacts have depth 0 until the proxy gives them one.
///
/// Bias: where the proxy is not the nearest surface, the depth is larger than the distance; beyond `lose_m`
/// it makes for the nearest surface after all. A contact's first and last frame are not bounded. Sources:
/// Zilles and Salisbury 1995 (god-object); Ruspini et al. 1997, [26] of the paper (proxy); neither bounds the
/// step. No query for most contacts, up to three for the rest, together. Memory: 40 bytes a point of B.
class Tracking {
 public:
  static constexpr const char* kName = "tracking";

  float catch_up_m = 1e-4F;  ///< how far a proxy may move a frame when its point does not
  float lose_m = 1e-2F;      ///< how much deeper than the distance a proxy may be

  static std::span<const Parameter<Tracking>> parameters() noexcept;
  void prepare(std::size_t point_count);
  void touch(Touches& touches) noexcept;
  std::size_t memory_bytes() const noexcept { return proxies_.capacity() * sizeof(Proxy); }

 private:
  struct Proxy {
    Vec3f place_m, normal, point_m;
    std::uint32_t frame{};
  };
  void touch_some(const Field& field, std::span<Contact> contacts) noexcept;
  /// Whether the proxy is lost, as it becomes where it is much deeper than the contact.
  bool lose_far(const Contact& contact, Proxy& proxy) const noexcept;
  /// Moves the proxy towards its target.
  void follow(const Contact& contact, const Vec3f& target_m, const Vec3f& target_normal,
              Proxy& proxy) const noexcept;

  std::vector<Proxy> proxies_;  ///< one a point of B
  std::uint32_t frame_ = 1;
};

}  // namespace sqmap::runtime
