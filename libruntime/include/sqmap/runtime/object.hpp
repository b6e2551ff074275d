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
  /// point is then outside the object, farther than `part` can tell), in layer 1, and in layer 2 at few
  /// places inside the mesh, where neither the ray from above nor a search beside it meets a surface.
  float signed_distance_m = std::numeric_limits<float>::quiet_NaN();
  /// Outward unit vector; zero where unknown. In layer 3 the direction in which the distance grows, from
  /// surface_m to the point or back; near the surface, on the rims of charts, and in the other layers, the
  /// surface's normal. Between neighbouring points a force turns faster than they move where `part` or
  /// `inside` changes, surface_m leaps, or the normal is not that direction; hardly ever elsewhere.
  Vec3f normal;
  Vec3f surface_m;  ///< the point of the surface that signed_distance_m speaks of; zero where unknown
  std::uint32_t part = kNowhere;  ///< part that answered; kNowhere: outside every superquadric
  Layer layer = Layer::kAuto;     ///< layer that answered; kAuto: none, the bounding spheres or a NaN input
  /// In layers 2 and 3 never other than what Object::certainty is sure of.
  bool inside = false;
};

/// What is proven of a point. Stable numbers.
enum class Certainty : std::uint8_t {
  kUnsure = 0,   ///< look closer: the surface may be near. Who must not miss the inside takes it for kInside
  kOutside = 1,  ///< surely outside the mesh
  kInside = 2,   ///< surely inside the mesh
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

/// Instruction sets of the batched queries. All give the same bits, those of the single-point query.
enum class SimdTarget : std::uint8_t {
  kBaseline = 0,  ///< what the compiler was told to assume: NEON on ARM, plain C++ on x86-64
  kSse4 = 1,
  kAvx2 = 2,
  kAvx512 = 3,
};
/// Whether this build has it and this processor runs it.
bool is_supported(SimdTarget target) noexcept;
/// The one in use: the widest that is supported, unless set otherwise.
SimdTarget simd_target() noexcept;
/// For tests and measurements; applies to the whole process. False, without effect: not supported.
bool set_simd_target(SimdTarget target) noexcept;

class PointBody;
struct BodyPlacement;
struct Contact;
struct ContactQuery;
struct WorkBudget;

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
  /// Many points. Same answers as one at a time. Needs up to 440 KB of stack, as do all questions about
  /// bodies; one point needs 4 KB.
  void query(std::span<const Vec3f> points_m, const Answers& answers,
             const QueryOptions& options = {}) const noexcept;

  /// What the bounds of a conservative bake prove of points, object frame [m]. Same answers one at a time.
  /// query() in layers 2 and 3 asks them too: where they are sure, they decide the side.
  /// Precondition: `told` is as long as the points. Bounded time, no allocation.
  void certainty(std::span<const Vec3f> points_m, std::span<Certainty> told) const noexcept;
  Certainty certainty(const Vec3f& p_m) const noexcept;
  /// The farthest that a point told kOutside may lie inside the mesh, or one told kInside outside of it [m].
  /// NaN where a part has no bounds: what is told of points within it is then kUnsure.
  double certainty_tolerance_m() const noexcept;

  /// The points of a body in this object's frame, answers by the body's indices: as query(span) of the moved
  /// points, but blocks that touch no part cost next to nothing. A placement that is not finite finds
  /// nothing.
  void query(const PointBody& body, const BodyPlacement& placement, const Answers& answers,
             const QueryOptions& options = {}) const noexcept;
  /// Points of the body that touch (sqmap/runtime/body.hpp), object frame; also points that are inside and
  /// have no distance (layer 1; depth 0). Writes as many as there is room for, in an order that is the same
  /// every time.
  /// @return how many there are: with Seek::kAny and kDeepest at most 1
  std::size_t contacts(const PointBody& body, const BodyPlacement& placement, std::span<Contact> contacts,
                       const ContactQuery& query) const noexcept;
  /// The same with the deepest layer, of those up to query.options.layer, that the budget affords
  /// (sqmap/runtime/budget.hpp); what was spent and reached is written there. Layer 1 is always afforded.
  /// Costs the bounds and layer 1 twice.
  std::size_t contacts(const PointBody& body, const BodyPlacement& placement, std::span<Contact> contacts,
                       const ContactQuery& query, WorkBudget& budget) const noexcept;

  std::size_t part_count() const noexcept;
  /// The layer that options.layer, which may be kAuto, comes to for one part. Precondition: there is the
  /// part.
  Layer layer_of(std::uint32_t part, const QueryOptions& options) const noexcept;
  std::uint32_t level_count() const noexcept;     ///< of the part that has most
  const BoundingSphere& sphere() const noexcept;  ///< object frame
  double r_max_m() const noexcept;
  /// Memory the object holds, itself included. With r rows, n texels of b bits that are held, c further
  /// crossings and v vertex samples in a part, of which the baker's parts have about one a hundred texels:
  ///
  ///     constant + sum over parts of  record + 388 + u (r + 1) + ceil(n (b + s) / 8) + ceil(3 t / 2)
  ///                                   + 36 m^2
  ///                                   + [c > 0] (ceil(r k / 64) + (2 + w) c)
  ///                                   + [v > 0] (ceil(r k / 64) + (4 + w) v)
  ///
  /// and 212 for a tapered part. k columns; s = 1 where any texel starts inside the mesh, else 0. Of a row
  /// all texels are held without all but one of the longest run, round the turn, of those whose rays hit
  /// nothing and start alike; where no two such are neighbours all, and the first twice. (Where n k > 2^(8 u
  /// - 2) rows may begin at multiples of some power of two.) u = 3 and w = 2 where r k <= 65536, else u = w
  /// = 4. t boxes of the part's inside, at most 256, each with a start of layer 3; m cells a side of the
  /// part's bounds, 0 without. The constant is below 200 bytes and the record at most 256, both fixed by the
  /// build.
  std::size_t resident_bytes() const noexcept;

 private:
  struct Impl;
  explicit Object(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqmap::runtime
