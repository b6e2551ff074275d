// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <span>

#include "sqmap/asset/result.hpp"
#include "sqmap/asset/vec.hpp"
#include "sqmap/runtime/object.hpp"

namespace sqmap::runtime {

/// The points of a body that meets objects: mesh vertices or surface samples. They are kept in blocks of 32
/// that lie close together, with a ball around each block and one around all, so that a query looks only at
/// blocks near a part (Object::query(body, ...), Object::contacts). Answers always speak of points by the
/// caller's index.
///
/// Rigid bodies are built once and move by their placement. Deformable ones are built from some rest shape
/// and refitted every frame.
class PointBody {
 public:
  /// Sorts the points into blocks. Allocates.
  /// Errors: kInvalidMesh for a point that is not finite, or 2^32 points or more.
  static Result<PointBody> build(std::span<const Vec3f> points_m);
  ~PointBody();
  PointBody(PointBody&&) noexcept;
  PointBody& operator=(PointBody&&) noexcept;

  /// New places of the same points, in the caller's order. Blocks keep their members, so a body folded far
  /// from the shape it was built from is culled less well, not wrongly. No allocation. False, and nothing
  /// changes: another count, or a point that is not finite.
  bool refit(std::span<const Vec3f> points_m) noexcept;

  std::size_t point_count() const noexcept;
  Vec3f sphere_centre_m() const noexcept;  ///< of the ball around all points
  float sphere_radius_m() const noexcept;
  /// sizeof(PointBody) + a record, and 16 bytes a point and 16 a block; blocks are rounded up to a multiple
  /// of 16.
  std::size_t resident_bytes() const noexcept;

  struct Data;  ///< internal
  const Data& data() const noexcept { return *data_; }

 private:
  explicit PointBody(std::unique_ptr<Data> data);
  std::unique_ptr<Data> data_;
};

/// Where a body stands in an object's frame: p_object = scale * R * p_body + t.
struct BodyPlacement {
  Pose object_from_body;
  double scale = 1;  ///< > 0
};

/// Which contacts are wanted.
enum class Seek : std::uint8_t {
  kAll = 0,
  kAny = 1,      ///< one of them, whichever is found first; the same one every time
  kDeepest = 2,  ///< the one of largest depth_m; of equals that of lowest index
};

struct ContactQuery {
  QueryOptions options;
  /// Points with a signed distance below this count as contacts [m]. Points that cannot are found with layer
  /// 2 and never see layer 3. At 0 that is exact: a point is inside only if some chart says so, and layer 3
  /// asks only those. Above 0 it also uses that depth below a superquadric changes no faster than place does:
  /// a chart whose surface lies everywhere deeper than its foot depth + within_m is farther than within_m.
  /// (Maps hold depths up to the medial axis, where the depth of a surface point below the superquadric is
  /// what the map says.)
  float within_m = 0;
  Seek seek = Seek::kAll;
};

}  // namespace sqmap::runtime
