// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <span>
#include <type_traits>

#include "sqmap/asset/result.hpp"
#include "sqmap/asset/vec.hpp"
#include "sqmap/runtime/object.hpp"

namespace sqmap::runtime {

/// Where an object stands in the world:
///
///     p_world = scale * R * F * p_object + t,   F = diag(-1, 1, 1) where mirrored, else 1
///
/// with R and t those of world_from_object.
struct Placement {
  Pose world_from_object;
  double scale = 1;       ///< > 0
  bool mirrored = false;  ///< the object's x is turned round first
};

/// An affine map by rows: p_world = linear * p_object + translation_m.
struct Affine {
  std::array<Vec3d, 3> linear{Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}};
  Vec3d translation_m;
};

/// How far, relative to its length, a column of Affine::linear may be from those of a rotation times a scale:
/// what float matrices of engines lose in a few products, and too little to see in a distance.
inline constexpr double kSimilarityTolerance = 1e-4;
/// Scales that keep lengths of every valid asset, and their squares, within float.
inline constexpr double kLeastScale = 1e-9, kMostScale = 1e9;
/// No part of an instance may lie farther from the world's origin along an axis [m].
inline constexpr double kWorldReach_m = 1e18;

/// One object under a rigid pose, a uniform scale and perhaps a mirror; other maps change distances by
/// direction and are refused. Questions and answers are in the world frame, metres.
///
/// Holds no data of the object, only its address: thousands of instances share one object, an instance is a
/// copyable value of kInstanceBytes, and placing one allocates nothing unless it is refused. The caller keeps
/// the object where it is while an instance of it is in use. (A shared_ptr would count references in every
/// copy, from every thread, for a lifetime that the owner of a scene knows anyway.)
class Instance {
 public:
  /// Errors: kBadOption for a placement that is not finite, a scale outside [kLeastScale, kMostScale], an
  /// orientation without length, or an object beyond kWorldReach_m.
  static Result<Instance> place(const Object& object, const Placement& placement);
  /// The same from a matrix. Errors: also kBadOption for shear and for scales that differ by axis.
  static Result<Instance> place(const Object& object, const Affine& world_from_object);

  /// One point, world frame. As Object::query; a point that is not finite gets the default Answer. Bounded
  /// time, no allocation. options.edge_length_m is in world metres.
  Answer query(const Vec3f& p_m, const QueryOptions& options = {}) const noexcept;
  /// Many points. Same answers as one at a time.
  void query(std::span<const Vec3f> points_m, const Answers& answers,
             const QueryOptions& options = {}) const noexcept;

  /// The points of a body that stands in the world, answers by the body's indices; as Object::query(body).
  /// Blocks that touch no part cost next to nothing. Where either is mirrored and the other is not, blocks
  /// are dropped by the object's sphere alone.
  void query(const PointBody& body, const Placement& world_from_body, const Answers& answers,
             const QueryOptions& options = {}) const noexcept;
  /// As Object::contacts, world frame; query.within_m is in world metres. A contact without a depth has the
  /// point itself as its surface_m, as in sqmap/runtime/contacts.hpp. A placement of the body that is not
  /// finite finds nothing. No allocation.
  std::size_t contacts(const PointBody& body, const Placement& world_from_body, std::span<Contact> contacts,
                       const ContactQuery& query) const noexcept;
  /// The same within a budget. Where either is mirrored and the other is not, a point counts once however
  /// many superquadrics hold it.
  std::size_t contacts(const PointBody& body, const Placement& world_from_body, std::span<Contact> contacts,
                       const ContactQuery& query, WorkBudget& budget) const noexcept;

  /// As Object::certainty, world frame. It is told of the points as to_object() gives them.
  void certainty(std::span<const Vec3f> points_m, std::span<Certainty> told) const noexcept;
  Certainty certainty(const Vec3f& p_m) const noexcept { return object_->certainty(to_object(p_m)); }

  const Object& object() const noexcept { return *object_; }
  float scale() const noexcept { return scale_; }
  bool mirrored() const noexcept;
  const Vec3d& translation_m() const noexcept { return translation_m_; }
  /// R F of Placement: orthogonal, determinant -1 where mirrored.
  const Rotation<float>& orientation() const noexcept { return orientation_; }
  /// Ball around the whole instance, world frame.
  BoundingSphere sphere() const noexcept;

  /// World to object frame. Differences are taken in double, so that an instance far from the world's origin
  /// loses no more than its points have lost already.
  Vec3f to_object(const Vec3f& p_m) const noexcept;
  Vec3f to_world(const Vec3f& p_object_m) const noexcept;
  /// A unit vector of the object in the world.
  Vec3f to_world_direction(const Vec3f& d_object) const noexcept { return orientation_.apply(d_object); }
  /// Options in world metres as the object takes them.
  QueryOptions options_in_object(QueryOptions options) const noexcept;
  /// An answer of the object as one of the instance.
  Answer answer_in_world(Answer answer) const noexcept;

 private:
  Instance(const Object& object, const Rotation<float>& orientation, const Vec3d& translation_m,
           double scale) noexcept;
  std::size_t contacts_of(const PointBody& body, const Placement& world_from_body,
                          std::span<Contact> contacts, ContactQuery query, WorkBudget* budget) const noexcept;

  const Object* object_;
  Vec3d translation_m_;
  Rotation<float> orientation_;
  float scale_, inverse_scale_;
};

inline constexpr std::size_t kInstanceBytes = 80;
static_assert(sizeof(Instance) <= kInstanceBytes && std::is_trivially_copyable_v<Instance>);

}  // namespace sqmap::runtime
