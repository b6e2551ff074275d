// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/scene.hpp"

#include <cmath>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "sqmap/runtime/body.hpp"
#include "sqmap/runtime/budget.hpp"
#include "sqmap/runtime/effects/force_model.hpp"
#include "sqmap/runtime/effects/friction.hpp"
#include "sqmap/runtime/effects/reaction.hpp"

#include "no_allocation.hpp"
#include "support/energy.hpp"
#include "touch_shapes.hpp"

namespace sqmap::runtime {
namespace {

const Asset& ball_asset() {
  static const Asset asset = test::ball_in_ellipsoid(test::kBallRadius_m, 65, 128);
  return asset;
}

Scene built(const std::vector<SceneObject>& objects, Probe probe, const SceneOptions& options) {
  auto scene = Scene::build(objects, std::move(probe), options);
  EXPECT_TRUE(scene.ok()) << (scene ? "" : scene.error().finding);
  return std::move(scene).value();
}

SceneOptions with(std::vector<EffectChoice> effects, Layer layer = Layer::kThree) {
  SceneOptions options;
  options.query.layer = layer;
  options.effects = std::move(effects);
  return options;
}

std::vector<EffectChoice> all_effects() {
  std::vector<EffectChoice> choices;
  for (const EffectInfo& info : effect_table()) choices.push_back({info.name, {}});
  return choices;
}

Pose at(const Vec3d& p_m) { return {{}, p_m}; }

TEST(Scene, EqualsTheModelComposedAtCompileTime) {
  const auto points = test::sphere_points(400, 0.2, {});
  Scene scene =
      built({{&ball_asset(), {}}}, {points}, with({{"friction", {{"coefficient", 0.7F}}}, {"reaction", {}}}));
  const Result<Object> object = Object::build(ball_asset());
  const Result<Instance> instance = Instance::place(object.value(), Placement{});
  Friction friction;
  friction.coefficient = 0.7F;
  ForceModel model(Reaction{}, friction);
  ASSERT_TRUE(model.prepare(points.size()).ok());
  const Result<PointBody> body = PointBody::build(points);
  for (int frame = 0; frame < 50; ++frame) {
    const Vec3d p = test::kBallCentre_m + Vec3d{0.002 * frame, 0, 0.95};
    BodyState state;
    state.body = &body.value();
    state.at = {at(p)};
    const Vec3f expected = model.frame({&instance.value(), {Layer::kThree}}, state).force_n;
    ASSERT_EQ(scene.frame(at(p), {}, 1e-3F).wrench.force_n, expected);
    ASSERT_GT(norm(expected), 1);
  }
}

// The blocks of the probe are culled and answered together; asked point by point, in the world instead of the
// object's frame, the forces are the same but for rounding.
TEST(Scene, ForcesAreThoseOfThePointsOneByOne) {
  constexpr float kStiffness_n_per_m = 500;
  const auto points = test::sphere_points(700, 0.3, {0.1, 0.2, -0.1});
  const std::vector<Placement> placements{{{{0.9, 0.1, -0.3, 0.2}, {-1, 0.5, 0}}, 0.8},
                                          {{{0.2, 0.7, 0.1, -0.4}, {1, 0, 0.3}}, 1.3, true}};
  std::vector<SceneObject> objects;
  for (const Placement& placement : placements) objects.push_back({&ball_asset(), placement});
  Scene scene = built(objects, {points}, with({{"reaction", {{"stiffness_n_per_m", kStiffness_n_per_m}}}}));
  const Result<Object> object = Object::build(ball_asset());
  std::size_t touching = 0;
  for (int frame = 0; frame < 60; ++frame) {
    const double turn = 0.1 * frame;
    const Pose pose{{std::cos(turn), 0.3, std::sin(turn), 0},
                    {0.09 * (frame - 30), 0.3 * std::sin(turn), 0.1}};
    const Rotation<double> rotated = rotation(pose.orientation);
    Vec3d expected_n;
    double sum_n = 0;
    std::size_t expected = 0;
    for (const Placement& placement : placements) {
      const Result<Instance> instance = Instance::place(object.value(), placement);
      for (const Vec3f& q : points) {
        const Vec3f p = cast<float>(rotated.apply(cast<double>(q)) + pose.translation_m);
        const Answer answer = instance.value().query(p, {Layer::kThree});
        if (!(answer.signed_distance_m < 0)) continue;
        const double push_n = kStiffness_n_per_m * -static_cast<double>(answer.signed_distance_m);
        expected_n = expected_n + push_n * cast<double>(answer.normal);
        sum_n += push_n;
        ++expected;
      }
    }
    const FrameResult result = scene.frame(pose, {}, 1e-3F);
    // A point within rounding of the surface, or between two facets, may be answered either way.
    EXPECT_NEAR(static_cast<double>(result.inside), static_cast<double>(expected), 2);
    EXPECT_LT(norm(cast<double>(result.wrench.force_n) - expected_n), 1e-3 * sum_n + 1e-3);
    touching += expected > 0 ? 1 : 0;
  }
  EXPECT_GT(touching, 20U);
  EXPECT_LT(touching, 60U);
}

// Objects out of reach spend nothing; the others share what there is, and what they had to do with is told.
TEST(Scene, StaysWithinItsBudgetAndSaysWhichLayerItAfforded) {
  const auto points = test::sphere_points(2000, 0.3, {});
  const std::vector<SceneObject> objects{{&ball_asset(), {at({-1.0, 0, 0})}},
                                         {&ball_asset(), {at({1.0, 0, 0})}},
                                         {&ball_asset(), {at({9.0, 0, 0})}}};
  Scene scene = built(objects, {points}, with({{"reaction", {}}}));
  const Pose middle = at(test::kBallCentre_m);
  const FrameResult free = scene.frame(middle, {}, 1e-3F);
  WorkBudget ample{1000000};
  const FrameResult deep = scene.frame(middle, {}, 1e-3F, ample);
  EXPECT_EQ(deep.wrench.force_n, free.wrench.force_n);
  EXPECT_EQ(ample.layer, Layer::kThree);
  EXPECT_GT(ample.spent, 1000U);
  std::uint64_t last = ample.spent + 1;
  for (const auto& [share, layer] : {std::pair{1.0, Layer::kThree}, {0.6, Layer::kTwo}, {0.3, Layer::kOne}}) {
    WorkBudget budget{static_cast<std::uint64_t>(share * static_cast<double>(ample.spent))};
    const FrameResult result = scene.frame(middle, {}, 1e-3F, budget);
    EXPECT_EQ(budget.layer, layer) << share;
    EXPECT_LE(budget.spent, budget.units);
    EXPECT_LT(budget.spent, last);
    last = budget.spent;
    EXPECT_EQ(result.layer, layer);
    EXPECT_EQ(norm(result.wrench.force_n) > 0, layer != Layer::kOne);
  }
  WorkBudget away{1};
  scene.frame(at({0, 50, 0}), {}, 1e-3F, away);
  EXPECT_EQ(away.spent, 0U);
  EXPECT_EQ(away.layer, Layer::kAuto);
}

TEST(Scene, ForceTurnsAndGrowsWithTheObject) {
  // The same touch, the object turned, moved, mirrored and twice as large.
  const Quaternion turn{0.5, 0.5, -0.5, 0.5};
  const Placement placement{{turn, {3, -2, 1}}, 2, true};
  const auto points = test::sphere_points(400, 0.2, {});
  std::vector<Vec3f> large;
  for (const Vec3f& p : points) large.push_back(2.0F * p);
  const auto effects = with({{"reaction", {}}, {"torque", {}}, {"impact_zones", {}}});
  Scene plain = built({{&ball_asset(), {}}}, {points}, effects),
        placed = built({{&ball_asset(), placement}}, {large}, effects);
  const Vec3d p = test::kBallCentre_m + 0.95 * normalized(Vec3d{1, 2, 3});
  const auto to_world = [&](Vec3d q) {
    q.x = -q.x;
    return rotation(turn).apply(2.0 * q) + placement.world_from_object.translation_m;
  };
  const Wrench a = plain.frame(at(p), p, 1e-3F).wrench,
               b = placed.frame(at(to_world(p)), to_world(p), 1e-3F).wrench;
  const Vec3d n = normalized(p - test::kBallCentre_m);
  const Vec3d expected = to_world(test::kBallCentre_m + n) - to_world(test::kBallCentre_m);
  EXPECT_NEAR(norm(b.force_n), 2 * norm(a.force_n), 0.02 * norm(b.force_n));
  EXPECT_GT(dot(normalized(expected), normalized(cast<double>(b.force_n))), 0.999);
}

TEST(Scene, SumsTheForcesOfItsObjects) {
  const Placement left{at({-1.0, 0, 0})}, right{at({1.0, 0, 0})};
  const auto points = test::sphere_points(2000, 0.3, {});
  const Pose middle = at(test::kBallCentre_m);
  const auto force = [&](const std::vector<SceneObject>& objects) {
    return built(objects, {points}, with({{"reaction", {}}})).frame(middle, {}, 1e-3F).wrench.force_n;
  };
  const Vec3f both = force({{&ball_asset(), left}, {&ball_asset(), right}});
  const Vec3f a = force({{&ball_asset(), left}}), b = force({{&ball_asset(), right}});
  EXPECT_GT(norm(a), 100);
  EXPECT_LT(norm(both - a - b), 1e-3 * norm(a));
}

TEST(Scene, WhatIsNotNamedIsNotStored) {
  const auto points = test::sphere_points(1000, 0.2, {});
  const auto bytes = [&](std::vector<EffectChoice> effects) {
    return built({{&ball_asset(), {}}}, {points}, with(std::move(effects))).resident_bytes();
  };
  const std::size_t plain = bytes({{"reaction", {}}});
  EXPECT_GE(bytes({{"reaction", {}}, {"friction", {}}}), plain + 28000);
  EXPECT_LT(bytes({{"reaction", {}}, {"texture", {}}, {"torque", {}}}), plain + 1000);
  EXPECT_GT(bytes(all_effects()), plain + 56000);
}

// A ball's surface is that of its bounding sphere: who leaves the one is out of reach of the other.
TEST(Scene, ABodyLeftAtOneLeapIsForgottenByItsEffects) {
  Scene scene = built({{&ball_asset(), {}}}, {{{0, 0, 0}}}, with({{"reaction", {}}, {"friction", {}}}));
  const auto force_n = [&](double turn, double radius_m) {
    const Vec3d n{std::cos(turn), std::sin(turn), 0};
    const Vec3f force = scene.frame(at(test::kBallCentre_m + radius_m * n), {}, 1e-3F).wrench.force_n;
    return cast<double>(force) - dot(cast<double>(force), n) * n;
  };
  force_n(0, 0.75);
  const double held = norm(force_n(0.01, 0.75));
  EXPECT_GT(held, 5) << "dragged along the surface";
  force_n(0.02, 30);
  EXPECT_LT(norm(force_n(0.5, 0.75)), 0.2 * held) << "a new contact has no bristle yet";
}

TEST(Scene, FirstLayerReadsNoMap) {
  Asset bare = ball_asset();
  for (Part& part : bare.parts) part.map = {};
  Scene scene = built({{&bare, {}}}, {{{0, 0, 0}}}, with({}, Layer::kOne));
  EXPECT_EQ(scene.frame(at({1.14, 0, 0}), {}, 1e-3F).inside, 1U);
  EXPECT_EQ(scene.frame(at({1.16, 0, 0}), {}, 1e-3F).inside, 0U);
  EXPECT_LT(scene.resident_bytes(), 4096U);
  EXPECT_FALSE(Scene::build(std::vector<SceneObject>{{&bare, {}}}, {{{0, 0, 0}}}, with({})).ok());
}

TEST(Scene, RefusesWhatItCannotDoAndSaysWhatItCan) {
  const std::vector<SceneObject> objects{{&ball_asset(), {}}};
  const auto finding = [&](const SceneOptions& options, Probe probe = {{{0, 0, 0}}}) {
    const auto scene = Scene::build(objects, std::move(probe), options);
    EXPECT_FALSE(scene.ok());
    return scene ? "" : scene.error().finding + "; " + scene.error().remedy;
  };
  EXPECT_NE(finding(with({{"fricton", {}}})).find("\"fricton\""), std::string::npos);
  EXPECT_NE(finding(with({{"fricton", {}}})).find("friction"), std::string::npos);
  EXPECT_NE(finding(with({{"reaction", {{"stifness", 1.0F}}}})).find("stiffness_n_per_m"), std::string::npos);
  EXPECT_NE(finding(with({{"friction", {}}})).find("needs \"reaction\""), std::string::npos);
  EXPECT_NE(finding(with({{"reaction", {}}, {"reaction", {}}})).find("twice"), std::string::npos);
  EXPECT_NE(finding(with({{"reaction", {}}}, Layer::kOne)).find("layer 1"), std::string::npos);
  EXPECT_NE(finding(with({}), {{{0, 0, 0}}, {1, 2}}).find("2 weights"), std::string::npos);
}

TEST(Scene, APoseThatIsNotFiniteGivesZeroForceAndAFlag) {
  Scene scene = built({{&ball_asset(), {}}}, {test::sphere_points(100, 0.2, {})}, with(all_effects()));
  const Pose touching = at(test::kBallCentre_m + Vec3d{0, 0, 0.95});
  EXPECT_GT(norm(scene.frame(touching, {}, 1e-3F).wrench.force_n), 0);
  Pose bad = touching;
  bad.orientation.x = std::numeric_limits<double>::quiet_NaN();
  for (const Pose& pose : {bad, at({std::numeric_limits<double>::infinity(), 0, 0})}) {
    const FrameResult result = scene.frame(pose, {}, 1e-3F);
    EXPECT_FALSE(result.wrench.is_finite);
    EXPECT_EQ(result.wrench.force_n, Vec3f{});
  }
  EXPECT_TRUE(scene.frame(at({1e300, 0, 0}), {}, 1e-3F).wrench.is_finite);
  EXPECT_GT(norm(scene.frame(touching, {}, 1e-3F).wrench.force_n), 0);
}

void run_frames(Scene& scene, int count) {
  for (int frame = 0; frame < count; ++frame) {
    const double turn = 0.01 * frame;
    const Pose pose = at(test::kBallCentre_m + 0.97 * Vec3d{std::cos(turn), std::sin(turn), 0});
    WorkBudget budget{500};
    if (frame % 3 == 0)
      scene.frame(pose, {}, 1e-3F, budget);
    else
      scene.frame(pose, {}, 1e-3F);
  }
}

TEST(Scene, FramesAllocateNothing) {
  Scene scene = built({{&ball_asset(), {}}}, {test::sphere_points(300, 0.2, {})}, with(all_effects()));
  const test::NoAllocation guard;
  run_frames(scene, 200);
}

void ask_about_a_body(const Object& object, PointBody& body, std::span<const Vec3f> points_m,
                      std::span<Contact> room) {
  WorkBudget budget{1000};
  const bool ok = body.refit(points_m) && object.contacts(body, {}, room, {}) > 0 &&
                  object.contacts(body, {}, room, {}, budget) > 0;
  if (!ok) syscall(SYS_exit, 78);
}

TEST(Scene, FramesCallNoSystem) {
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
  GTEST_SKIP() << "the sanitizer's own run-time calls the system";
#endif
  Scene scene = built({{&ball_asset(), {}}}, {test::sphere_points(300, 0.2, {})}, with(all_effects()));
  const Result<Object> object = Object::build(ball_asset());
  const std::vector<Vec3f> moved = test::sphere_points(300, 0.2, test::kBallCentre_m + Vec3d{0.9, 0, 0});
  Result<PointBody> body = PointBody::build(test::sphere_points(300, 0.2, {}));
  std::vector<Contact> room(moved.size());
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    // Strict seccomp: any call but read, write and exit of the thread kills.
    constexpr int kStrict = 1;
    if (prctl(PR_SET_SECCOMP, kStrict) != 0) syscall(SYS_exit, 77);
    run_frames(scene, 200);
    ask_about_a_body(object.value(), body.value(), moved, room);
    syscall(SYS_exit, 0);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status)) << "killed by signal " << WTERMSIG(status);
  if (WEXITSTATUS(status) == 77) GTEST_SKIP() << "this kernel does not allow seccomp";
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

test::Energy minute_of_bouncing(const Asset& asset, const Vec3d& surface_m, const Vec3d& n,
                                const Vec3d& aside) {
  test::Press how;
  how.damping_n_s_per_m = 0.02;
  Scene scene = built({{&asset, {}}}, {{{0, 0, 0}}},
                      with({{"reaction", {{"stiffness_n_per_m", 500.0F}}}, {"friction", {}}}));
  return test::press(scene, how, surface_m, n, aside);
}

TEST(Scene, AProbePressedIntoABallOrABoxForAMinuteGainsNoEnergy) {
  static const Asset box = test::box_asset({0.5, 0.4, 0.3});
  const Vec3d n = normalized(Vec3d{1, 2, -1}), aside = normalized(cross(n, Vec3d{0, 0, 1}));
  for (const test::Energy& energy :
       {minute_of_bouncing(ball_asset(), test::kBallCentre_m + test::kBallRadius_m * n, n, aside),
        minute_of_bouncing(box, {0.1, 0.05, 0.3}, {0, 0, 1}, {1, 0, 0})}) {
    EXPECT_GT(energy.contacts, 10000);
    EXPECT_LT(energy.most, 1.001);
    EXPECT_LT(energy.last, 0.6);
  }
}

}  // namespace
}  // namespace sqmap::runtime
