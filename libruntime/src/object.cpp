// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/object.hpp"

#include <cmath>

#include "sqmap/asset/validate.hpp"

#include "chart.hpp"

namespace sqmap::runtime {

/// Charts in the asset's order of parts.
struct Object::Impl {
  std::vector<Chart<float>> charts;
  BoundingSphere sphere;
  Vec3f sphere_centre_m;
  float sphere_radius_m{};
  double r_max_m{};
  std::uint32_t level_count{};
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
  auto impl = std::make_unique<Impl>();
  impl->sphere = asset.sphere;
  impl->sphere_centre_m = cast<float>(asset.sphere.centre_m);
  impl->sphere_radius_m = rounded_up(asset.sphere.radius_m);
  impl->r_max_m = asset.r_max_m;
  impl->charts.reserve(asset.parts.size());
  for (const Part& part : asset.parts) {
    impl->charts.emplace_back(part);
    impl->level_count = std::max(impl->level_count, part.map.level_count);
  }
  return Object(std::move(impl));
}

namespace {

Layer layer_for(const Chart<float>& chart, const QueryOptions& options) noexcept {
  if (options.layer != Layer::kAuto) return options.layer;
  return chart.texels_at(options.level) < kLayerThreshold * chart.vertex_count() ? Layer::kThree
                                                                                 : Layer::kTwo;
}

bool is_finite(const Vec3f& p) noexcept {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

// How many times as certain as the chart of the nearest surface another chart must be to decide the side.
// Misclassified in the +-0.5 % shell, mean of five samples: 6.33 % at 1, 6.10 % at 4, 6.11 % at 1000.
constexpr float kOverrule = 4;

bool in_ball(const Vec3f& p_m, const Vec3f& centre_m, float radius_m) noexcept {
  const Vec3f d = p_m - centre_m;
  return dot(d, d) <= radius_m * radius_m;
}

}  // namespace

Answer Object::query(const Vec3f& p_m, const QueryOptions& options) const noexcept {
  Answer answer;
  if (!is_finite(p_m)) return answer;
  if (!in_ball(p_m, impl_->sphere_centre_m, impl_->sphere_radius_m)) return answer;

  // Charts overlap. The nearest represented surface tells the distance, and the side too, unless another
  // chart's ray leaves far less doubt.
  float nearest_m = std::numeric_limits<float>::infinity();
  float sharpest = -1;
  bool nearest_inside = false, nearest_faces = false;
  float offset_m = 0;
  float nearest_certainty = 0;
  for (std::size_t k = 0; k < impl_->charts.size(); ++k) {
    const Chart<float>& chart = impl_->charts[k];
    if (!in_ball(p_m, chart.sphere_centre_m(), chart.sphere_radius_m())) continue;
    const Vec3f p_part_m = chart.to_part(p_m);
    if (!(chart.inside_outside_radial(p_part_m) <= 1)) continue;
    const Layer layer = layer_for(chart, options);
    answer.layer = std::max(answer.layer, layer);
    if (layer == Layer::kOne) {
      answer.part = static_cast<std::uint32_t>(k);
      answer.inside = true;
      answer.normal = chart.to_object_direction(chart.normal_at(p_part_m));
      return answer;
    }
    const ChartAnswer<float> here =
        chart.look(p_part_m, layer == Layer::kThree, options.level, options.edge_length_m);
    if (here.certainty > sharpest) {
      sharpest = here.certainty;
      answer.inside = here.inside;
      if (answer.part == kNowhere) answer.part = static_cast<std::uint32_t>(k);
    }
    if (here.distance_m < nearest_m) {
      nearest_m = here.distance_m;
      answer.part = static_cast<std::uint32_t>(k);
      answer.normal = chart.to_object_direction(here.normal);
      answer.surface_m = chart.to_object(here.surface_m);
      nearest_faces = here.faces_patch;
      offset_m = here.offset_m;
      nearest_inside = here.inside;
      nearest_certainty = here.certainty;
    }
  }
  if (nearest_faces && sharpest < kOverrule * nearest_certainty) answer.inside = nearest_inside;
  if (std::isfinite(nearest_m))
    answer.signed_distance_m = (answer.inside ? -nearest_m : nearest_m) - offset_m;
  return answer;
}

void Object::query(std::span<const Vec3f> points_m, const Answers& answers,
                   const QueryOptions& options) const noexcept {
  for (std::size_t i = 0; i < points_m.size(); ++i) {
    const Answer answer = query(points_m[i], options);
    if (!answers.signed_distance_m.empty()) answers.signed_distance_m[i] = answer.signed_distance_m;
    if (!answers.normal.empty()) answers.normal[i] = answer.normal;
    if (!answers.surface_m.empty()) answers.surface_m[i] = answer.surface_m;
    if (!answers.part.empty()) answers.part[i] = answer.part;
    if (!answers.layer.empty()) answers.layer[i] = static_cast<std::uint8_t>(answer.layer);
    if (!answers.inside.empty()) answers.inside[i] = answer.inside ? 1 : 0;
  }
}

std::size_t Object::part_count() const noexcept { return impl_->charts.size(); }
std::uint32_t Object::level_count() const noexcept { return impl_->level_count; }
const BoundingSphere& Object::sphere() const noexcept { return impl_->sphere; }
double Object::r_max_m() const noexcept { return impl_->r_max_m; }

std::size_t Object::resident_bytes() const noexcept {
  std::size_t bytes = sizeof(Object) + sizeof(Impl);
  for (const auto& chart : impl_->charts) bytes += chart.bytes();
  return bytes;
}

}  // namespace sqmap::runtime
