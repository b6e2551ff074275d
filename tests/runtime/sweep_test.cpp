// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/sweep.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "support/analytic_asset.hpp"

namespace sqmap::runtime {
namespace {

constexpr double kTolerance_m = 1e-3;
constexpr double kMapError_m = 1.5e-3;  // of the 65 x 128 maps below
const SweepOptions kOptions{.tolerance_m = kTolerance_m, .error_m = kMapError_m};

/// An object and what sweeps against it.
struct Swept {
  Object object;
  Sweeper sweeper;

  static Swept of(const Asset& asset) {
    return {std::move(Object::build(asset)).value(), std::move(Sweeper::build(asset)).value()};
  }
  Instance at(const Placement& placement = {}) const {
    auto instance = Instance::place(object, placement);
    EXPECT_TRUE(instance.ok());
    return instance.value();
  }
};

const Vec3d kCentre{0.1, -0.05, 0.2};
constexpr double kRadius = 0.8;

const Swept& ball() {
  static const Swept kSwept = Swept::of(test::ball_in_ellipsoid(kRadius, 65, 128));
  return kSwept;
}

/// A square plate of 2 x 2 m, `half_m` thick on each side of z = 0.
Asset plate_asset(double half_m) {
  const Vec3d box{1, 1, half_m};
  const auto crossings = [box](const Vec3d& o, const Vec3d& d, bool& inside) {
    inside = false;
    double enter = -1e9, leave = 1e9;
    for (int k = 0; k < 3; ++k) {
      if (d[k] == 0) {
        if (std::abs(o[k]) >= box[k]) return std::vector<double>{};
        continue;
      }
      const double a = (-box[k] - o[k]) / d[k], b = (box[k] - o[k]) / d[k];
      enter = std::max(enter, std::min(a, b));
      leave = std::min(leave, std::max(a, b));
    }
    return enter < leave && enter > 0 ? std::vector<double>{enter, leave} : std::vector<double>{};
  };
  return test::asset_of(
      {test::traced_part({{1.2, 1.2, 2 * half_m}, 0.3, 0.3}, {}, 33, 64, 1, 1.5 * half_m, crossings)}, 2.83);
}

Vec3d random_direction(std::mt19937_64& rng) {
  std::normal_distribution<double> normal;
  return normalized(Vec3d{normal(rng), normal(rng), normal(rng)});
}

/// First time at which the line from a to b is inside the ball; 2: never.
double time_on_ball(const Vec3d& a, const Vec3d& b, double radius_m) {
  const Vec3d d = b - a, from_centre = a - kCentre;
  const double half = dot(from_centre, d) / dot(d, d);
  const double c = (dot(from_centre, from_centre) - radius_m * radius_m) / dot(d, d);
  if (half * half < c) return 2;
  const double t = -half - std::sqrt(half * half - c);
  return t >= 0 && t <= 1 ? t : 2;
}

/// The same ball in a superquadric that narrows upwards.
const Swept& ball_in_taper() {
  static const Swept kSwept = Swept::of(
      test::asset_of({test::traced_part({{1.35, 1.35, 1.45}, 1, 1, -0.3}, {}, 65, 128, 1, 1.2,
                                        [](const Vec3d& o, const Vec3d& d, bool& inside) {
                                          return test::union_crossings_m({{kCentre, kRadius}}, o, d, inside);
                                        })},
                     2 * kRadius));
  return kSwept;
}

/// The same ball in a bent superquadric.
const Swept& ball_in_bend() {
  static const Swept kSwept = [] {
    Superquadric shape{{1.35, 1.35, 1.5}, 1, 1};
    shape.bend = {0.35, 0.2};
    const auto holds = [](const Vec3d& p) { return norm(p - kCentre) < kRadius; };
    return Swept::of(test::asset_of({test::traced_part(shape, {}, 65, 128, 1, 1.2,
                                                       [&](const Vec3d& o, const Vec3d& d, bool& inside) {
                                                         return test::bent_crossings_m(shape, holds, o, d,
                                                                                       1.2, inside);
                                                       })},
                                    2 * kRadius));
  }();
  return kSwept;
}

class SweptBall : public testing::TestWithParam<const Swept& (*)()> {};
INSTANTIATE_TEST_SUITE_P(Sweep, SweptBall, testing::Values(&ball, &ball_in_taper, &ball_in_bend));

TEST_P(SweptBall, IsMetWhereTheLineDoes) {
  const Swept& swept = GetParam()();
  std::mt19937_64 rng(1);
  const Instance instance = swept.at();
  int hits = 0, misses = 0, steps = 0;
  for (int i = 0; i < 1500; ++i) {
    // Through a place that is as likely within the ball as beside it.
    const Vec3d a = kCentre + 4.0 * random_direction(rng), through = kCentre + 1.1 * random_direction(rng),
                b = through + 0.6 * (through - a);
    const SweepResult result = swept.sweeper.sweep(instance, {cast<float>(a), cast<float>(b)}, kOptions);
    // The contact lies between those with a ball larger and one smaller by all errors.
    const double slack_m = kTolerance_m + kMapError_m;
    const double soonest = time_on_ball(a, b, kRadius + slack_m),
                 latest = time_on_ball(a, b, kRadius - slack_m);
    ASSERT_TRUE(result.status == SweepStatus::kContact || result.status == SweepStatus::kClear) << i;
    if (latest <= 1) {
      ++hits;
      ASSERT_EQ(result.status, SweepStatus::kContact) << i;
    }
    if (soonest > 1) {
      ++misses;
      EXPECT_EQ(result.status, SweepStatus::kClear) << i;
      EXPECT_EQ(result.time, 1.0F);
    }
    if (result.status == SweepStatus::kContact) {
      EXPECT_GE(result.time, soonest - 1e-6);
      EXPECT_LE(result.time, latest + 1e-6);
      const Vec3d p = cast<double>(result.contact.position_m);
      EXPECT_LT(norm(p - (a + static_cast<double>(result.time) * (b - a))), 1e-5);
      EXPECT_GT(dot(cast<double>(result.contact.normal), normalized(p - kCentre)), 0.99);
      EXPECT_NEAR(norm(cast<double>(result.contact.surface_m) - kCentre), kRadius, 2 * kMapError_m);
    }
    steps += result.steps;
  }
  EXPECT_GT(hits, 400);
  EXPECT_GT(misses, 400);
  EXPECT_LT(steps, 1500 * 25) << "on average";
}

TEST(Sweep, DoesNotTunnelThroughAPlateThinnerThanAThousandthOfTheStep) {
  for (const double half_m : {0.01, 1e-3, 1e-4}) {
    const Swept plate = Swept::of(plate_asset(half_m));
    std::mt19937_64 rng(2);
    std::uniform_real_distribution<double> along(-0.9, 0.9), above(0.5, 3);
    for (int i = 0; i < 400; ++i) {
      const Placement placement{
          {{along(rng), along(rng), along(rng), 1}, {along(rng), 2, 3}}, 1.5, i % 2 == 1};
      const Instance instance = plate.at(placement);
      const double side = i % 4 < 2 ? 1 : -1;
      const Vec3d target{along(rng), along(rng), 0};
      const Vec3d slope{along(rng), along(rng), side * above(rng)};
      const Vec3f from = instance.to_world(cast<float>(target - slope)),
                  to = instance.to_world(cast<float>(target + slope));
      ASSERT_FALSE(instance.query(from).inside);
      ASSERT_FALSE(instance.query(to).inside);
      const SweepResult result = plate.sweeper.sweep(instance, {from, to});
      ASSERT_EQ(result.status, SweepStatus::kContact) << half_m << ' ' << i;
      // Met on the side it comes from, at the plate, give or take the default tolerance and error.
      const double tolerance = (kSweepTolerance + kUndeclaredError) * 2.83 / std::abs(slope.z);
      EXPECT_NEAR(result.time, 0.5, tolerance / 2 + 1e-3);
      const Vec3f up = instance.to_world_direction({0, 0, -static_cast<float>(side)});
      EXPECT_GT(dot(result.contact.normal, up), 0.9F);
    }
  }
}

TEST(Sweep, PointsBesideThePlatePass) {
  const Swept plate = Swept::of(plate_asset(1e-3));
  const Instance instance = plate.at();
  std::mt19937_64 rng(3);
  std::uniform_real_distribution<float> along(-0.9F, 0.9F);
  for (int i = 0; i < 200; ++i) {
    const float x = i % 2 == 0 ? 1.25F : -1.25F;
    const SweepResult result = plate.sweeper.sweep(instance, {{x, along(rng), 2}, {x, along(rng), -2}});
    EXPECT_EQ(result.status, SweepStatus::kClear);
  }
}

TEST(Sweep, TurningPlateHitsARestingPoint) {
  // The plate turns by 90 degrees about its middle; the point waits at `angle` in its way.
  const Swept plate = Swept::of(plate_asset(1e-3));
  const double half_turn = std::numbers::pi / 4;
  const Instance start = plate.at(), end = plate.at({{{std::cos(half_turn), std::sin(half_turn), 0, 0}, {}}});
  for (double angle = 0.1; angle < 1.5; angle += 0.05) {
    for (const double radius : {0.2, 0.5, 0.9}) {
      const Vec3f p = cast<float>(radius * Vec3d{0, std::cos(angle), std::sin(angle)});
      const SweepResult result =
          plate.sweeper.sweep(start, end, {p, p}, {.tolerance_m = 1e-3F, .error_m = 1e-3F});
      ASSERT_EQ(result.status, SweepStatus::kContact) << angle << ' ' << radius;
      // It is met half the plate's thickness, and at most tolerance and error, before its middle.
      const double expected = angle / (std::numbers::pi / 2);
      EXPECT_LE(result.time, expected);
      EXPECT_GE(result.time, expected - 3.5e-3 / radius);
      const Vec3d n{0, -std::sin(angle), std::cos(angle)};
      EXPECT_GT(dot(cast<double>(result.contact.normal), n), 0.99) << "the face that came, as it stands then";
    }
    const Vec3f outside = cast<float>(1.3 * Vec3d{0, std::cos(angle), std::sin(angle)});
    EXPECT_EQ(plate.sweeper.sweep(start, end, {outside, outside}).status, SweepStatus::kClear);
  }
}

TEST(Sweep, MovingTheObjectOrThePointIsTheSame) {
  std::mt19937_64 rng(4);
  int hits = 0;
  for (int i = 0; i < 300; ++i) {
    const Vec3d a = 2.0 * random_direction(rng), by = 2.0 * random_direction(rng) - 1.5 * a;
    const Quaternion turn{1, a.x, a.y, by.z};
    const SweepResult moved_point =
        ball().sweeper.sweep(ball().at({{turn, {}}}), {cast<float>(a), cast<float>(a + by)}, kOptions);
    const SweepResult moved_object = ball().sweeper.sweep(ball().at({{turn, {}}}), ball().at({{turn, -by}}),
                                                          {cast<float>(a), cast<float>(a)}, kOptions);
    ASSERT_EQ(moved_point.status, moved_object.status);
    EXPECT_NEAR(moved_point.time, moved_object.time, 2e-4);
    hits += moved_point.status == SweepStatus::kContact;
  }
  EXPECT_GT(hits, 50);
  EXPECT_LT(hits, 250);
}

TEST(Sweep, AgreesWithDenseSamplingOfTurningMotions) {
  const std::vector<test::Ball> balls{{{-0.5, 0, 0}, 0.8}, {{0.5, 0.1, 0}, 0.7}};
  const Swept pair = Swept::of(test::two_balls(balls, 65, 128));
  // Texels are 0.04 m apart, and cells beside the seam bridge the crease between the balls.
  constexpr double kSeamError_m = 0.012;
  std::mt19937_64 rng(5);
  std::uniform_real_distribution<double> spin(-1.5, 1.5);
  int hits = 0, clear = 0, unresolved = 0;
  constexpr int kDraws = 300, kSamples = 3000;
  for (int i = 0; i < kDraws; ++i) {
    const Vec3d axis = random_direction(rng), shift = 0.5 * random_direction(rng);
    const double angle = spin(rng);
    const auto pose_at = [&](double t) {
      const double h = t * angle / 2;
      return Placement{
          {{std::cos(h), std::sin(h) * axis.x, std::sin(h) * axis.y, std::sin(h) * axis.z}, t * shift},
          0.7,
          i % 2 == 0};
    };
    const Vec3d a = 2.0 * random_direction(rng), b = random_direction(rng) - 0.7 * a;
    const SweepResult result = pair.sweeper.sweep(pair.at(pose_at(0)), pair.at(pose_at(1)),
                                                  {cast<float>(a), cast<float>(b)}, kOptions);
    // Distance to the union of balls, in closed form.
    const auto gap_m = [&](double t) {
      const Instance instance = pair.at(pose_at(t));
      const Vec3d p = cast<double>(instance.to_object(cast<float>((1 - t) * a + t * b)));
      double least = 1e9;
      for (const test::Ball& ball : balls) least = std::min(least, norm(p - ball.centre_m) - ball.radius_m);
      return 0.7 * least;
    };
    double first = 2, least_gap = 1e9;
    for (int k = 0; k <= kSamples && first > 1; ++k) {
      const double t = double(k) / kSamples, gap = gap_m(t);
      least_gap = std::min(least_gap, gap);
      if (gap < -kSeamError_m) first = t;
    }
    if (result.status == SweepStatus::kUnresolved) {
      ++unresolved;
      EXPECT_LE(result.time, first) << "what is called clear must be";
      continue;
    }
    if (first <= 1) {
      ASSERT_EQ(result.status, SweepStatus::kContact) << i;
      EXPECT_LE(result.time, first + 1e-6);
      ++hits;
    }
    if (result.status == SweepStatus::kContact) {
      EXPECT_LT(gap_m(static_cast<double>(result.time)), kTolerance_m + kSeamError_m);
    }
    if (least_gap > kTolerance_m + kSeamError_m) {
      EXPECT_EQ(result.status, SweepStatus::kClear);
      ++clear;
    }
  }
  EXPECT_GT(hits, kDraws / 5);
  EXPECT_GT(clear, kDraws / 5);
  EXPECT_LE(unresolved, kDraws / 100);
}

TEST(Sweep, GrazingPathsAreClearOutsideTheToleranceAndContactsWithinTheBall) {
  const Instance instance = ball().at();
  std::mt19937_64 rng(6);
  for (int i = 0; i < 300; ++i) {
    const Vec3d n = random_direction(rng), along = normalized(cross(n, random_direction(rng)));
    const auto graze = [&](double gap_m) {
      const Vec3d p = kCentre + (kRadius + gap_m) * n;
      return ball().sweeper.sweep(instance, {cast<float>(p - 2.0 * along), cast<float>(p + 2.0 * along)},
                                  kOptions);
    };
    EXPECT_EQ(graze(kTolerance_m + 2 * kMapError_m).status, SweepStatus::kClear);
    EXPECT_EQ(graze(-2 * kMapError_m).status, SweepStatus::kContact);
  }
}

TEST(Sweep, LeavesASurfaceItStartsBesideAndStopsAtOneItStartsIn) {
  const Instance instance = ball().at();
  std::mt19937_64 rng(7);
  for (int i = 0; i < 200; ++i) {
    const Vec3d n = random_direction(rng), way = normalized(n + 0.8 * random_direction(rng));
    const auto from = [&](double gap_m, const Vec3d& d) {
      const Vec3d p = kCentre + (kRadius + gap_m) * n;
      return ball().sweeper.sweep(instance, {cast<float>(p), cast<float>(p + 2.0 * d)}, kOptions);
    };
    EXPECT_EQ(from(2 * kMapError_m, way).status, SweepStatus::kClear);
    for (const Vec3d& d : {way, -way, Vec3d{}}) {
      const SweepResult inside = from(-0.05, d);
      EXPECT_EQ(inside.status, SweepStatus::kContact);
      EXPECT_TRUE(inside.starts_in_contact);
      EXPECT_EQ(inside.time, 0.0F);
      EXPECT_NEAR(inside.contact.depth_m, 0.05, kMapError_m);
    }
    const SweepResult later = from(0.5, -n);
    EXPECT_EQ(later.status, SweepStatus::kContact);
    EXPECT_FALSE(later.starts_in_contact);
  }
}

TEST(Sweep, OutOfStepsItSaysHowFarThePathIsClear) {
  const Instance instance = ball().at();
  const Vec3d a = kCentre + Vec3d{3, 0.3, 0}, b = kCentre - Vec3d{3, 0, 0};
  const double meets = time_on_ball(a, b, kRadius);
  float before = 0;
  bool resolved = false;
  for (std::uint32_t steps = 1; steps < 64 && !resolved; ++steps) {
    SweepOptions options = kOptions;
    options.max_steps = steps;
    const SweepResult result = ball().sweeper.sweep(instance, {cast<float>(a), cast<float>(b)}, options);
    resolved = result.status == SweepStatus::kContact;
    if (!resolved) {
      ASSERT_EQ(result.status, SweepStatus::kUnresolved);
    }
    EXPECT_LE(result.steps, steps);
    EXPECT_GE(result.time, before);
    EXPECT_LE(result.time, meets);
    before = result.time;
  }
  EXPECT_TRUE(resolved);
}

TEST(Sweep, FirstLayerMeetsTheSuperquadric) {
  // Semi-axis 1.15 along x.
  const SweepResult result =
      ball().sweeper.sweep(ball().at(), {{3.15F, 0, 0}, {-0.85F, 0, 0}}, {.query = {.layer = Layer::kOne}});
  ASSERT_EQ(result.status, SweepStatus::kContact);
  EXPECT_NEAR(result.time, 0.5, 1e-4);
}

TEST(Sweep, RefusesWhatItCannotAnswer) {
  const Swept plate = Swept::of(plate_asset(0.01));
  const Instance instance = ball().at();
  const PointMotion motion{{3, 0, 0}, {-3, 0, 0}};
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(ball().sweeper.sweep(instance, {{nan, 0, 0}, {0, 0, 0}}).status, SweepStatus::kInvalid);
  EXPECT_EQ(ball().sweeper.sweep(instance, {{0, 0, 0}, {0, INFINITY, 0}}).status, SweepStatus::kInvalid);
  EXPECT_EQ(plate.sweeper.sweep(instance, motion).status, SweepStatus::kInvalid) << "of another asset";
  EXPECT_EQ(ball().sweeper.sweep(instance, plate.at(), motion).status, SweepStatus::kInvalid);
  EXPECT_EQ(ball().sweeper.sweep(instance, ball().at({{}, 2}), motion).status, SweepStatus::kInvalid);
  EXPECT_EQ(ball().sweeper.sweep(instance, ball().at({{}, 1, true}), motion).status, SweepStatus::kInvalid);
  Asset broken = plate_asset(0.01);
  broken.parts[0].map.code.pop_back();
  EXPECT_FALSE(Sweeper::build(broken).ok());
}

TEST(Sweep, TakesTheErrorThatTheBundleDeclares) {
  Asset asset = test::ball_in_ellipsoid(kRadius, 17, 32);
  const auto error_at = [&](std::uint32_t level, Layer layer) {
    return std::move(Sweeper::build(asset)).value().declared_error_m({.layer = layer, .level = level});
  };
  EXPECT_DOUBLE_EQ(error_at(0, Layer::kThree), kUndeclaredError * asset.r_max_m);
  ErrorRow row;
  row.depth_p95_percent = 0.25;
  row.layer = 3;
  asset.errors.push_back(row);
  row.layer = 2;
  row.depth_p95_percent = 1;
  asset.errors.push_back(row);
  row.layer = 1;
  row.depth_p95_percent = std::numeric_limits<double>::quiet_NaN();
  asset.errors.push_back(row);
  EXPECT_DOUBLE_EQ(error_at(0, Layer::kThree), 0.0025 * asset.r_max_m);
  EXPECT_DOUBLE_EQ(error_at(0, Layer::kTwo), 0.01 * asset.r_max_m);
  EXPECT_DOUBLE_EQ(error_at(0, Layer::kAuto), 0.01 * asset.r_max_m);
}

TEST(Sweep, BatchEqualsSingleMotions) {
  const Instance start = ball().at(), end = ball().at({{{1, 0.2, 0, 0}, {0.1, 0, 0}}});
  std::mt19937_64 rng(8);
  std::vector<PointMotion> motions;
  for (int i = 0; i < 100; ++i)
    motions.push_back({cast<float>(2.0 * random_direction(rng)), cast<float>(random_direction(rng))});
  std::vector<SweepResult> results(motions.size());
  ball().sweeper.sweep(start, end, motions, results);
  for (std::size_t i = 0; i < motions.size(); ++i) {
    const SweepResult one = ball().sweeper.sweep(start, end, motions[i]);
    EXPECT_EQ(results[i].status, one.status);
    EXPECT_EQ(results[i].time, one.time);
    EXPECT_EQ(results[i].contact.point, i);
    EXPECT_EQ(results[i].contact.normal, one.contact.normal);
  }
}

}  // namespace
}  // namespace sqmap::runtime
