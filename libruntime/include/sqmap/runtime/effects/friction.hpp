// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sqmap/runtime/effects/touches.hpp"

namespace sqmap::runtime {

/// Friction, paper eq. (33), with a bristle in place of the direction of motion. Each contact stretches a
/// spring z along the surface, which slips where it would pull harder than the paper's magnitude:
///
///     z <- project(z + p_t - p_(t-1), n)                        per contact
///     z <- z min(1, f_C (1 + k_f depth) / (k_z |z|))            slip
///     F += -k_z z,                          f_C = coefficient * |normal force|
///
/// Eq. (33) divides by |p_t - p_(t-1)|, which is 0/0 at rest and full force in a random direction under
/// sensor noise. A smooth Coulomb law, tanh(v / v_0), would cure that but creeps under a constant load and
/// needs a speed; the bristle holds still, depends on the path alone (not on the rate of the loop), and is
/// passive: a spring that only loses energy when it slips or turns with the surface. The paper's f_C is a
/// constant force, present at depth zero; as a share of the normal force it starts and ends with the contact.
///
/// Needs a normal force before it in the model. Displacements are in A's frame, so a moving A drags B along.
/// Sources: Moustakas et al. 2007 (33); Hayward and Armstrong 2000 for the time-free bristle.
/// Memory: 28 bytes a point of B.
class Friction {
 public:
  static constexpr const char* kName = "friction";

  float coefficient = 0.4F;      ///< mu [-]
  float depth_gain_per_m = 0;    ///< k_f of (33) [1/m]
  float bristle_n_per_m = 1000;  ///< k_z: how stiffly a resting contact is held [N/m]

  static std::span<const Parameter<Friction>> parameters() noexcept;
  void prepare(std::size_t point_count);
  void touch(Touches& touches) noexcept;
  std::size_t memory_bytes() const noexcept { return bristles_.capacity() * sizeof(Bristle); }

 private:
  struct Bristle {
    Vec3f stretch_m, position_m;
    std::uint32_t frame{};  ///< in which it was last stretched
  };
  std::vector<Bristle> bristles_;  ///< one a point of B
  std::uint32_t frame_ = 1;
};

}  // namespace sqmap::runtime
