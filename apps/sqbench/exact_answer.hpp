// SPDX-License-Identifier: GPL-3.0-or-later
//
// What the peers that know the nearest triangle share.
#pragma once

#include <algorithm>
#include <cstddef>

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
  /// Calls `answer(index, placed point)` for the points in the box. Blocks whose sphere misses it are left
  /// out whole; `may_hold(centre, radius)` is asked of those that have a point in it.
  template <class MayHold, class Answer>
  void for_each(const Cloud& cloud, const Placement& placement, const MayHold& may_hold,
                const Answer& answer) const {
    for (std::size_t block = 0; block < cloud.block_count; ++block) {
      const Vec3f centre_m =
          placement.apply({cloud.block_x_m[block], cloud.block_y_m[block], cloud.block_z_m[block]});
      const float radius_m = cloud.block_radius_m[block];
      if (!reaches(centre_m, radius_m)) continue;
      bool is_asked = false;
      for (std::size_t i = block * kBlock; i < std::min((block + 1) * kBlock, cloud.count); ++i) {
        const Vec3f p_m = placement.apply(cloud.points_m[i]);
        if (!holds(p_m)) continue;
        if (!is_asked && !may_hold(centre_m, radius_m)) break;
        is_asked = true;
        answer(i, p_m);
      }
    }
  }
  template <class Answer>
  void for_each(const Cloud& cloud, const Placement& placement, const Answer& answer) const {
    for_each(
        cloud, placement, [](const Vec3f&, float) { return true; }, answer);
  }

 private:
  bool reaches(const Vec3f& centre_m, float radius_m) const noexcept {
    Vec3f off_m;
    for (int axis = 0; axis < 3; ++axis)
      off_m[axis] = std::max({0.0F, low_m_[axis] - centre_m[axis], centre_m[axis] - high_m_[axis]});
    return dot(off_m, off_m) <= radius_m * radius_m;
  }

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
