// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sqmap/asset/asset.hpp"
#include "sqmap/asset/result.hpp"
#include "sqmap/runtime/contact.hpp"
#include "sqmap/runtime/instance.hpp"

namespace sqmap::runtime {

/// Error of a map's distances that is assumed where the bundle declares none, as a share of R_max: above the
/// 95th percentile that bundles of default bakes declare for level 0 and layer 3.
inline constexpr double kUndeclaredError = 5e-3;
/// Default of SweepOptions::tolerance_m as a share of R_max.
inline constexpr double kSweepTolerance = 1e-3;

struct SweepOptions {
  /// How to look along the path. Layer 3 by default: the distance of layer 2 runs along a ray, is longer than
  /// that to the surface, and its steps may pass through a thin wall. Layer 1: contact with the
  /// superquadrics.
  QueryOptions query{.layer = Layer::kThree};
  /// The point is in contact once it approaches a surface this near [m, world]; 0: kSweepTolerance of R_max.
  float tolerance_m = 0;
  /// What a distance of the map may be too long by [m, world]; negative: what the bundle declares for the
  /// level and layer (95th percentile), or kUndeclaredError of R_max.
  float error_m = -1;
  std::uint32_t max_steps = 256;
};

enum class SweepStatus : std::uint8_t {
  kInvalid = 0,     ///< input that is not finite, or instances that do not belong to the sweep
  kClear = 1,       ///< no contact between times 0 and 1
  kContact = 2,     ///< contact at `time`
  kUnresolved = 3,  ///< out of steps: clear up to `time`, unknown beyond; a caller may stop the point there
};

struct SweepResult {
  SweepStatus status = SweepStatus::kInvalid;
  bool starts_in_contact = false;  ///< contact at time 0
  std::uint16_t steps{};           ///< places of the path that were looked at
  float time{};                    ///< [0, 1]; 1 where clear, 0 where invalid
  Contact contact;                 ///< at `time`, world frame; all zero where there is none. depth_m is 0
                                   ///< but for a point that starts inside, or by what bisection leaves
};

/// Motion of one point, world frame [m]: along the straight line, at constant speed.
struct PointMotion {
  Vec3f from_m, to_m;
};

/// Continuous collision of moving points with a (moving) instance, so that none passes through a wall between
/// two frames. Built once for each asset by those who sweep: the superquadrics of its parts in double, 200
/// bytes a part. Immutable, any number of threads may use one.
///
/// The object moves from one placement to another at constant velocity of its origin and constant angular
/// velocity, by the shorter way round. A sweep advances by steps within which there can be no contact:
///
///  - Outside a superquadric the step is proven. beta (FORMAT.md S1) is convex: the plane
///    through the point's image x on the surface, normal to n = grad beta(p), has the whole superquadric, and
///    all material that its map represents, behind it, at distance h = (beta - 1) / |grad beta| from p. With
///    a bound A on the acceleration of the point in the object's frame it cannot get there before dt, with
///    h + (n . v) dt - A dt^2 / 2 = 0. For an object that does not turn this is Newton's method on a convex
///    function, which never overshoots. Of a bent superquadric the plane stands in its straight frame, and
///    the step is what that leaves in every direction: steps towards one are shorter.
///  - Inside, the step is the answered distance less the error that the bundle declares. That error is
///    measured, not a bound: this step is as good as the map. Where the map knows no distance, steps are
///    kBlindStep of the least semi-axis there, and walls thinner than this may be passed.
///
/// Every look also asks for the side: a point found inside after such a step is traced back by bisection.
class Sweeper {
 public:
  /// Allocates; sweeps never do. Errors: kInvalidAsset as Object::build.
  static Result<Sweeper> build(const Asset& asset);

  /// The point against an instance that moves from `start` to `end`: two placements of one object, of the
  /// same scale and mirror, built from the same asset as this. Bounded time, no allocation.
  SweepResult sweep(const Instance& start, const Instance& end, const PointMotion& motion,
                    const SweepOptions& options = {}) const noexcept;
  /// The point against an instance that rests.
  SweepResult sweep(const Instance& instance, const PointMotion& motion,
                    const SweepOptions& options = {}) const noexcept {
    return sweep(instance, instance, motion, options);
  }
  /// Many points. results is as long as motions; contact.point is the index in the batch. Same answers as one
  /// at a time.
  void sweep(const Instance& start, const Instance& end, std::span<const PointMotion> motions,
             std::span<SweepResult> results, const SweepOptions& options = {}) const noexcept;

  /// What error_m < 0 stands for, object frame [m].
  double declared_error_m(const QueryOptions& options) const noexcept;
  std::size_t resident_bytes() const noexcept;

 private:
  friend class SweepRun;
  /// One superquadric, in its straight frame a convex body.
  struct Body {
    Superquadric shape;
    Rotation<double> object_from_part;
    Vec3d translation_m;
    BoundingSphere sphere;
    double skin{};  ///< width, in beta, around the surface in which float cannot tell the side
  };
  struct Declared {
    std::uint32_t level, layer;
    double error_m;
  };

  Sweeper() = default;

  BoundingSphere sphere_;
  double r_max_m_{};
  std::vector<Body> bodies_;
  std::vector<Declared> declared_;
};

/// Step where the map knows no distance, as a share of the least semi-axis of the superquadrics around.
inline constexpr double kBlindStep = 1.0 / 16;

}  // namespace sqmap::runtime
