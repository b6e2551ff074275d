// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <limits>
#include <new>

#include <embree3/rtcore.h>

#include "closest.hpp"

namespace sqmap::bench {

struct EmbreeClosest::Impl {
  std::vector<std::array<Vec3d, 3>> triangles;
  RTCDevice device{};
  RTCScene scene{};
  ssize_t device_bytes{};
};

namespace {

bool count_bytes(void* total, ssize_t bytes, bool) {
  *static_cast<ssize_t*>(total) += bytes;
  return true;
}

struct Search {
  const std::vector<std::array<Vec3d, 3>>& triangles;
  Vec3d p_m;
  EmbreeClosest::Answer answer;
};

bool visit(RTCPointQueryFunctionArguments* arguments) {
  auto& search = *static_cast<Search*>(arguments->userPtr);
  const OnTriangle here = nearest_on_triangle(search.p_m, search.triangles[arguments->primID]);
  const Vec3d d = here.point_m - search.p_m;
  const double distance_m = std::sqrt(dot(d, d));
  if (distance_m > search.answer.distance_m) return false;
  search.answer = {true, here.point_m, distance_m, arguments->primID, here.feature};
  const float radius = std::nextafter(static_cast<float>(distance_m), std::numeric_limits<float>::infinity());
  if (radius >= arguments->query->radius) return false;
  arguments->query->radius = radius;
  return true;
}

}  // namespace

EmbreeClosest::EmbreeClosest(const bake::Mesh& mesh) : impl_(std::make_unique<Impl>()) {
  impl_->triangles.reserve(mesh.faces.size());
  for (const auto& [a, b, c] : mesh.faces)
    impl_->triangles.push_back({mesh.vertices_m[a], mesh.vertices_m[b], mesh.vertices_m[c]});
  impl_->device = rtcNewDevice("threads=1");
  if (impl_->device == nullptr) throw std::bad_alloc();
  rtcSetDeviceMemoryMonitorFunction(impl_->device, count_bytes, &impl_->device_bytes);
  impl_->scene = rtcNewScene(impl_->device);
  rtcSetSceneBuildQuality(impl_->scene, RTC_BUILD_QUALITY_HIGH);
  RTCGeometry geometry = rtcNewGeometry(impl_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.vertices_m.size()));
  auto* indices = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), mesh.faces.size()));
  if (vertices == nullptr || indices == nullptr) throw std::bad_alloc();
  for (const Vec3d& v : mesh.vertices_m)
    for (int axis = 0; axis < 3; ++axis) *vertices++ = static_cast<float>(v[axis]);
  for (const auto& face : mesh.faces)
    for (const std::uint32_t vertex : face) *indices++ = vertex;
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(impl_->scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(impl_->scene);
}

EmbreeClosest::~EmbreeClosest() {
  rtcReleaseScene(impl_->scene);
  rtcReleaseDevice(impl_->device);
}

EmbreeClosest::Answer EmbreeClosest::nearest(const Vec3d& p_m, double radius_m) const {
  Search search{impl_->triangles, p_m, {false, {}, radius_m, 0, 0}};
  RTCPointQuery query{};
  query.x = static_cast<float>(p_m.x);
  query.y = static_cast<float>(p_m.y);
  query.z = static_cast<float>(p_m.z);
  query.radius = static_cast<float>(radius_m);
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(impl_->scene, &query, &context, visit, &search);
  return search.answer;
}

std::size_t EmbreeClosest::bytes() const noexcept {
  return sizeof(*impl_) + impl_->triangles.capacity() * sizeof(impl_->triangles[0]) +
         static_cast<std::size_t>(std::max<ssize_t>(impl_->device_bytes, 0));
}

}  // namespace sqmap::bench
