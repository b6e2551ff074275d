// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/object.hpp"

#include <algorithm>
#include <cmath>

#include "sqmap/asset/validate.hpp"

#include "certainty.hpp"
#include "chart.hpp"
#include "combine.hpp"
#include "engine.hpp"
#include "part_shape.hpp"
#include "resident.hpp"

namespace sqmap::runtime {

struct Object::Impl {
  explicit Impl(const Asset& asset) : resident(asset), sphere(sphere_around(asset)), r_max_m(asset.r_max_m) {
    for (const Part& part : asset.parts) {
      level_count = std::max(level_count, part.map.level_count);
      bound_tolerance_m = part.bounds.cells > 0 ? std::max(bound_tolerance_m, part.bounds.tolerance_m)
                                                : std::numeric_limits<double>::quiet_NaN();
    }
  }
  Resident resident;
  BoundingSphere sphere;
  double r_max_m;
  double bound_tolerance_m = 0;
  std::uint32_t level_count = 0;
};

Object::Object(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Object::~Object() = default;
Object::Object(Object&&) noexcept = default;
Object& Object::operator=(Object&&) noexcept = default;

Result<Object> Object::build(const Asset& asset) {
  const auto findings = validate(asset, CheckLevel::kQuick);
  if (!findings.empty()) {
    return Error{Status::kInvalidAsset, findings.front().message, "bake the mesh again"};
  }
  auto impl = std::make_unique<Impl>(asset);
  if (!impl->resident.fits()) {
    return Error{Status::kInvalidAsset,
                 "the maps need more than 4 GiB in memory, the most an object may hold",
                 "bake the mesh with fewer or smaller maps"};
  }
  return Object(std::move(impl));
}

Answer Object::query(const Vec3f& p_m, const QueryOptions& options) const noexcept {
  const Resident& resident = impl_->resident;
  Answer answer;
  if (!is_finite(p_m)) return answer;
  const Vec3f p = resident.from_metres(p_m);
  if (!in_ball(p, resident.sphere_centre(), resident.sphere_square())) return answer;

  // Charts overlap. The nearest represented surface tells the distance, and the side too, unless another
  // chart's ray leaves far less doubt.
  const float edge = resident.units_per_m() * options.edge_length_m;
  float nearest = std::numeric_limits<float>::infinity();
  float sharpest = -1;
  bool nearest_inside = false, nearest_faces = false;
  float nearest_certainty = 0, offset = 0;
  for (std::uint32_t k = 0; k < resident.part_count(); ++k) {
    const PartRecord& part = resident.part(k);
    if (!in_ball(p, part.sphere_centre, part.sphere_square)) continue;
    const Vec3f p_part = part.to_part(p);
    if (!in_superquadric(part, p_part)) continue;
    const Layer layer = layer_for(part, options);
    answer.layer = std::max(answer.layer, layer);
    if (layer == Layer::kOne) {
      answer.part = k;
      answer.inside = true;
      answer.normal = part.object_from_part.apply(shape_normal(part, p_part));
      return answer;
    }
    ShapeTable<float> table;
    resident.unpack(part, table);
    const ChartAnswer here =
        Chart(resident, part, table).look(p_part, layer == Layer::kThree, options.level, edge);
    if (here.certainty > sharpest) {
      sharpest = here.certainty;
      answer.inside = here.inside;
      if (answer.part == kNowhere) answer.part = k;
    }
    if (here.distance < nearest) {
      nearest = here.distance;
      answer.part = k;
      answer.normal = part.object_from_part.apply(here.normal);
      answer.surface_m = resident.to_metres(part.to_object(here.surface));
      nearest_faces = here.faces_patch;
      offset = here.offset;
      nearest_inside = here.inside;
      nearest_certainty = here.certainty;
    }
  }
  if (nearest_faces && sharpest < kOverrule * nearest_certainty) answer.inside = nearest_inside;
  if (std::isfinite(nearest)) {
    answer.signed_distance_m = resident.unit_m() * ((answer.inside ? -nearest : nearest) - offset);
  }
  return answer;
}

void Object::query(std::span<const Vec3f> points_m, const Answers& answers,
                   const QueryOptions& options) const noexcept {
  kernels().query(impl_->resident, points_m, answers, options);
}

void Object::certainty(std::span<const Vec3f> points_m, std::span<Certainty> told) const noexcept {
  for (std::size_t i = 0; i < points_m.size(); ++i) told[i] = certainty_of(impl_->resident, points_m[i]);
}

Certainty Object::certainty(const Vec3f& p_m) const noexcept { return certainty_of(impl_->resident, p_m); }

double Object::certainty_tolerance_m() const noexcept { return impl_->bound_tolerance_m; }

void Object::query(const PointBody& body, const BodyPlacement& placement, const Answers& answers,
                   const QueryOptions& options) const noexcept {
  kernels().query_body(impl_->resident, body.data(), placement, answers, options);
}

std::size_t Object::contacts(const PointBody& body, const BodyPlacement& placement,
                             std::span<Contact> contacts, const ContactQuery& query) const noexcept {
  return kernels().contacts(impl_->resident, body.data(), placement, contacts, query, nullptr);
}

std::size_t Object::contacts(const PointBody& body, const BodyPlacement& placement,
                             std::span<Contact> contacts, const ContactQuery& query,
                             WorkBudget& budget) const noexcept {
  return kernels().contacts(impl_->resident, body.data(), placement, contacts, query, &budget);
}

std::size_t Object::part_count() const noexcept { return impl_->resident.part_count(); }
Layer Object::layer_of(std::uint32_t part, const QueryOptions& options) const noexcept {
  return layer_for(impl_->resident.part(part), options);
}
std::uint32_t Object::level_count() const noexcept { return impl_->level_count; }
const BoundingSphere& Object::sphere() const noexcept { return impl_->sphere; }
double Object::r_max_m() const noexcept { return impl_->r_max_m; }

std::size_t Object::resident_bytes() const noexcept {
  return sizeof(Object) + sizeof(Impl) + impl_->resident.size();
}

}  // namespace sqmap::runtime
