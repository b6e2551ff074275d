// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "sqmap/runtime/effects/force_limit.hpp"
#include "sqmap/runtime/effects/force_model.hpp"
#include "sqmap/runtime/effects/friction.hpp"
#include "sqmap/runtime/effects/impact_zones.hpp"
#include "sqmap/runtime/effects/passivity.hpp"
#include "sqmap/runtime/effects/reaction.hpp"
#include "sqmap/runtime/effects/slew_limit.hpp"
#include "sqmap/runtime/effects/smoothing.hpp"
#include "sqmap/runtime/effects/texture.hpp"
#include "sqmap/runtime/effects/torque.hpp"
#include "sqmap/runtime/effects/tracking.hpp"

#include "touch_shapes.hpp"

namespace sqmap::runtime {
namespace {

using test::apply_one;
using test::plane_contact;

const Object& ball() {
  static const Result<Object> object = Object::build(test::ball_in_ellipsoid(test::kBallRadius_m, 65, 128));
  return object.value();
}

Friction friction(float coefficient, float bristle_n_per_m, float depth_gain_per_m = 0) {
  Friction f;
  f.coefficient = coefficient;
  f.bristle_n_per_m = bristle_n_per_m;
  f.depth_gain_per_m = depth_gain_per_m;
  return f;
}

template <class... Effects>
ForceModel<Effects...> model_for(std::size_t points, Effects... effects) {
  ForceModel model(std::move(effects)...);
  const Outcome ok = model.prepare(points);
  EXPECT_TRUE(ok.ok()) << (ok ? "" : ok.error().finding);
  return model;
}

TEST(Reaction, PushesAPointOutOfABallByHookesLaw) {
  const Result<Instance> instance = Instance::place(ball(), Placement{});
  auto model = model_for(1, Reaction{.stiffness_n_per_m = 200});
  const Vec3d n = normalized(Vec3d{1, 2, -1});
  const std::vector<Vec3f> inside{cast<float>(test::kBallCentre_m + 0.75 * n)},
      outside{cast<float>(test::kBallCentre_m + 0.85 * n)};
  const BodyState state{inside};
  const Wrench wrench = model.frame({&instance.value(), {Layer::kThree}}, state);
  EXPECT_NEAR(norm(wrench.force_n), 200 * 0.05, 0.2);
  EXPECT_GT(dot(normalized(cast<double>(wrench.force_n)), n), 0.998);
  EXPECT_EQ(wrench.contacts, 1U);
  EXPECT_EQ(model.frame({&instance.value(), {Layer::kThree}}, {outside}).force_n, Vec3f{});
}

TEST(Friction, HoldsAtRestWithoutCreep) {
  auto model = model_for(1, Reaction{.stiffness_n_per_m = 1000}, friction(0.5F, 2000));
  apply_one(model, plane_contact({0, 0, -0.01F}));
  Vec3f held;
  for (int frame = 0; frame < 10000; ++frame) {
    // Pulled aside by 1 mm, once: 2 N against a limit of 5 N.
    const Wrench wrench = apply_one(model, plane_contact({1e-3F, 0, -0.01F}));
    if (frame == 0) held = wrench.force_n;
    ASSERT_EQ(wrench.force_n, held);
  }
  EXPECT_NEAR(held.x, -2, 1e-4);
  EXPECT_NEAR(held.z, 10, 1e-4);
}

TEST(Friction, SlidingPullsBackWithThePapersMagnitude) {
  constexpr float kMu = 0.5F, kDepth = 0.01F, kGain = 20;
  auto model = model_for(1, Reaction{.stiffness_n_per_m = 1000}, friction(kMu, 2000, kGain));
  const Vec3f way{0.6F, -0.8F, 0};
  Wrench wrench;
  for (int frame = 0; frame < 400; ++frame)
    wrench = apply_one(model, plane_contact(1e-3F * static_cast<float>(frame) * way + Vec3f{0, 0, -kDepth}));
  const float expected = kMu * 1000 * kDepth * (1 + kGain * kDepth);
  EXPECT_NEAR(dot(wrench.force_n, way), -expected, 1e-3);
  EXPECT_NEAR(norm(wrench.force_n - Vec3f{0, 0, 10} + expected * way), 0, 1e-2) << "opposite to the motion";
}

TEST(Friction, DependsOnThePathAndNotOnTheRate) {
  const auto end_force = [](int frames) {
    auto model = model_for(1, Reaction{}, friction(0.3F, 1500));
    Wrench wrench;
    for (int frame = 0; frame <= frames; ++frame) {
      const double t = static_cast<double>(frame) / frames;
      wrench = apply_one(model, plane_contact(cast<float>(Vec3d{0.05 * std::sin(5 * t), 0.03 * t, -0.01})),
                         1 / static_cast<float>(frames));
    }
    return wrench.force_n;
  };
  EXPECT_LT(norm(end_force(4000) - end_force(1000)), 0.01 * norm(end_force(1000)));
}

TEST(Friction, GivesBackNoEnergyAroundClosedPaths) {
  std::mt19937_64 rng(21);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int path = 0; path < 40; ++path) {
    auto model = model_for(1, Reaction{.stiffness_n_per_m = 800}, friction(0.4F, 1500));
    const double a = uniform(rng), b = uniform(rng), c = uniform(rng), d = uniform(rng);
    const auto place = [&](double t) {
      const double turn = 2 * 3.141592653589793 * t;
      return Vec3d{0.02 * (std::sin(turn) + a * std::sin(2 * turn)), 0.02 * (b * std::cos(3 * turn)),
                   -0.01 + 0.004 * c * std::sin(turn) + 0.004 * d * std::cos(2 * turn)};
    };
    constexpr int kFrames = 2000;
    double work_j = 0;
    Vec3d last = place(0);
    for (int frame = 0; frame <= 3 * kFrames; ++frame) {  // first turn: until the bristle has its cycle
      const Vec3d now = place(static_cast<double>(frame) / kFrames);
      const Wrench wrench = apply_one(model, plane_contact(cast<float>(now)));
      const Vec3d tangential{wrench.force_n.x, wrench.force_n.y, 0};
      if (frame > kFrames) work_j += dot(tangential, now - last);
      last = now;
    }
    EXPECT_LT(work_j, 0) << "path " << path;
  }
}

TEST(Friction, EndsWithTheContact) {
  auto model = model_for(2, Reaction{}, friction(0.5F, 2000));
  apply_one(model, plane_contact({0, 0, -0.01F}));
  EXPECT_NE(apply_one(model, plane_contact({1e-3F, 0, -0.01F})).force_n.x, 0);
  apply_one(model, plane_contact({1e-3F, 0, -0.01F}, 1));  // point 0 has let go for a frame
  EXPECT_EQ(apply_one(model, plane_contact({5e-3F, 0, -0.01F})).force_n.x, 0);
}

TEST(LatticeNoise, IsBoundedContinuousAndHasZeroMean) {
  std::mt19937_64 rng(22);
  std::uniform_real_distribution<float> uniform(-500, 500);
  double sum = 0, square = 0, steepest = 0;
  constexpr int kDraws = 200000;
  for (int i = 0; i < kDraws; ++i) {
    const Vec3f p{uniform(rng), uniform(rng), uniform(rng)};
    const float value = lattice_noise(p, 3);
    ASSERT_LE(std::abs(value), 1);
    sum += value;
    square += value * value;
    const Vec3f q = p + Vec3f{1e-2F, -1e-2F, 1e-2F};
    steepest = std::max(steepest, std::abs(double(lattice_noise(q, 3)) - value) / norm(cast<double>(q - p)));
  }
  EXPECT_NEAR(sum / kDraws, 0, 4e-3);
  EXPECT_GT(std::sqrt(square / kDraws), 0.15) << "noise has gone flat";
  EXPECT_LT(steepest, 5) << "a jump between lattice cells";
}

TEST(Texture, IsAFunctionOfPlaceAndSeedNotOfTime) {
  auto first = model_for(1, Texture{}, Reaction{});
  auto other = model_for(1, Texture{.seed = 2}, Reaction{});
  const Contact here = plane_contact({0.013F, 0.027F, -0.01F}), there = plane_contact({0.4F, 0.1F, -0.01F});
  const Vec3f force = apply_one(first, here).force_n;
  for (int frame = 0; frame < 50; ++frame) apply_one(first, there);
  EXPECT_EQ(apply_one(first, here).force_n, force);
  EXPECT_NE(apply_one(other, here).force_n, force);
  EXPECT_NE(apply_one(first, there).force_n, force);
}

TEST(Texture, MeanForceIsThatOfTheSmoothSurface) {
  auto model = model_for(1, Texture{.amplitude_m = 2e-3F, .wavelength_m = 0.01F}, Reaction{1000});
  std::mt19937_64 rng(23);
  std::uniform_real_distribution<float> uniform(-1, 1);
  for (const float depth : {5e-4F, 5e-3F}) {
    double sum = 0, least = 1e9, most = 0;
    for (int i = 0; i < 40000; ++i) {
      const double f = apply_one(model, plane_contact({uniform(rng), uniform(rng), -depth})).force_n.z;
      sum += f;
      least = std::min(least, f);
      most = std::max(most, f);
    }
    EXPECT_NEAR(sum / 40000, 1000 * depth, 0.01 * 1000 * depth);
    EXPECT_GE(least, 0);
    EXPECT_GT(most, 1.2 * 1000 * depth);
  }
}

TEST(Texture, StartsWithTheContactNotWithAJump) {
  auto model = model_for(1, Texture{.amplitude_m = 2e-3F, .wavelength_m = 0.01F}, Reaction{1000});
  for (int i = 0; i < 100; ++i)
    EXPECT_LE(apply_one(model, plane_contact({0.013F * static_cast<float>(i), 0, -1e-6F})).force_n.z, 2.1e-3);
}

TEST(Smoothing, DepthOnABallShrinksByTheStatedBias) {
  const Result<Instance> instance = Instance::place(ball(), Placement{});
  constexpr float kH = 0.1F;
  auto plain = model_for(1, Reaction{1});
  auto smooth = model_for(1, Smoothing{kH}, Reaction{1});
  std::mt19937_64 rng(24);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 100; ++i) {
    const Vec3d n = normalized(Vec3d{normal(rng), normal(rng), normal(rng)});
    const std::vector<Vec3f> point{cast<float>(test::kBallCentre_m + 0.72 * n)};
    const Field field{&instance.value(), {Layer::kThree}};
    const double bias =
        norm(smooth.frame(field, {point}).force_n) - norm(plain.frame(field, {point}).force_n);
    EXPECT_NEAR(bias, -2 * kH * kH / (7 * 0.72), 0.15 * 2 * kH * kH / (7 * 0.72));
  }
}

/// Largest change of the force's direction in one of so many steps over 7 cm, across the edge of a box, 2 cm
/// below its faces.
double sharpest_turn(const Object& object, float smoothing_m, int steps) {
  const Result<Instance> instance = Instance::place(object, Placement{});
  auto model = model_for(1, Smoothing{smoothing_m}, Reaction{1});
  double sharpest = 0;
  Vec3d last;
  for (int i = 0; i <= steps; ++i) {
    const double way_m = 0.05 * i / steps;
    const std::vector<Vec3f> point{{static_cast<float>(0.43 + way_m), 0, static_cast<float>(0.28 - way_m)}};
    const Vec3d now =
        normalized(cast<double>(model.frame({&instance.value(), {Layer::kThree}}, {point}).force_n));
    if (i > 0) sharpest = std::max(sharpest, norm(now - last));
    last = now;
  }
  return sharpest;
}

TEST(Smoothing, SoftensTheTurnOfTheForceInsideAnEdge) {
  const Result<Object> box = Object::build(test::box_asset({0.5, 0.4, 0.3}));
  const double plain = sharpest_turn(box.value(), 0, 100), smooth = sharpest_turn(box.value(), 0.05F, 100);
  EXPECT_GT(plain, 0.8) << "from one face to the other at once";
  EXPECT_LT(smooth, 0.6 * plain);
}

// Where neighbours change from one face to the other, a mean of seven normals turns by a fifth for each,
// however short the steps. Depths do not jump there, but for the texels of the edge.
TEST(Smoothing, NoNeighbourThatChangesFacesTurnsTheForceAtOnce) {
  const Result<Object> box = Object::build(test::box_asset({0.5, 0.4, 0.3}));
  EXPECT_LT(sharpest_turn(box.value(), 0.05F, 1000), 0.06);
  EXPECT_GT(sharpest_turn(box.value(), 0, 1000), 0.8) << "the faces are not both met";
}

TEST(Smoothing, BesideAPlaneThatIsKnownFromBelowOnlyDepthAndNormalStay) {
  const Result<Object> box = Object::build(test::box_asset({0.5, 0.4, 0.3}));
  const Result<Instance> instance = Instance::place(box.value(), Placement{});
  const Field field{&instance.value(), {Layer::kThree}};
  constexpr float kH = 0.1F;
  auto plain = model_for(1, Reaction{1});
  auto smooth = model_for(1, Smoothing{kH}, Reaction{1});
  int half_known = 0;
  for (int i = 0; i < 20; ++i) {
    const std::vector<Vec3f> point{{0.01F * static_cast<float>(i), -0.1F, 0.28F}};
    const Answer above = instance.value().query(point[0] + Vec3f{0, 0, kH}, field.options);
    if (!std::isnan(above.signed_distance_m)) continue;
    ++half_known;
    EXPECT_LT(norm(smooth.frame(field, {point}).force_n - plain.frame(field, {point}).force_n), 2e-4) << i;
  }
  EXPECT_GT(half_known, 10);
}

/// Force on a ball of points, 0.2 m in radius, pressed 2 cm into the ball.
template <class... Effects>
double pressed_force(std::vector<Vec3f> points, std::span<const float> weight_m2, Effects... effects) {
  const Result<Instance> instance = Instance::place(ball(), Placement{});
  auto model = model_for(points.size(), std::move(effects)...);
  return norm(model.frame({&instance.value(), {Layer::kThree}}, {points, weight_m2}).force_n);
}

const Vec3d kProbeCentre_m = test::kBallCentre_m + (test::kBallRadius_m + 0.2 - 0.02) * Vec3d{0.6, 0, 0.8};

TEST(ImpactZones, DoublingTheSamplesOfTheProbeKeepsTheForce) {
  const auto coarse = test::sphere_points(4000, 0.2, kProbeCentre_m),
             fine = test::sphere_points(8000, 0.2, kProbeCentre_m);
  const double expected = pressed_force(coarse, {}, Reaction{}, ImpactZones{});
  EXPECT_NEAR(pressed_force(fine, {}, Reaction{}, ImpactZones{}), expected, 0.03 * expected);
  const double sum = pressed_force(coarse, {}, Reaction{});
  EXPECT_GT(pressed_force(fine, {}, Reaction{}), 1.8 * sum) << "a plain sum follows the sampling";
}

TEST(ImpactZones, WeightsMakeUpForUnevenSampling) {
  const auto coarse = test::sphere_points(4000, 0.2, kProbeCentre_m);
  const double expected = pressed_force(coarse, {}, Reaction{}, ImpactZones{});
  // Half of the ball sampled four times as densely; each point stands for its share of the surface.
  std::vector<Vec3f> points;
  std::vector<float> weight_m2;
  for (const Vec3f& p : coarse) {
    if (p.y < 0) continue;
    points.push_back(p);
    weight_m2.push_back(4);
  }
  for (const Vec3f& p : test::sphere_points(16000, 0.2, kProbeCentre_m)) {
    if (p.y >= 0) continue;
    points.push_back(p);
    weight_m2.push_back(1);
  }
  EXPECT_NEAR(pressed_force(points, weight_m2, Reaction{}, ImpactZones{}), expected, 0.03 * expected);
}

TEST(ImpactZones, APointThatJoinsDoesNotMakeTheForceJumpAsThePapersMeanDoes) {
  for (const float by_depth : {1.0F, 0.0F}) {
    ImpactZones zones;
    zones.by_depth = by_depth;
    auto model = model_for(2, Reaction{1000}, zones);
    std::array<Contact, 2> contacts{plane_contact({0, 0, -0.01F}), plane_contact({0.1F, 0, -1e-7F}, 1)};
    std::array<Vec3f, 2> force_n{};
    Touches one{{}, {}, std::span(contacts).first(1), std::span(force_n).first(1)},
        two{{}, {}, contacts, force_n};
    const float before = model.apply(one).force_n.z, after = model.apply(two).force_n.z;
    EXPECT_NEAR(before, 10, 1e-3);
    EXPECT_NEAR(after, by_depth > 0 ? 10 : 5, 1e-2);
  }
}

TEST(ImpactZones, ZonesAreAveragedEachForItself) {
  ImpactZones zones;
  zones.set_zones(std::array<std::uint32_t, 3>{0, 0, 1});
  auto model = model_for(3, Reaction{1000}, zones);
  std::array<Contact, 3> contacts{plane_contact({0, 0, -0.01F}), plane_contact({0.1F, 0, -0.01F}, 1),
                                  plane_contact({0.2F, 0, -0.03F}, 2)};
  std::array<Vec3f, 3> force_n{};
  Touches touches{{}, {}, contacts, force_n};
  EXPECT_NEAR(model.apply(touches).force_n.z, 10 + 30, 1e-3);
}

TEST(Torque, MovesWithItsPointOfReference) {
  const Result<Instance> instance = Instance::place(ball(), Placement{});
  const auto points = test::sphere_points(500, 0.3, kProbeCentre_m);
  auto model = model_for(points.size(), Reaction{}, Torque{});
  const Vec3f c{0.3F, 1, -0.2F}, d{-0.5F, 0.1F, 0.4F};
  const Wrench at_c = model.frame({&instance.value(), {Layer::kThree}}, {points, {}, c}),
               at_d = model.frame({&instance.value(), {Layer::kThree}}, {points, {}, d});
  EXPECT_EQ(at_c.force_n, at_d.force_n);
  EXPECT_GT(norm(at_c.torque_nm - at_d.torque_nm), 1);
  EXPECT_LT(norm(at_c.torque_nm + cross(c - d, at_c.force_n) - at_d.torque_nm), 1e-4 * norm(at_c.torque_nm));
  // Normals of a ball meet in its centre.
  const Wrench at_centre =
      model.frame({&instance.value(), {Layer::kThree}}, {points, {}, cast<float>(test::kBallCentre_m)});
  EXPECT_LT(norm(at_centre.torque_nm), 0.02 * norm(at_centre.force_n));
}

TEST(ForceLimit, ScalesForceAndTorqueByOneFactor) {
  ForceLimit limit{.most_n = 4, .most_nm = 0.5F};
  for (const auto& [force, torque] :
       {std::pair{Vec3f{8, 0, 6}, Vec3f{0, 0.1F, 0}}, std::pair{Vec3f{1, 0, 0}, Vec3f{0, 0, 2}},
        std::pair{Vec3f{}, Vec3f{}}}) {
    Wrench wrench{force, torque};
    limit.limit(1e-3F, wrench);
    EXPECT_LE(norm(wrench.force_n), 4.0001F);
    EXPECT_LE(norm(wrench.torque_nm), 0.50001F);
    EXPECT_NEAR(norm(cross(wrench.force_n, force)) + norm(cross(wrench.torque_nm, torque)), 0, 1e-5);
    EXPECT_NEAR(norm(wrench.force_n) * norm(torque), norm(force) * norm(wrench.torque_nm), 1e-4);
  }
}

TEST(SlewLimit, ApproachesAStepAtItsRate) {
  SlewLimit slew;
  slew.n_per_s = 1000;
  Vec3f last;
  int frames = 0;
  for (; frames < 100; ++frames) {
    Wrench wrench{{3, 4, 0}, {}};
    slew.limit(1e-3F, wrench);
    EXPECT_LE(norm(wrench.force_n - last), 1.0001F);
    if (wrench.force_n == last) break;
    last = wrench.force_n;
  }
  EXPECT_EQ(frames, 5) << "5 N at 1 N a frame";
  EXPECT_NEAR(norm(last), 5, 1e-5);
}

TEST(ForceModel, RefusesParametersOutOfRangeByName) {
  ForceModel model(Reaction{.stiffness_n_per_m = -1}, Torque{});
  const Outcome outcome = model.prepare(1);
  ASSERT_FALSE(outcome.ok());
  EXPECT_EQ(outcome.error().status, Status::kBadOption);
  EXPECT_EQ(outcome.error().finding, "reaction.stiffness_n_per_m = -1, must be in [0, 1e+06]");
  EXPECT_FALSE(ForceModel(Texture{.seed = 2.5F}).prepare(1).ok());
  EXPECT_FALSE(ForceModel(Reaction{std::numeric_limits<float>::quiet_NaN()}).prepare(1).ok());
}

auto everything(std::size_t points) {
  return model_for(points, Smoothing{}, Tracking{}, Texture{}, Reaction{}, friction(0.4F, 1000),
                   ImpactZones{}, Passivity{}, Torque{}, ForceLimit{}, SlewLimit{});
}

TEST(ForceModel, AnyFiniteContactGivesAFiniteForce) {
  const Result<Instance> instance = Instance::place(ball(), Placement{});
  auto model = everything(8);
  std::mt19937_64 rng(25);
  std::uniform_real_distribution<double> exponent(-44, 38), sign(-1, 1);
  const auto number = [&] {
    return static_cast<float>(std::copysign(std::pow(10, exponent(rng)), sign(rng)));
  };
  const auto vector = [&] { return Vec3f{number(), number(), number()}; };
  for (int i = 0; i < 3000; ++i) {
    std::vector<Contact> contacts;
    for (std::uint32_t k = 0; k < 8; ++k)
      contacts.push_back({k, 0, std::abs(number()), normalized(vector()), vector(), vector()});
    std::vector<Vec3f> force_n(8);
    Touches touches{{&instance.value(), {Layer::kThree}}, {}, contacts, force_n};
    const Wrench wrench = model.apply(touches);
    ASSERT_TRUE(std::isfinite(norm(wrench.force_n))) << i;
    ASSERT_TRUE(std::isfinite(norm(wrench.torque_nm))) << i;
  }
}

TEST(ForceModel, ANotANumberGivesZeroForceAndAFlagAndIsForgotten) {
  const Result<Instance> instance = Instance::place(ball(), Placement{});
  auto model = everything(2);
  const Field field{&instance.value(), {Layer::kThree}};
  const Vec3f inside = cast<float>(test::kBallCentre_m + Vec3d{0, 0, 0.78});
  const std::vector<Vec3f> good{inside, inside}, bad{inside, {std::numeric_limits<float>::quiet_NaN(), 0, 0}};
  EXPECT_TRUE(model.frame(field, {good}).is_finite);
  const Wrench wrench = model.frame(field, {bad});
  EXPECT_FALSE(wrench.is_finite);
  EXPECT_EQ(wrench.force_n, Vec3f{});
  EXPECT_EQ(wrench.torque_nm, Vec3f{});
  const Wrench after = model.frame(field, {good});
  EXPECT_TRUE(after.is_finite);
  EXPECT_GT(norm(after.force_n), 1);
}

}  // namespace
}  // namespace sqmap::runtime
