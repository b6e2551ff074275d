// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "sqmap/asset/vec.hpp"

#include "scene_file.hpp"

namespace sqmap::apps {

/// Where the keyframes put the handle: straight lines between positions, great arcs between orientations; the
/// first before and the last after them.
Pose pose_at(std::span<const Keyframe> keyframes, double time_s);

/// A probe on a spring and damper between it and the handle. Semi-implicit steps, damping implicit, so that
/// the coupling alone is stable for any damping.
class CoupledProbe {
 public:
  CoupledProbe(const Coupling& coupling, const Pose& start) : coupling_(coupling), pose_(start) {}

  const Pose& pose() const noexcept { return pose_; }
  /// One step under the force and torque (about the probe's origin) of the contacts.
  void step(const Pose& handle, const Vec3d& force_n, const Vec3d& torque_nm, double step_s) noexcept;

 private:
  Coupling coupling_;
  Pose pose_;
  Vec3d velocity_m_per_s_, turn_rad_per_s_;
};

}  // namespace sqmap::apps
