// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sqmap/runtime/effects/touches.hpp"

namespace sqmap::runtime {

/// Passivity control: an object gives back no more energy than was put into it. The forces of a distance map
/// are the gradient of nothing: where depth or normal jump (edges of charts, the medial axis) a probe that
/// goes in one way and out another is handed energy each round. An observer keeps the account, a controller
/// scales the forces on the way out, all by one share s:
///
///     E <- E - sum 1/2 (s F_i + s' F'_i) (p_i - p'_i)          ': the frame before
///     V  = sum 1/2 max(0, F_i n_i) depth_i                     what springs of these forces hold
///     E <- min(E, V + reserve V_most)                          V_most: largest V, this contact or the last
///     s -> 1                        on the way in: sum F_i (p_i - p'_i) <= 0
///     s -> min(1, E / (0.9 V))      on the way out
///
/// E is what was put in and not yet given back. s stays within [0, 1], so force is taken away and never
/// added; it moves towards its goal by as much as 4 times the way over the depth, not with time, so that the
/// force is continuous and rests when the probe does. On the way out it is also no more than what E affords
/// for another step like the last. While a contact is passive s is 1 and its forces stay as they are to the
/// bit, but for some of the frames in which it ends: a force held while the point leaves gives more than a
/// spring has left.
///
/// Work is that of the mean of the forces before and after a step: exact for a spring and for the usual
/// (symplectic) integration of a mass. What a device's hold adds to a sampled spring, up to k |p - p'|^2 / 2
/// a frame, belongs to the device and its damping (Colgate and Schenkel 1997). A point that comes into
/// contact or leaves moves with BodyState's points or pose; one that is inside in the first frame counts as
/// pressed in. A debt greater than V_most is forgiven: a probe put elsewhere in one frame has not been pushed
/// there. Limits named after it are not seen; a SlewLimit lags and can give energy of its own. Sources:
/// Hannaford and Ryu 2002; Ryu et al. 2005 for the stored energy as the reference; scaling in place of
/// damping, whose sign needs a clean velocity. Memory: 40 bytes a point of B.
class Passivity {
 public:
  static constexpr const char* kName = "passivity";

  float reserve = 1;  ///< of what a contact dissipated, how much it may give back later, in V_most [-]

  static std::span<const Parameter<Passivity>> parameters() noexcept;
  void prepare(std::size_t point_count);
  void touch(Touches& touches) noexcept;
  std::size_t memory_bytes() const noexcept {
    return pushes_.capacity() * sizeof(Push) + last_m_.capacity() * sizeof(Vec3f);
  }

  double energy_j() const noexcept { return energy_j_; }  ///< E
  double share() const noexcept { return share_; }        ///< s of the last frame, 1: nothing taken away

 private:
  struct Push {
    Vec3f force_n, position_m;
    std::uint32_t point{};
  };
  /// What the frame's forces are, before any is taken away.
  struct Sums {
    double work_j{};    ///< of the step that led here, by the forces of this frame alone
    double stored_j{};  ///< V
    double found_j{};   ///< of it, what points hold of which no way is known
  };
  struct Motion;

  Sums sums(const Touches& touches, const Motion& motion) const noexcept;
  double work_of_last_j(const BodyState& body, const Motion& motion) const noexcept;
  double share_for(const Sums& now) const noexcept;
  void remember(const Touches& touches) noexcept;

  std::vector<Push> pushes_;   ///< of the last frame, room for all points
  std::vector<Vec3f> last_m_;  ///< points of the last frame, NaN: unknown; unused with a PointBody
  std::size_t push_count_ = 0;
  Placement last_at_;
  bool has_last_at_ = false;
  double energy_j_ = 0, share_ = 1;
  double most_j_ = 0, most_before_j_ = 0;  ///< V_most of this contact and the one before
};

}  // namespace sqmap::runtime
