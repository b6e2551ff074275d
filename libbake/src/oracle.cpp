// SPDX-License-Identifier: GPL-3.0-or-later
#include "sqmap/bake/oracle.hpp"

#include <cmath>
#include <limits>

#include "mesh_boxes.hpp"
#include "winding_tree.hpp"

namespace sqmap::bake {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

}  // namespace

struct Oracle::Impl {
  explicit Impl(const Mesh& mesh)
      : boxes(mesh), winding(mesh.vertices_m, mesh.faces), is_empty(mesh.faces.empty()) {}

  MeshBoxes boxes;
  WindingTree winding;
  bool is_empty;
};

Oracle::Oracle(const Mesh& mesh) : impl_(std::make_unique<Impl>(mesh)) {}
Oracle::~Oracle() = default;
Oracle::Oracle(Oracle&&) noexcept = default;
Oracle& Oracle::operator=(Oracle&&) noexcept = default;

Oracle::Answer Oracle::nearest(const Vec3d& p_m, double at_most_m) const {
  if (impl_->is_empty || !std::isfinite(p_m.x + p_m.y + p_m.z)) return {kNan, {kNan, kNan, kNan}, kNewFace};
  return impl_->boxes.nearest(p_m, at_most_m);
}

double Oracle::winding_number(const Vec3d& p_m) const { return impl_->winding.at(p_m); }

int Oracle::rounded_winding_number(const Vec3d& p_m) const { return impl_->winding.rounded_at(p_m); }

bool Oracle::inside(const Vec3d& p_m) const { return rounded_winding_number(p_m) > 0; }

double Oracle::signed_distance(const Vec3d& p_m) const {
  const double distance_m = nearest(p_m).distance_m;
  return inside(p_m) ? -distance_m : distance_m;
}

RayTracer::RayTracer(const Mesh& mesh) : boxes_(std::make_unique<MeshBoxes>(mesh)) {}
RayTracer::~RayTracer() = default;
RayTracer::RayTracer(RayTracer&&) noexcept = default;
RayTracer& RayTracer::operator=(RayTracer&&) noexcept = default;

void RayTracer::trace(const Vec3d& origin_m, const Vec3d& direction, std::vector<Hit>& hits) const {
  const Ray ray{origin_m, direction};
  boxes_->trace({&ray, 1}, false, {&hits, 1});
}

void RayTracer::trace_line(const Vec3d& origin_m, const Vec3d& direction, std::vector<Hit>& hits) const {
  const Ray ray{origin_m, direction};
  boxes_->trace({&ray, 1}, true, {&hits, 1});
}

void RayTracer::trace_lines(std::span<const Ray> lines, std::span<std::vector<Hit>> hits) const {
  boxes_->trace(lines, true, hits);
}

}  // namespace sqmap::bake
