// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sqmap/asset/vec.hpp"

namespace sqmap::bench {

inline constexpr std::size_t kBlock = 32;    ///< points of a block; a multiple of every vector length
inline constexpr std::size_t kPadding = 64;  ///< floats that may be read or written behind the last

/// The points of body B, made ready once and for all peers alike: sorted into blocks of kBlock neighbours,
/// one array a coordinate. Arrays are padded to whole blocks with copies of the last point.
struct Cloud {
  explicit Cloud(std::span<const Vec3d> points_m);
  /// Moves the points, given in the order of the constructor's, and bounds the blocks anew; allocates
  /// nothing.
  void refit(std::span<const Vec3f> places_m);

  std::size_t count{};
  std::vector<float> x_m, y_m, z_m;   ///< own frame of the cloud
  std::vector<Vec3f> points_m;        ///< the same, a point after the other, unpadded
  std::vector<std::uint32_t> source;  ///< index of each point in the input
  std::vector<float> block_x_m, block_y_m, block_z_m, block_radius_m;  ///< bounding spheres, padded
  std::size_t block_count{};

 private:
  void bound(std::size_t block);
};

/// Rigid: p_object = rotation * p_cloud + translation.
struct Placement {
  Rotation<float> rotation;
  Vec3f translation_m;
  Vec3f apply(const Vec3f& p_m) const noexcept { return rotation.apply(p_m) + translation_m; }
};

/// What a peer says of the points of one placed cloud: those it finds to lie within kBand of the surface, on
/// either side. Points deeper inside may be among them; nothing is asked of those. In no particular order.
/// Object frame.
struct Hits {
  explicit Hits(std::size_t points);

  std::size_t count{};
  std::vector<std::uint32_t> point;                 ///< index in the sorted cloud
  std::vector<float> distance_m;                    ///< signed, negative inside
  std::vector<float> normal_x, normal_y, normal_z;  ///< unit gradient of the distance
  std::vector<float> force_x_n, force_y_n, force_z_n;

  /// For peers that answer a point at a time.
  void add(std::size_t index, float distance, const Vec3f& normal) noexcept;
};

inline constexpr double kBand = 0.03;  ///< of R_max: how far outside the surface answers are asked for
inline constexpr float kStiffness_n_per_m = 500;  ///< force = stiffness * penetration * normal

}  // namespace sqmap::bench
