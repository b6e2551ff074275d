// SPDX-License-Identifier: GPL-3.0-or-later
#include "mesh_boxes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <new>
#include <optional>
#include <string>
#include <utility>

#include <embree3/rtcore.h>

#include "nearest_of_triangle.hpp"

namespace sqmap::bake {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Rays that Embree traces together. Not as coherent ones: there it missed boxes beside rays along an axis.
constexpr std::size_t kPacket = 16;

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
  ExactRay() = default;
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

/// What the box callback needs of the rays it serves.
struct RayQuery {
  RTCIntersectContext context;  // first: the callback is given its address
  double first_t;               ///< crossings before it do not count
  std::array<ExactRay, kPacket> rays;
  std::vector<RayTracer::Hit>* hits;  ///< of each ray
};

/// What the box callback needs of the point it serves, and the nearest point so far.
struct PointQuery {
  const Triangle* triangles;
  Vec3d p;
  Vec3d nearest;
  double square = kInfinity;  ///< of the distance
  std::uint32_t face = kNewFace;
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

/// Notes crossings and leaves the rays as they are, so that Embree goes on through all boxes on their way.
void intersect(const RTCIntersectFunctionNArguments* arguments) {
  const Triangle& triangle = static_cast<const Triangle*>(arguments->geometryUserPtr)[arguments->primID];
  const auto* query = reinterpret_cast<const RayQuery*>(arguments->context);
  RTCRayN* rays = RTCRayHitN_RayN(arguments->rayhit, arguments->N);
  for (unsigned i = 0; i < arguments->N; ++i) {
    if (arguments->valid[i] == 0) continue;
    const unsigned ray = RTCRayN_id(rays, arguments->N, i);
    RayTracer::Hit hit{0, arguments->primID, false};
    if (query->rays[ray].crosses(triangle, hit.t_m, hit.entering) && hit.t_m >= query->first_t)
      query->hits[ray].push_back(hit);
  }
}

/// A radius, for Embree, that no box of what lies within `distance` of p is beyond.
float radius_for(double distance, const Vec3d& p) {
  constexpr double kFloat = 1e-6;  // several roundings of float
  return static_cast<float>((1 + kFloat) * distance + kFloat * norm(p) + 2 * kBoxMargin);
}

Vec3d vec(const Corner& p) { return {p[0], p[1], p[2]}; }

/// Keeps the nearest point; of equally near ones, that of the lowest face, whatever the order of boxes.
bool look_at(std::uint32_t face, PointQuery& query) {
  const Triangle& t = query.triangles[face];
  const Vec3d q = nearest_of_triangle(query.p, {vec(t[0]), vec(t[1]), vec(t[2])});
  const double square = dot(q - query.p, q - query.p);
  if (!(square < query.square || (square == query.square && face < query.face))) return false;
  query.nearest = q;
  query.square = square;
  query.face = face;
  return true;
}

/// Tells Embree whether it may look nearer by than before.
bool look(RTCPointQueryFunctionArguments* arguments) {
  auto& query = *static_cast<PointQuery*>(arguments->userPtr);
  if (!look_at(arguments->primID, query)) return false;
  arguments->query->radius = std::min(arguments->query->radius, radius_for(std::sqrt(query.square), query.p));
  return true;
}

}  // namespace

struct MeshBoxes::Impl {
  Impl(const Mesh& mesh, const std::string& widest) : faces(mesh.faces) {
    normalise(mesh);
    // Embree would reserve 128 MB for the tessellation of surfaces that are not here.
    std::string settings = "tessellation_cache_size=0";
    if (!widest.empty()) settings += ",max_isa=" + widest;
    device = rtcNewDevice(settings.c_str());
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

  struct FloatRay {
    Vec3f from, along;
  };
  /// A ray as Embree sees it, and as its crossings are computed; nothing if it is none.
  std::optional<FloatRay> float_ray(const Ray& ray, double first_t, ExactRay& exact) const;
  void trace_one(const Ray& ray, RayQuery& query) const;
  /// At most kPacket.
  void trace_packet(std::span<const Ray> rays, RayQuery& query) const;
  /// From crossings in the unit box, in any order.
  void finish(std::vector<RayTracer::Hit>& hits) const;

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

std::optional<MeshBoxes::Impl::FloatRay> MeshBoxes::Impl::float_ray(const Ray& ray, double first_t,
                                                                    ExactRay& exact) const {
  const Vec3d origin = unit(ray.origin_m);
  if (!(std::abs(norm(ray.direction) - 1) < 1e-3) || !std::isfinite(norm(origin)))
    return std::nullopt;  // NaN: no ray
  exact = ExactRay(origin, ray.direction);
  // A line, or a ray from far away, is started, for Embree, at the sphere round the unit box, where float is
  // dense enough; and all a little early, so that boxes round t = 0 count.
  constexpr double kSphere = 1;  // the corners of the box are at sqrt(3) / 2
  const double start = std::max(first_t, -dot(origin, ray.direction) - kSphere) - 4 * kBoxMargin;
  return FloatRay{cast<float>(origin + start * ray.direction), cast<float>(ray.direction)};
}

void MeshBoxes::Impl::trace_one(const Ray& ray, RayQuery& query) const {
  const auto start = float_ray(ray, query.first_t, query.rays[0]);
  if (!start) return;
  const auto& [from, along] = *start;
  RTCRayHit rayhit{};
  rayhit.ray = {from.x, from.y, from.z, 0, along.x, along.y, along.z, 0, 0, 0, 0, 0};
  rayhit.ray.tfar = std::numeric_limits<float>::infinity();
  rayhit.ray.mask = 0xFFFFFFFF;
  rayhit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rayhit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene, &query.context, &rayhit);
}

void MeshBoxes::Impl::trace_packet(std::span<const Ray> rays, RayQuery& query) const {
  alignas(64) std::array<int, kPacket> valid{};
  RTCRayHit16 packet{};
  for (std::size_t k = 0; k < kPacket; ++k) {
    RTCRay16& ray = packet.ray;
    ray.id[k] = static_cast<unsigned>(k);
    ray.mask[k] = 0xFFFFFFFF;
    packet.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
    packet.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
    const auto start = k < rays.size() ? float_ray(rays[k], query.first_t, query.rays[k]) : std::nullopt;
    // An empty ray says that it is none: where processors have no vectors of 16, Embree 3.13 cuts the packet
    // and forgets `valid`.
    ray.tfar[k] = (start ? 1.0F : -1.0F) * std::numeric_limits<float>::infinity();
    if (!start) continue;
    valid[k] = -1;
    const auto& [from, along] = *start;
    ray.org_x[k] = from.x;
    ray.org_y[k] = from.y;
    ray.org_z[k] = from.z;
    ray.dir_x[k] = along.x;
    ray.dir_y[k] = along.y;
    ray.dir_z[k] = along.z;
  }
  rtcIntersect16(valid.data(), scene, &query.context, &packet);
}

void MeshBoxes::Impl::finish(std::vector<RayTracer::Hit>& hits) const {
  using Hit = RayTracer::Hit;
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

MeshBoxes::MeshBoxes(const Mesh& mesh, const std::string& widest)
    : impl_(std::make_unique<Impl>(mesh, widest)) {}
MeshBoxes::~MeshBoxes() = default;

void MeshBoxes::trace(std::span<const Ray> rays, bool whole_lines,
                      std::span<std::vector<RayTracer::Hit>> hits) const {
  RayQuery query{};
  rtcInitIntersectContext(&query.context);
  query.first_t = whole_lines ? -kInfinity : 0;
  for (std::size_t begin = 0; begin < rays.size(); begin += kPacket) {
    const std::size_t count = std::min(kPacket, rays.size() - begin);
    const auto lists = hits.subspan(begin, count);
    for (auto& list : lists) list.clear();
    query.hits = lists.data();
    if (count == 1) {
      impl_->trace_one(rays[begin], query);
    } else {
      impl_->trace_packet(rays.subspan(begin, count), query);
    }
    for (auto& list : lists) impl_->finish(list);
  }
}

Oracle::Answer MeshBoxes::nearest(const Vec3d& p_m, double at_most_m) const {
  PointQuery query{impl_->triangles.data(), impl_->unit(p_m), {}};
  constexpr double kFar = 1e3;  // floats tell boxes apart only near them
  if (norm(query.p) < kFar) {
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    const Vec3f p = cast<float>(query.p);
    RTCPointQuery embree{p.x, p.y, p.z, 0, radius_for(at_most_m / impl_->size_m, query.p)};
    rtcPointQuery(impl_->scene, &embree, &context, look, &query);
  } else {
    for (std::uint32_t face = 0; face < impl_->triangles.size(); ++face) look_at(face, query);
  }
  return {impl_->size_m * std::sqrt(query.square), impl_->centre_m + impl_->size_m * query.nearest,
          query.face};
}

}  // namespace sqmap::bake
