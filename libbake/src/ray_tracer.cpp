// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <new>
#include <utility>

#include <embree3/rtcore.h>

#include "sqmap/bake/oracle.hpp"

namespace sqmap::bake {
namespace {

/// Indexed by axis: the axes that a ray is tested along are known only at run time.
using Corner = std::array<double, 3>;
using Triangle = std::array<Corner, 3>;

/// Embree's own triangle test works in float and, aimed at a vertex, missed all faces round it for 1 % of the
/// rays measured, robust mode or not. So it is given only the boxes of the triangles, grown by this share of
/// the mesh's size: float coordinates up to 2 and directions are wrong by 1.2e-7, and a box test by a few of
/// those.
constexpr double kBoxMargin = 2e-6;

/// Two crossings no further apart than this share of the mesh's size, one in and one out through faces that
/// touch, are a ray grazing an edge.
constexpr double kSamePlace = 1e-12;

/// A ray and its crossing test in double: coordinates are sheared so that the ray is the z axis (Woop et al.
/// 2013), and the side on which the axis passes each edge decides. Both faces of an edge compute the same two
/// products, so they see opposite signs; where a sign is zero the axis counts as shifted by (e, e^2), e -> 0,
/// for all faces alike. So a ray through an edge or a vertex crosses one face for each time the surface
/// passes it.
class ExactRay {
 public:
  ExactRay(const Vec3d& origin, const Vec3d& direction) {
    if (std::abs(direction.y) > std::abs(direction.x)) z_ = 1;
    if (std::abs(direction.z) > std::abs(direction[z_])) z_ = 2;
    x_ = (z_ + 1) % 3;
    y_ = (z_ + 2) % 3;
    if (direction[z_] < 0) std::swap(x_, y_);
    per_z_ = 1 / direction[z_];
    shear_x_ = direction[x_] * per_z_;
    shear_y_ = direction[y_] * per_z_;
    from_ = {origin[x_], origin[y_], origin[z_]};
  }

  /// Whether the ray's line crosses the triangle, and if so where and in which direction.
  bool crosses(const Triangle& triangle, double& t, bool& entering) const {
    const Point a = project(triangle[0]), b = project(triangle[1]), c = project(triangle[2]);
    const double bc = twice_area(b, c), ca = twice_area(c, a), ab = twice_area(a, b);
    const int side = side_of(b, c, bc);
    if (side == 0 || side != side_of(c, a, ca) || side != side_of(a, b, ab)) return false;
    const double area = bc + ca + ab;
    if (area == 0) return false;  // all three rounded to zero
    t = (bc / area * a.z + ca / area * b.z + ab / area * c.z) * per_z_;
    entering = side < 0;  // clockwise as the axis looks at it: the normal points back
    return true;
  }

 private:
  struct Point {
    double x, y, z;
  };

  Point project(const Corner& p) const {
    const double x = p[x_] - from_.x, y = p[y_] - from_.y, z = p[z_] - from_.z;
    return {x - shear_x_ * z, y - shear_y_ * z, z};
  }
  /// Of the axis and the edge a b. Exchanging a and b changes the sign and nothing else, as long as the
  /// compiler does not contract one product of the two (-ffp-contract=off).
  static double twice_area(const Point& a, const Point& b) { return a.x * b.y - a.y * b.x; }
  static int sign(double x) { return (x > 0) - (x < 0); }
  static int side_of(const Point& a, const Point& b, double area) {
    if (area != 0) return sign(area);
    if (a.y != b.y) return sign(a.y - b.y);  // the area's change with e
    return sign(b.x - a.x);                  // and with e^2
  }

  int x_ = 0, y_ = 0, z_ = 0;
  Vec3d from_;  ///< the origin along these axes
  double shear_x_ = 0, shear_y_ = 0, per_z_ = 0;
};

/// What the box callback needs of the query it serves.
struct Query {
  RTCIntersectContext context;  // first: the callback is given its address
  const ExactRay* ray;
  double first_t;  ///< crossings before it do not count
  std::vector<RayTracer::Hit>* hits;
};

void bound(const RTCBoundsFunctionArguments* arguments) {
  const Triangle& triangle = static_cast<const Triangle*>(arguments->geometryUserPtr)[arguments->primID];
  Corner low = triangle[0], high = low;
  for (const Corner& p : triangle)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], p[axis]);
      high[axis] = std::max(high[axis], p[axis]);
    }
  RTCBounds& box = *arguments->bounds_o;
  box.lower_x = static_cast<float>(low[0] - kBoxMargin);
  box.lower_y = static_cast<float>(low[1] - kBoxMargin);
  box.lower_z = static_cast<float>(low[2] - kBoxMargin);
  box.upper_x = static_cast<float>(high[0] + kBoxMargin);
  box.upper_y = static_cast<float>(high[1] + kBoxMargin);
  box.upper_z = static_cast<float>(high[2] + kBoxMargin);
}

/// Notes a crossing and leaves the ray as it is, so that Embree goes on through all boxes on its way.
void intersect(const RTCIntersectFunctionNArguments* arguments) {
  const Triangle& triangle = static_cast<const Triangle*>(arguments->geometryUserPtr)[arguments->primID];
  const auto* query = reinterpret_cast<const Query*>(arguments->context);
  RayTracer::Hit hit{0, arguments->primID, false};
  if (query->ray->crosses(triangle, hit.t_m, hit.entering) && hit.t_m >= query->first_t)
    query->hits->push_back(hit);
}

}  // namespace

struct RayTracer::Impl {
  explicit Impl(const Mesh& mesh) : faces(mesh.faces) {
    normalise(mesh);
    // Embree would reserve 128 MB for the tessellation of surfaces that are not here.
    device = rtcNewDevice("tessellation_cache_size=0");
    if (device == nullptr) throw std::bad_alloc();
    scene = rtcNewScene(device);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    RTCGeometry boxes = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(boxes, static_cast<unsigned>(triangles.size()));
    rtcSetGeometryUserData(boxes, triangles.data());
    rtcSetGeometryBoundsFunction(
        boxes, [](const RTCBoundsFunctionArguments* a) { bound(a); }, nullptr);
    rtcSetGeometryIntersectFunction(boxes, [](const RTCIntersectFunctionNArguments* a) { intersect(a); });
    rtcCommitGeometry(boxes);
    rtcAttachGeometry(scene, boxes);
    rtcReleaseGeometry(boxes);
    rtcCommitScene(scene);
    if (rtcGetDeviceError(device) != RTC_ERROR_NONE) {
      release();
      throw std::bad_alloc();
    }
  }
  ~Impl() { release(); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void release() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }

  /// Copies the triangles into the unit box round zero: float would not tell the vertices of a small mesh far
  /// from zero apart.
  void normalise(const Mesh& mesh) {
    if (mesh.vertices_m.empty()) return;
    Vec3d low = mesh.vertices_m[0], high = low;
    for (const Vec3d& p_m : mesh.vertices_m)
      for (int axis = 0; axis < 3; ++axis) {
        low[axis] = std::min(low[axis], p_m[axis]);
        high[axis] = std::max(high[axis], p_m[axis]);
      }
    centre_m = 0.5 * low + 0.5 * high;
    size_m = std::max({high.x - low.x, high.y - low.y, high.z - low.z});
    if (!(size_m > std::numeric_limits<double>::min())) size_m = 1;  // a point: any size will do
    triangles.reserve(faces.size());
    for (const auto& [a, b, c] : faces)
      triangles.push_back(
          {corner(mesh.vertices_m[a]), corner(mesh.vertices_m[b]), corner(mesh.vertices_m[c])});
  }
  Vec3d unit(const Vec3d& p_m) const { return (1 / size_m) * (p_m - centre_m); }
  Corner corner(const Vec3d& p_m) const {
    const Vec3d p = unit(p_m);
    return {p.x, p.y, p.z};
  }

  /// All crossings with t >= first_t, which is 0 or -infinity.
  void trace(const Vec3d& origin_m, const Vec3d& direction, double first_t, std::vector<Hit>& hits) const;

  bool touch(std::uint32_t f, std::uint32_t g) const {
    return std::ranges::any_of(faces[f],
                               [&](std::uint32_t v) { return std::ranges::count(faces[g], v) > 0; });
  }

  std::vector<std::array<std::uint32_t, 3>> faces;
  std::vector<Triangle> triangles;  ///< in the unit box
  Vec3d centre_m;
  double size_m = 1;
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
};

RayTracer::RayTracer(const Mesh& mesh) : impl_(std::make_unique<Impl>(mesh)) {}
RayTracer::~RayTracer() = default;
RayTracer::RayTracer(RayTracer&&) noexcept = default;
RayTracer& RayTracer::operator=(RayTracer&&) noexcept = default;

void RayTracer::Impl::trace(const Vec3d& origin_m, const Vec3d& direction, double first_t,
                            std::vector<Hit>& hits) const {
  hits.clear();
  const Vec3d origin = unit(origin_m);
  if (!(std::abs(norm(direction) - 1) < 1e-3) || !std::isfinite(norm(origin))) return;  // NaN: no ray

  // A line, or a ray from far away, is started, for Embree, at the sphere round the unit box, where float is
  // dense enough; and all a little early, so that boxes round t = 0 count.
  constexpr double kSphere = 1;  // the corners of the box are at sqrt(3) / 2
  const double start = std::max(first_t, -dot(origin, direction) - kSphere) - 4 * kBoxMargin;
  const Vec3f from = cast<float>(origin + start * direction), along = cast<float>(direction);
  const ExactRay ray(origin, direction);
  Query query{};
  rtcInitIntersectContext(&query.context);
  query.ray = &ray;
  query.first_t = first_t;
  query.hits = &hits;
  RTCRayHit rayhit{};
  rayhit.ray = {from.x, from.y, from.z, 0, along.x, along.y, along.z, 0, 0, 0, 0, 0};
  rayhit.ray.tfar = std::numeric_limits<float>::infinity();
  rayhit.ray.mask = 0xFFFFFFFF;
  rayhit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rayhit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene, &query.context, &rayhit);

  for (Hit& hit : hits) hit.t_m *= size_m;
  std::ranges::sort(
      hits, [](const Hit& a, const Hit& b) { return a.t_m != b.t_m ? a.t_m < b.t_m : a.face < b.face; });
  const double same_m = kSamePlace * size_m;
  for (std::size_t i = 0; i + 1 < hits.size();) {
    const Hit &a = hits[i], &b = hits[i + 1];
    const bool grazes = b.t_m - a.t_m <= same_m && a.entering != b.entering && touch(a.face, b.face);
    if (!grazes) {
      ++i;
      continue;
    }
    hits.erase(hits.begin() + static_cast<std::ptrdiff_t>(i),
               hits.begin() + static_cast<std::ptrdiff_t>(i) + 2);
    if (i > 0) --i;
  }
}

void RayTracer::trace(const Vec3d& origin_m, const Vec3d& direction, std::vector<Hit>& hits) const {
  impl_->trace(origin_m, direction, 0, hits);
}

void RayTracer::trace_line(const Vec3d& origin_m, const Vec3d& direction, std::vector<Hit>& hits) const {
  impl_->trace(origin_m, direction, -std::numeric_limits<double>::infinity(), hits);
}

}  // namespace sqmap::bake
