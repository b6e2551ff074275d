// SPDX-License-Identifier: GPL-3.0-or-later
#include "part_lines.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "long_edges.hpp"

namespace sqmap::bake {

namespace {

// Half an edge may bend by this share of the mesh's size at most; in the mean it is far less than maps
// resolve.
constexpr double kCurved = 1e-4;
constexpr std::size_t kMostFaces = 400000;
// Turns of the axis [rad] beyond which nothing is of interest, superquadrics end at kMostBendTurn; and
// lambdas below which nothing is, as shares of the superquadric's least. Edges that come nearer are no longer
// than this share of the arc's radius, so that none leaps from there to a superquadric.
constexpr double kEndTurn = 2.1, kEndStretch = 0.5;
constexpr double kLongest = 0.015, kShortest = 0.005;
constexpr double kLeast = 5e-4;  // no edge is cut below
// Nor is anything beyond this many times the superquadric's box.
constexpr double kBox = 1.1;

/// Where a point of the part frame lies in the straight frame, and what it may be left out for.
struct Place {
  Vec3d m;
  unsigned beyond;  ///< bits: the six sides of the box, then kTurned and kInmost
  static constexpr unsigned kTurned = 64, kInmost = 128;
};

/// What of the mesh lies around a bent part, in its straight frame.
class Straightener {
 public:
  explicit Straightener(const Superquadric& shape)
      : bend_(shape.bend),
        k_(shape.bend.curvature()),
        end_stretch_(kEndStretch * (1 - bend_reach(shape))),
        half_m_(half_extents_m(shape)) {}

  Place place(const Vec3d& p_m) const {
    Place at{straightened(bend_, p_m), 0};
    for (int axis = 0; axis < 3; ++axis) {
      if (at.m[axis] > kBox * half_m_[axis]) at.beyond |= 1U << axis;
      if (at.m[axis] < -kBox * half_m_[axis]) at.beyond |= 8U << axis;
    }
    if (std::abs(k_ * at.m.z) > kEndTurn) at.beyond |= Place::kTurned;
    if (bend_.stretch(at.m) < end_stretch_) at.beyond |= Place::kInmost;
    return at;
  }
  bool is_long(const Vec3d& a_m, const Vec3d& b_m, double most_m) const {
    const Place a = place(a_m), b = place(b_m);
    constexpr unsigned kNowhere = Place::kTurned | Place::kInmost;
    if ((a.beyond & b.beyond & kNowhere) != 0) return false;
    const double length = k_ * norm(b_m - a_m);
    if (length < kLeast) return false;
    if (((a.beyond | b.beyond) & kNowhere) != 0) {
      if (length > kLongest) return true;
      if (length < kShortest) return false;
    }
    const double off_m = norm(straightened(bend_, 0.5 * (a_m + b_m)) - 0.5 * (a.m + b.m));
    // On one side of the superquadric, too far from it to bend into it.
    for (int axis = 0; axis < 3; ++axis) {
      if (((a.beyond & b.beyond) & (9U << axis)) == 0) continue;
      const double beside_m = std::min(std::abs(a.m[axis]), std::abs(b.m[axis])) - half_m_[axis];
      if (beside_m > 2 * off_m) return false;
    }
    return off_m > most_m;
  }
  Mesh mesh(const Triangles& near, double most_m) const {
    const FineTriangles fine = split_edges(
        near, [&](const Vec3d& a_m, const Vec3d& b_m) { return is_long(a_m, b_m, most_m); },
        near.faces.size() + kMostFaces);
    Mesh result;
    std::vector<unsigned> beyond;
    for (const Vec3d& p_m : fine.triangles.points) {
      const Place at = place(p_m);
      result.vertices_m.push_back(at.m);
      beyond.push_back(at.beyond);
    }
    for (const auto& [a, b, c] : fine.triangles.faces) {
      const bool is_beside = (beyond[a] & beyond[b] & beyond[c]) != 0;
      const bool is_nowhere = ((beyond[a] | beyond[b] | beyond[c]) & (Place::kTurned | Place::kInmost)) != 0;
      if (is_beside || is_nowhere) continue;
      result.source_face.push_back(static_cast<std::uint32_t>(result.faces.size()));
      result.faces.push_back({a, b, c});
    }
    return result;
  }

 private:
  Bend<double> bend_;
  double k_, end_stretch_;
  Vec3d half_m_;
};

Mesh straightened_mesh(const Superquadric& shape, const Pose& object_from_part, const Mesh& mesh) {
  const BoundingSphere ball = bounding_sphere(shape);
  const Rotation<double> turn = rotation(object_from_part.orientation);
  Vec3d low = mesh.vertices_m.front(), high = low;
  std::vector<Vec3d> local_m;
  local_m.reserve(mesh.vertices_m.size());
  for (const Vec3d& v : mesh.vertices_m) {
    local_m.push_back(turn.apply_inverse(v - object_from_part.translation_m));
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], v[axis]);
      high[axis] = std::max(high[axis], v[axis]);
    }
  }
  Triangles near;
  std::vector<std::uint32_t> index(local_m.size(), kNewFace);
  for (const auto& face : mesh.faces) {
    bool is_near = true;
    for (int axis = 0; axis < 3; ++axis) {
      const auto [least_m, most_m] =
          std::minmax({local_m[face[0]][axis], local_m[face[1]][axis], local_m[face[2]][axis]});
      is_near = is_near && least_m <= ball.centre_m[axis] + ball.radius_m &&
                most_m >= ball.centre_m[axis] - ball.radius_m;
    }
    if (!is_near) continue;
    auto& here = near.faces.emplace_back();
    for (std::size_t i = 0; i < 3; ++i) {
      std::uint32_t& vertex = index[face[i]];
      if (vertex == kNewFace) {
        vertex = static_cast<std::uint32_t>(near.points.size());
        near.points.push_back(local_m[face[i]]);
      }
      here[i] = vertex;
    }
  }
  return Straightener(shape).mesh(near, kCurved * norm(high - low));
}

}  // namespace

PartLines::PartLines(const Superquadric& shape, const Pose& object_from_part, const MeshQueries& queries)
    : shape_(shape),
      translation_m_(object_from_part.translation_m),
      turn_(rotation(object_from_part.orientation)),
      queries_(queries) {
  if (!shape.bend.is_none()) straightened_.emplace(straightened_mesh(shape, object_from_part, queries.mesh));
}

RayTracer::Ray PartLines::in_object(const RayTracer::Ray& ray) const {
  const Bend<double>& bend = shape_.bend;
  if (bend.is_none()) return {turn_.apply(ray.origin_m) + translation_m_, turn_.apply(ray.direction)};
  return {turn_.apply(bent(bend, ray.origin_m)) + translation_m_,
          turn_.apply(normalized(turned(bend, ray.origin_m, ray.direction)))};
}

void PartLines::trace(std::span<const RayTracer::Ray> lines, Traced& traced) const {
  traced.hits.resize(lines.size());
  traced.winding.resize(lines.size());
  traced.in_object.clear();
  for (const RayTracer::Ray& line : lines) traced.in_object.push_back(in_object(line));
  queries_.rays.trace_lines(traced.in_object, traced.hits);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const auto& [origin_m, direction] = traced.in_object[i];
    traced.winding[i] = queries_.winding(origin_m, direction, traced.hits[i]);
  }
  if (straightened_) straightened_->trace_lines(lines, traced.hits);
}

void PartLines::trace(const Vec3d& from_m, const Vec3d& direction, std::vector<RayTracer::Hit>& hits) const {
  if (straightened_) {
    straightened_->trace(from_m, direction, hits);
  } else {
    const auto [origin_m, along] = in_object({from_m, direction});
    queries_.rays.trace(origin_m, along, hits);
  }
}

}  // namespace sqmap::bake
