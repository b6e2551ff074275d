// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/effects/passivity.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "sqmap/runtime/body.hpp"
#include "sqmap/runtime/effects/force_model.hpp"
#include "sqmap/runtime/effects/reaction.hpp"

#include "touch_shapes.hpp"

namespace sqmap::runtime {
namespace {

using test::plane_contact;

constexpr float kStiffness_n_per_m = 1000;
constexpr double kStep_m = 1e-4, kDeepest_m = 0.01;

template <class... Effects>
ForceModel<Effects...> model_for(std::size_t points, Effects... effects) {
  ForceModel model(std::move(effects)...);
  EXPECT_TRUE(model.prepare(points).ok());
  return model;
}

Passivity passivity(float reserve) {
  Passivity effect;
  effect.reserve = reserve;
  return effect;
}

/// One point, known by its place in every frame, against contacts of the test's own making.
template <class Model>
Vec3f push_on(Model& model, const Vec3f& p_m, float depth_m, const Vec3f& normal) {
  const std::vector<Vec3f> points{p_m};
  std::vector<Contact> contacts;
  if (depth_m > 0) contacts.push_back({0, 0, depth_m, normal, p_m, p_m + depth_m * normal});
  std::vector<Vec3f> force_n(contacts.size());
  Touches touches{{}, {points}, contacts, force_n};
  return model.apply(touches).force_n;
}

/// A point is pressed into the half space z < 0, whose depth jumps by a fifth where the point turns round,
/// and drawn out again, time after time: each round hands out 44 % more than the spring took.
struct Pump {
  std::vector<Vec3f> force_n;
  double most_given_j = 0;  ///< ever, by the trapezoidal rule
};
template <class Model>
Pump pumped(Model& model, int rounds) {
  Pump pump;
  Vec3f last_m{0, 0, 1e-4F}, last_n = push_on(model, last_m, 0, {0, 0, 1});
  double given_j = 0;
  const int half = static_cast<int>(kDeepest_m / kStep_m);
  for (int frame = 0; frame < rounds * 2 * half; ++frame) {
    const int phase = frame % (2 * half);
    const bool is_in = phase < half;
    const double depth_m = kStep_m * (is_in ? phase + 0.5 : 2 * half - phase - 0.5);
    const Vec3f p_m{0, 0, static_cast<float>(-depth_m)};
    const Vec3f force_n = push_on(model, p_m, static_cast<float>((is_in ? 1.0 : 1.2) * depth_m), {0, 0, 1});
    given_j +=
        0.5 * dot(cast<double>(last_n) + cast<double>(force_n), cast<double>(p_m) - cast<double>(last_m));
    pump.most_given_j = std::max(pump.most_given_j, given_j);
    pump.force_n.push_back(force_n);
    last_m = p_m;
    last_n = force_n;
  }
  return pump;
}

constexpr double kRound_j = 0.5 * kStiffness_n_per_m * kDeepest_m * kDeepest_m;

TEST(Passivity, APumpGivesNothingAndWithoutItGivesEveryRound) {
  auto with = model_for(1, Reaction{kStiffness_n_per_m}, Passivity{});
  auto without = model_for(1, Reaction{kStiffness_n_per_m});
  const Pump held = pumped(with, 20), bare = pumped(without, 20);
  EXPECT_GT(bare.most_given_j, 20 * 0.15 * kRound_j);
  // One step at the deepest place is 2 % of a round.
  EXPECT_LT(held.most_given_j, 0.02 * kRound_j);
  EXPECT_GE(with.get<Passivity>().energy_j(), 0.0);
}

TEST(Passivity, TakesForceAwayOnTheWayOutAndAddsNone) {
  auto with = model_for(1, Reaction{kStiffness_n_per_m}, passivity(0));
  auto without = model_for(1, Reaction{kStiffness_n_per_m});
  const Pump held = pumped(with, 3), bare = pumped(without, 3);
  const std::size_t half = held.force_n.size() / 6;
  float least = 1;
  for (std::size_t i = 0; i < held.force_n.size(); ++i) {
    const float share = held.force_n[i].z / bare.force_n[i].z;
    ASSERT_GE(share, 0) << i;
    ASSERT_LE(share, 1) << i;
    if (i < half) {
      ASSERT_EQ(share, 1) << "on the first way in, frame " << i;
    }
    least = std::min(least, share);
    // 4 times the way over the depth, of the smaller of the two depths.
    if (i % half > 0) {
      const float before = held.force_n[i - 1].z / bare.force_n[i - 1].z;
      const double depth_m = std::min(bare.force_n[i].z, bare.force_n[i - 1].z) / kStiffness_n_per_m;
      ASSERT_LE(std::abs(share - before), 4.2 * kStep_m / depth_m + 1e-6) << i;
    }
  }
  EXPECT_LT(least, 0.85F);
}

// In and out of a ball and all over it: the force of a ball is the gradient of what its spring stores. A
// force that is held while the point leaves gives more than the spring has; only those last frames, of hardly
// a newton of 35, may be less.
TEST(Passivity, LeavesTheForcesOfAPassiveContactAsTheyAreToTheBit) {
  auto with = model_for(1, Reaction{kStiffness_n_per_m}, Passivity{});
  auto without = model_for(1, Reaction{kStiffness_n_per_m});
  int touching = 0, other = 0;
  float most_n = 0, most_other_n = 0;
  for (int frame = 0; frame < 60000; ++frame) {
    const double t = 1e-3 * frame, turn = 2.7 * t, tilt = std::sin(1.3 * t);
    const Vec3d n{std::cos(turn) * std::cos(tilt), std::sin(turn) * std::cos(tilt), std::sin(tilt)};
    const double depth_m = 0.02 * std::sin(9 * t) + 0.01 * std::sin(23.1 * t) + 0.004;
    const Vec3f p_m = cast<float>((0.5 - depth_m) * n);
    const float sunk_m = 0.5F - norm(p_m);
    const Vec3f held_n = push_on(with, p_m, sunk_m, normalized(p_m)),
                bare_n = push_on(without, p_m, sunk_m, normalized(p_m));
    touching += sunk_m > 0 ? 1 : 0;
    most_n = std::max(most_n, norm(bare_n));
    if (held_n == bare_n) continue;
    ++other;
    most_other_n = std::max(most_other_n, norm(bare_n));
  }
  EXPECT_GT(touching, 20000);
  EXPECT_LT(touching, 50000);
  EXPECT_LT(other, touching / 1000);
  EXPECT_LT(most_other_n, 0.02 * most_n);
}

/// Work on all points of a body that turns and moves, each point by itself, and what the effect makes of it.
TEST(Passivity, CountsTheWorkOfABodyThatTurns) {
  constexpr std::size_t kPoints = 60;
  const std::vector<Vec3f> shape = test::sphere_points(kPoints, 0.2, {});
  const Result<PointBody> body = PointBody::build(shape);
  auto model = model_for(kPoints, Reaction{kStiffness_n_per_m}, passivity(1000));
  std::vector<Vec3d> last_m(kPoints), last_n(kPoints);
  double taken_j = 0;
  int touching = 0;
  for (int frame = 0; frame < 400; ++frame) {
    // Around an axis askew, downwards: every frame some points go in and others come out.
    const double a = 0.01 * frame;
    const Placement at{
        {{std::cos(a), 0.6 * std::sin(a), 0.8 * std::sin(a), 0}, {0.1 * a, 0, 0.15 - 0.02 * a}}};
    const Rotation<double> turn = rotation(at.world_from_object.orientation);
    std::vector<Contact> contacts;
    std::vector<Vec3d> p_m(kPoints);
    for (std::size_t i = 0; i < kPoints; ++i) {
      p_m[i] = turn.apply(cast<double>(shape[i])) + at.world_from_object.translation_m;
      if (p_m[i].z < 0) contacts.push_back(plane_contact(cast<float>(p_m[i]), static_cast<std::uint32_t>(i)));
    }
    std::vector<Vec3f> force_n(contacts.size());
    BodyState state;
    state.body = &body.value();
    state.at = at;
    Touches touches{{}, state, contacts, force_n};
    model.apply(touches);
    std::vector<Vec3d> push_n(kPoints);
    for (std::size_t k = 0; k < contacts.size(); ++k) push_n[contacts[k].point] = cast<double>(force_n[k]);
    for (std::size_t i = 0; i < kPoints; ++i) {
      // In the first frame points stand in the half space: what they hold counts as put in.
      if (frame == 0)
        taken_j += 0.5 * kStiffness_n_per_m * std::pow(std::min(p_m[i].z, 0.0), 2);
      else
        taken_j -= 0.5 * dot(last_n[i] + push_n[i], p_m[i] - last_m[i]);
      touching += push_n[i].z > 0 ? 1 : 0;
    }
    last_m = p_m;
    last_n = push_n;
    ASSERT_NEAR(model.get<Passivity>().energy_j(), taken_j, 1e-4 * taken_j) << frame;
  }
  EXPECT_GT(touching, 400 * 5);
  EXPECT_GT(taken_j, 1);
}

TEST(Passivity, AProbeThatRestsFeelsAConstantForce) {
  auto model = model_for(1, Reaction{kStiffness_n_per_m}, passivity(0));
  pumped(model, 1);
  // Half way out of a contact that would give too much; then still.
  Vec3f held;
  for (int k = -100; k <= -51 + 100; ++k) {
    const float depth_m = 1e-4F * static_cast<float>(100 - std::abs(k));
    held = push_on(model, {0, 0, -depth_m}, (k < 0 ? 1.0F : 1.2F) * depth_m, {0, 0, 1});
  }
  EXPECT_LT(model.get<Passivity>().share(), 0.9);
  EXPECT_GT(model.get<Passivity>().share(), 0.1);
  for (int frame = 0; frame < 1000; ++frame)
    ASSERT_EQ(push_on(model, {0, 0, -1e-4F * 51}, 1.2F * (1e-4F * 51), {0, 0, 1}), held);
}

TEST(Passivity, AProbePutElsewhereInOneFrameFindsTheObjectStillThere) {
  auto model = model_for(1, Reaction{kStiffness_n_per_m}, Passivity{});
  for (int k = 0; k <= 100; ++k) {
    const float depth_m = 1e-4F * static_cast<float>(k);
    push_on(model, {0, 0, -depth_m}, depth_m, {0, 0, 1});
  }
  push_on(model, {0, 0, 5000}, 0, {0, 0, 1});  // 10 N over 5 km
  // Two presses later the debt of one is paid.
  Vec3f force_n;
  for (int press = 0; press < 3; ++press)
    for (int k = -100; k <= 100; ++k) {
      const float depth_m = 1e-4F * static_cast<float>(100 - std::abs(k));
      force_n = push_on(model, {0, 0, -depth_m}, depth_m, {0, 0, 1});
      if (press == 2 && k == 50) {
        EXPECT_EQ(force_n.z, kStiffness_n_per_m * depth_m);
      }
    }
}

TEST(Passivity, NeverTurnsOrEnlargesAForceWhateverTheContacts) {
  auto with = model_for(4, Reaction{}, Passivity{});
  std::mt19937_64 rng(41);
  std::uniform_real_distribution<float> uniform(-1, 1);
  int less = 0;
  for (int frame = 0; frame < 5000; ++frame) {
    std::vector<Contact> contacts;
    for (std::uint32_t k = 0; k < 4; ++k)
      if (uniform(rng) > 0) {
        const Vec3f n = normalized(Vec3f{uniform(rng), uniform(rng), 1.5F}), p{uniform(rng), uniform(rng), 0};
        contacts.push_back({k, 0, 0.01F * std::abs(uniform(rng)), n, p, p});
      }
    std::vector<Vec3f> force_n(contacts.size());
    Touches touches{{}, {}, contacts, force_n};
    with.apply(touches);
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      const Vec3f whole_n = 500.0F * (contacts[i].depth_m * contacts[i].normal);
      ASSERT_LE(norm(force_n[i]), norm(whole_n) * 1.00001F);
      ASSERT_GE(dot(force_n[i], whole_n), 0);
      ASSERT_LE(norm(cross(force_n[i], whole_n)), 1e-5F * norm(whole_n) * norm(whole_n));
      less += norm(force_n[i]) < 0.9F * norm(whole_n) ? 1 : 0;
    }
  }
  EXPECT_GT(less, 500);
}

}  // namespace
}  // namespace sqmap::runtime
