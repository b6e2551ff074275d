// SPDX-License-Identifier: GPL-3.0-or-later
//
// What the peers that know the nearest triangle share.
#pragma once

#include "cloud.hpp"
#include "model.hpp"
#include "peer.hpp"

namespace sqmap::bench {

/// A mean: where a mesh crosses itself the pseudonormal tells the wrong side of a few points.
inline constexpr StatedError kExactError{1e-3, true};

/// The box of the object, grown by the band.
class NearBox {
 public:
  explicit NearBox(const Model& model) {
    const double band_m = kBand * model.r_max_m() * 1.0001;
    low_m_ = cast<float>(model.low_m - band_m * Vec3d{1, 1, 1});
    high_m_ = cast<float>(model.high_m + band_m * Vec3d{1, 1, 1});
  }
  bool holds(const Vec3f& p) const noexcept {
    return p.x >= low_m_.x && p.x <= high_m_.x && p.y >= low_m_.y && p.y <= high_m_.y && p.z >= low_m_.z &&
           p.z <= high_m_.z;
  }

 private:
  Vec3f low_m_, high_m_;
};

/// Adds the point with the sign that the pseudonormal of the nearest feature gives it.
inline void add_exact(std::size_t index, const Vec3d& p_m, const Vec3d& nearest_m, const Vec3d& pseudonormal,
                      Hits& hits) noexcept {
  const Vec3d away = p_m - nearest_m;
  const double distance_m = norm(away);
  const bool is_inside = dot(away, pseudonormal) < 0;
  // On the surface `away` has no direction.
  const Vec3d normal = distance_m > 0 ? ((is_inside ? -1 : 1) / distance_m) * away : normalized(pseudonormal);
  hits.add(index, static_cast<float>(is_inside ? -distance_m : distance_m), cast<float>(normal));
}

}  // namespace sqmap::bench
