// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/scene.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "scene_effects.hpp"

namespace sqmap::runtime {
namespace {

/// What layer 1 needs of a part: no map.
struct Shape {
  SuperquadricOf<float> shape;
  Rotation<float> object_from_part;
  Vec3f translation_m;
};

/// An object of the scene. Its own frame is the object's with scale and mirror applied: rigid to the world.
struct Body {
  std::size_t asset;               ///< index of its tables
  std::optional<Instance> scaled;  ///< of the object in the own frame; none in layer 1
  float scale;
  bool mirrored;
  Quaternion orientation;
  Rotation<double> world_from_body;  ///< the same
  Vec3d translation_m;
  Vec3f centre_m;  ///< of the bounding sphere, own frame
  float radius_m;
  std::vector<Stage> stages;  ///< effects on contacts, with a memory for this body
  std::vector<Contact> contacts;
  std::size_t contact_count{};
  Vec3d probe_m{};     ///< where the probe's origin is in this frame, own frame
  bool is_reached{};   ///< by the probe's ball in this frame
  bool was_touched{};  ///< in the frame before
};

/// A double rounded to float may fall short of itself by less than this.
constexpr double kWiden = 1.000001;

bool is_finite(const Vec3d& v) noexcept {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}
bool is_finite(const Pose& pose) noexcept {
  const Quaternion& q = pose.orientation;
  return is_finite(pose.translation_m) && std::isfinite(q.w + q.x + q.y + q.z);
}

/// The turn that takes b's frame to a's: a^-1 b.
Quaternion relative(const Quaternion& a, const Quaternion& b) noexcept {
  return {a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z, a.w * b.x - a.x * b.w - a.y * b.z + a.z * b.y,
          a.w * b.y + a.x * b.z - a.y * b.w - a.z * b.x, a.w * b.z - a.x * b.y + a.y * b.x - a.z * b.w};
}

Outcome check(const Probe& probe) {
  const std::size_t count = probe.points_m.size();
  if ((!probe.weight_m2.empty() && probe.weight_m2.size() != count) ||
      (!probe.zone.empty() && probe.zone.size() != count))
    return Error{Status::kBadOption,
                 "the probe has " + std::to_string(count) + " points, " +
                     std::to_string(probe.weight_m2.size()) + " weights and " +
                     std::to_string(probe.zone.size()) + " zones",
                 "as many as points, or none"};
  if (std::ranges::any_of(probe.zone, [count](std::uint32_t zone) { return zone >= count; }))
    return Error{Status::kBadOption, "the probe has a zone with a number beyond its points",
                 "number zones from 0 without gaps"};
  return Done{};
}

}  // namespace

struct Scene::Impl {
  Probe probe;
  std::optional<PointBody> blocks;  ///< the probe's points; none in layer 1
  float probe_radius_m{};           ///< around the probe's origin
  QueryOptions query;
  std::vector<std::unique_ptr<Object>> objects;  ///< one an asset, where instances find it; empty in layer 1
  std::vector<std::vector<Shape>> shapes;        ///< the same, layer 1 only
  std::vector<Body> bodies;
  std::vector<Stage> total_stages;  ///< effects on the total
  std::vector<Vec3f> points_m;      ///< of the probe, in the frame of the body at hand; layer 1 only
  std::vector<Vec3f> force_n;
  std::size_t part_count{};

  Outcome add_asset(const Asset& asset);
  Outcome add_body(const SceneObject& object, std::size_t asset, const SceneOptions& options);
  /// Finds the bodies that the probe reaches. @return how many
  std::size_t reach(const Pose& world_from_probe) noexcept;
  FrameResult frame(const Pose& world_from_probe, const Vec3d& about_m, float step_s,
                    WorkBudget* budget) noexcept;
  void touch(Body& body, const BodyState& state, FrameResult& result) noexcept;
  std::uint32_t count_inside(const Body& body, const Pose& body_from_probe, bool& finite) noexcept;
};

Scene::Scene(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Scene::~Scene() = default;
Scene::Scene(Scene&&) noexcept = default;
Scene& Scene::operator=(Scene&&) noexcept = default;

Outcome Scene::Impl::add_asset(const Asset& asset) {
  if (query.layer != Layer::kOne) {
    Result<Object> object = Object::build(asset);
    if (!object) return object.error();
    objects.push_back(std::make_unique<Object>(std::move(object).value()));
    return Done{};
  }
  std::vector<Shape>& all = shapes.emplace_back();
  for (const Part& part : asset.parts)
    all.push_back({{cast<float>(part.shape.semi_axes_m),
                    static_cast<float>(part.shape.e1),
                    static_cast<float>(part.shape.e2),
                    static_cast<float>(part.shape.taper),
                    {static_cast<float>(part.shape.bend.x), static_cast<float>(part.shape.bend.y)}},
                   rotation<float>(part.object_from_part.orientation),
                   cast<float>(part.object_from_part.translation_m)});
  return Done{};
}

Outcome Scene::Impl::add_body(const SceneObject& object, std::size_t asset, const SceneOptions& options) {
  const Placement& placement = object.placement;
  if (!(placement.scale >= kLeastScale && placement.scale <= kMostScale) ||
      !is_finite(placement.world_from_object))
    return Error{Status::kBadOption,
                 "the placement is not a finite rigid transform with a scale in [1e-9, 1e9]",
                 "other transforms would change distances by direction"};
  std::optional<Instance> scaled;
  if (!objects.empty()) {
    const Result<Instance> placed =
        Instance::place(*objects[asset], Placement{{}, placement.scale, placement.mirrored});
    if (!placed) return placed.error();
    scaled = placed.value();
  }
  Result<std::vector<Stage>> stages = make_stages(options.effects, probe);
  if (!stages) return stages.error();
  std::erase_if(stages.value(), [](const Stage& stage) { return stage.limit != nullptr; });
  Vec3d centre_m = placement.scale * object.asset->sphere.centre_m;
  if (placement.mirrored) centre_m.x = -centre_m.x;
  bodies.push_back(
      {asset, scaled, static_cast<float>(placement.scale), placement.mirrored,
       placement.world_from_object.orientation, rotation(placement.world_from_object.orientation),
       placement.world_from_object.translation_m, cast<float>(centre_m),
       static_cast<float>(placement.scale * object.asset->sphere.radius_m * kWiden),
       std::move(stages).value(), std::vector<Contact>(objects.empty() ? 0 : probe.points_m.size())});
  part_count += object.asset->parts.size();
  return Done{};
}

Result<Scene> Scene::build(std::span<const SceneObject> objects, Probe probe, const SceneOptions& options) {
  if (const Outcome ok = check(probe); !ok) return ok.error();
  if (options.query.layer == Layer::kOne && !options.effects.empty())
    return Error{Status::kBadOption,
                 "effect \"" + options.effects.front().name + "\" needs a depth, which layer 1 does not have",
                 "ask for layer 2, 3 or auto, or name no effect"};
  auto impl = std::make_unique<Impl>();
  impl->query = options.query;
  double reach_m = 0;
  for (const Vec3f& p : probe.points_m) reach_m = std::max(reach_m, norm(cast<double>(p)));
  impl->probe_radius_m = static_cast<float>(reach_m * kWiden);
  impl->probe = std::move(probe);

  std::vector<const Asset*> assets;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const std::string where = "object " + std::to_string(i) + ": ";
    if (objects[i].asset == nullptr)
      return Error{Status::kBadOption, where + "it has no asset", "give it one"};
    const auto known = std::ranges::find(assets, objects[i].asset);
    const auto asset = static_cast<std::size_t>(known - assets.begin());
    Outcome ok = Done{};
    if (known == assets.end()) {
      assets.push_back(objects[i].asset);
      ok = impl->add_asset(*objects[i].asset);
    }
    if (ok) ok = impl->add_body(objects[i], asset, options);
    if (!ok) return Error{ok.error().status, where + ok.error().finding, ok.error().remedy};
  }
  Result<std::vector<Stage>> stages = make_stages(options.effects, impl->probe);
  if (!stages) return stages.error();
  impl->total_stages = std::move(stages).value();
  std::erase_if(impl->total_stages, [](const Stage& stage) { return stage.limit == nullptr; });
  if (options.query.layer == Layer::kOne) {
    impl->points_m.resize(impl->probe.points_m.size());
    return Scene(std::move(impl));
  }
  Result<PointBody> blocks = PointBody::build(impl->probe.points_m);
  if (!blocks) return blocks.error();
  impl->blocks.emplace(std::move(blocks).value());
  impl->force_n.resize(impl->probe.points_m.size());
  return Scene(std::move(impl));
}

std::uint32_t Scene::Impl::count_inside(const Body& body, const Pose& body_from_probe,
                                        bool& finite) noexcept {
  const auto turn = rotation<float>(body_from_probe.orientation);
  const Vec3f origin_m = cast<float>(body_from_probe.translation_m);
  for (std::size_t i = 0; i < points_m.size(); ++i) points_m[i] = turn.apply(probe.points_m[i]) + origin_m;
  std::uint32_t count = 0;
  const float shrink = 1 / body.scale;
  for (const Vec3f& p : points_m) {
    if (!is_finite(cast<double>(p))) finite = false;
    Vec3f q = shrink * p;
    if (body.mirrored) q.x = -q.x;
    count += std::ranges::any_of(shapes[body.asset], [&](const Shape& s) {
      return inside_outside_radial(s.shape, s.object_from_part.apply_inverse(q - s.translation_m)) <= 1;
    });
  }
  return count;
}

void Scene::Impl::touch(Body& body, const BodyState& state, FrameResult& result) noexcept {
  Field field{&*body.scaled, query};
  const Found found = body.is_reached ? find_touches(field, state, body.contacts) : Found{};
  // What effects ask besides must not be deeper than what was afforded.
  const Layer asked = query.layer == Layer::kAuto ? Layer::kThree : query.layer;
  if (state.budget != nullptr && state.budget->layer < asked) field.options.layer = state.budget->layer;
  body.contact_count = found.count;
  Touches touches{field, state, std::span(body.contacts).first(found.count),
                  std::span(force_n).first(found.count)};
  std::ranges::fill(touches.force_n, Vec3f{});
  for (const Stage& stage : body.stages)
    if (stage.touch != nullptr) stage.touch(stage.effect.get(), touches);
  Wrench wrench = total(touches);
  for (const Stage& stage : body.stages)
    if (stage.sum != nullptr) stage.sum(stage.effect.get(), touches, wrench);

  if (result.layer == Layer::kAuto && found.count > 0)
    result.layer = body.scaled->object().layer_of(body.contacts[0].part, field.options);
  result.inside += static_cast<std::uint32_t>(found.count);
  result.wrench.contacts += static_cast<std::uint32_t>(found.count);
  result.wrench.is_finite = result.wrench.is_finite && wrench.is_finite && found.is_finite;
  const auto to_world = [&](const Vec3f& v) {
    return cast<float>(body.world_from_body.apply(cast<double>(v)));
  };
  result.wrench.force_n = result.wrench.force_n + to_world(wrench.force_n);
  result.wrench.torque_nm = result.wrench.torque_nm + to_world(wrench.torque_nm);
}

std::size_t Scene::Impl::reach(const Pose& world_from_probe) noexcept {
  std::size_t count = 0;
  for (Body& body : bodies) {
    body.was_touched = body.contact_count > 0;
    body.contact_count = 0;
    body.probe_m = body.world_from_body.apply_inverse(world_from_probe.translation_m - body.translation_m);
    body.is_reached =
        norm(cast<float>(body.probe_m) - body.centre_m) <= probe_radius_m + body.radius_m;  // NaN: no
    count += body.is_reached ? 1 : 0;
  }
  return count;
}

FrameResult Scene::Impl::frame(const Pose& world_from_probe, const Vec3d& about_m, float step_s,
                               WorkBudget* budget) noexcept {
  FrameResult result;
  const bool finite = is_finite(world_from_probe) && is_finite(about_m);
  std::size_t left = reach(world_from_probe);
  if (!finite) left = 0;
  if (budget != nullptr) {
    budget->spent = 0;
    budget->layer = Layer::kAuto;
  }
  for (Body& body : bodies) {
    // The effects of a body that was left at one leap must learn that its contacts have ended.
    if (!finite || !(body.is_reached || body.was_touched)) continue;
    const Pose body_from_probe{relative(body.orientation, world_from_probe.orientation), body.probe_m};
    if (objects.empty()) {
      result.inside += count_inside(body, body_from_probe, result.wrench.is_finite);
      result.layer = Layer::kOne;
      continue;
    }
    WorkBudget* const shared = body.is_reached ? budget : nullptr;
    WorkBudget share;
    if (shared != nullptr) share.units = (budget->units - std::min(budget->spent, budget->units)) / left--;
    BodyState state;
    state.weight_m2 = probe.weight_m2;
    state.about_m = cast<float>(body.world_from_body.apply_inverse(about_m - body.translation_m));
    state.step_s = step_s;
    state.body = &*blocks;
    state.at = {body_from_probe};
    state.budget = shared != nullptr ? &share : nullptr;
    touch(body, state, result);
    if (shared == nullptr) continue;
    budget->spent += share.spent;
    budget->level = share.level;
    if (budget->layer == Layer::kAuto || share.layer < budget->layer) budget->layer = share.layer;
  }
  result.wrench.is_finite = result.wrench.is_finite && finite;
  result.wrench = finite_or_zero(result.wrench);
  for (const Stage& stage : total_stages) stage.limit(stage.effect.get(), step_s, result.wrench);
  if (!result.wrench.is_finite) result.wrench.force_n = result.wrench.torque_nm = {};
  return result;
}

FrameResult Scene::frame(const Pose& world_from_probe, const Vec3d& about_m, float step_s) noexcept {
  return impl_->frame(world_from_probe, about_m, step_s, nullptr);
}

FrameResult Scene::frame(const Pose& world_from_probe, const Vec3d& about_m, float step_s,
                         WorkBudget& budget) noexcept {
  return impl_->frame(world_from_probe, about_m, step_s, &budget);
}

std::span<const Contact> Scene::contacts(std::size_t object) const noexcept {
  const Body& body = impl_->bodies[object];
  return std::span(body.contacts).first(body.contact_count);
}

std::size_t Scene::part_count() const noexcept { return impl_->part_count; }

std::size_t Scene::resident_bytes() const noexcept {
  const Impl& s = *impl_;
  const auto stages_bytes = [](const std::vector<Stage>& stages) {
    std::size_t bytes = stages.capacity() * sizeof(Stage);
    for (const Stage& stage : stages) bytes += stage.memory_bytes;
    return bytes;
  };
  std::size_t bytes = sizeof(Scene) + sizeof(Impl) + stages_bytes(s.total_stages);
  bytes += (s.points_m.capacity() + s.force_n.capacity() + s.probe.points_m.capacity()) * sizeof(Vec3f);
  bytes += s.probe.weight_m2.capacity() * sizeof(float) + s.probe.zone.capacity() * sizeof(std::uint32_t);
  if (s.blocks) bytes += s.blocks->resident_bytes();
  for (const auto& object : s.objects) bytes += object->resident_bytes();
  for (const auto& shapes : s.shapes) bytes += sizeof(std::vector<Shape>) + shapes.capacity() * sizeof(Shape);
  for (const Body& body : s.bodies)
    bytes += sizeof(Body) + body.contacts.capacity() * sizeof(Contact) + stages_bytes(body.stages);
  return bytes;
}

}  // namespace sqmap::runtime
