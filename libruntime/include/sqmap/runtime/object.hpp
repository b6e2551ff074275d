// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>

#include "sqmap/asset/asset.hpp"
#include "sqmap/asset/result.hpp"

namespace sqmap::runtime {

/// How closely to look. Each layer builds on the one before (paper section 4.2).
enum class Layer : std::uint8_t {
  kAuto = 0,   ///< 3 where rows * cols of the level < k_L * vertices of the part, else 2 (paper 4.2, step 4)
  kOne = 1,    ///< inside-outside function of the superquadrics: inside any means inside
  kTwo = 2,    ///< foot point and distance map: distance along the superquadric's normal
  kThree = 3,  ///< closest point on the surface that the map and its vertex samples represent
};

/// k_L of the paper's rule for Layer::kAuto.
inline constexpr double kLayerThreshold = 10;

struct QueryOptions {
  Layer layer = Layer::kAuto;
  std::uint32_t level = 0;  ///< pyramid level, 0 the finest; levels beyond a part's coarsest use its coarsest
  /// Longest edge L of the triangles whose corners are the points [m]; 0: the points stand for themselves. A
  /// face can cut a convex feature that all its corners miss (paper eq. 12). With L > 0 signed distances are
  /// less by
  ///
  ///     delta = sqrt(rho^2 + L^2/3) - rho
  ///
  /// with rho the radius of convex curvature near the foot point, so that a face whose corners are at >= 0
  /// stays outside a ball of radius rho: L/sqrt(3) at a spike, 0 on flat and hollow surface. (The paper's
  /// delta follows the gradient of D at its minima, where that vanishes.) Creases count as bent over one cell
  /// of the map. `inside` is not affected.
  float edge_length_m = 0;
};

inline constexpr std::uint32_t kNowhere = 0xFFFFFFFF;

/// What is known about one point. Object frame, metres.
struct Answer {
  /// Distance to the surface, negative inside. NaN where nothing is known: outside every superquadric (the
  /// point is then outside the object, farther than `part` can tell), or in layer 1.
  float signed_distance_m = std::numeric_limits<float>::quiet_NaN();
  Vec3f normal;     ///< outward unit normal of the object near the point; zero where unknown
  Vec3f surface_m;  ///< the point of the surface that signed_distance_m speaks of; zero where unknown
  std::uint32_t part = kNowhere;  ///< part that answered; kNowhere: outside every superquadric
  Layer layer = Layer::kAuto;     ///< layer that answered; kAuto: none, the bounding spheres or a NaN input
  bool inside = false;
};

/// Where the results of a batch go. A span is either empty (not wanted) or as long as the points.
struct Answers {
  std::span<float> signed_distance_m{};
  std::span<Vec3f> normal{};
  std::span<Vec3f> surface_m{};
  std::span<std::uint32_t> part{};
  std::span<std::uint8_t> layer{};
  std::span<std::uint8_t> inside{};
};

/// An asset made ready for queries. Immutable, so any number of threads may query one object.
class Object {
 public:
  /// Builds the query tables of a valid asset. Allocates; queries never do.
  /// Errors: kInvalidAsset with the first rule that validate(asset, kQuick) finds broken.
  static Result<Object> build(const Asset& asset);
  ~Object();
  Object(Object&&) noexcept;
  Object& operator=(Object&&) noexcept;

  /// One point, object frame [m]. A point that is not finite gets the default Answer. Bounded time, no
  /// allocation.
  Answer query(const Vec3f& p_m, const QueryOptions& options = {}) const noexcept;
  /// Many points. Same answers as one at a time.
  void query(std::span<const Vec3f> points_m, const Answers& answers,
             const QueryOptions& options = {}) const noexcept;

  std::size_t part_count() const noexcept;
  std::uint32_t level_count() const noexcept;     ///< of the part that has most
  const BoundingSphere& sphere() const noexcept;  ///< object frame
  double r_max_m() const noexcept;
  std::size_t resident_bytes() const noexcept;  ///< memory the object holds, itself included

 private:
  struct Impl;
  explicit Object(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqmap::runtime
