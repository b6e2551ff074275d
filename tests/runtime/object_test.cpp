// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/object.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "support/analytic_asset.hpp"
#include "support/targets.hpp"

namespace sqmap::runtime {
namespace {

constexpr double kRadius = 0.8;
const Vec3d kCentre{0.1, -0.05, 0.2};  // of the ball in test::ball_in_ellipsoid

Object built(const Asset& asset) {
  auto object = Object::build(asset);
  EXPECT_TRUE(object.ok()) << (object ? "" : object.error().finding);
  return std::move(object).value();
}

Vec3d random_direction(std::mt19937_64& rng) {
  std::normal_distribution<double> normal;
  return normalized(Vec3d{normal(rng), normal(rng), normal(rng)});
}

struct Worst {
  double distance_m{}, normal{}, foot_m{};
  int wrong_side{};
};

Worst worst_errors(const Object& object, Layer layer, std::uint32_t level) {
  std::mt19937_64 rng(7);
  std::uniform_real_distribution<double> depth(-0.1, 0.1);
  Worst worst;
  for (int i = 0; i < 2000; ++i) {
    const Vec3d n = random_direction(rng);
    const double d = depth(rng);
    const Answer answer = object.query(cast<float>(kCentre + (kRadius + d) * n), {layer, level});
    worst.wrong_side += answer.inside != (d < 0) && std::abs(d) > 1e-3;
    worst.distance_m = std::max(worst.distance_m, std::abs(answer.signed_distance_m - d));
    worst.normal = std::max(worst.normal, norm(cast<double>(answer.normal) - n));
    worst.foot_m = std::max(worst.foot_m, norm(cast<double>(answer.surface_m) - (kCentre + kRadius * n)));
  }
  return worst;
}

// From the foot point of a deep point, downhill ends on a nearer hillside of the map, not at the nearest
// point.
TEST(Object, FindsTheNearestSurfaceOfDeepPointsToo) {
  const Object object = built(test::ball_in_ellipsoid(kRadius, 65, 128));
  std::mt19937_64 rng(11);
  for (const double depth_m : {0.2, 0.3, 0.35}) {
    for (int i = 0; i < 1000; ++i) {
      const Vec3d direction = i == 0 ? normalized(Vec3d{-0.14941, -0.06768, -1}) : random_direction(rng);
      const Vec3d p = kCentre + (kRadius - depth_m) * direction;
      const Answer answer = object.query(cast<float>(p), {Layer::kThree});
      EXPECT_NEAR(answer.signed_distance_m, -depth_m, 0.01) << depth_m << " m below " << i;
    }
  }
}

TEST(Object, InnerPointsOverNoPatchKnowWhereTheirRayLeaves) {
  // A superquadric half within a ball: rays from its inner half bound no patch, but cross the ball's far
  // side.
  const std::vector<test::Ball> balls{{{}, 0.5}};
  const Vec3d centre_m{0.3, 0, 0};
  const Part part = test::traced_part({{0.3, 0.3, 0.3}, 1, 1}, centre_m, 65, 128, 1, 1,
                                      [&](const Vec3d& origin_m, const Vec3d& direction, bool& inside) {
                                        return test::union_crossings_m(balls, origin_m, direction, inside);
                                      });
  const Object object = built(test::asset_of({part}, 1));
  std::mt19937_64 rng(3);
  for (int i = 0; i < 500; ++i) {
    Vec3d direction = random_direction(rng);
    direction.x = -2 - std::abs(direction.x);  // away from the part of the superquadric beyond the ball
    const Vec3d p_m = centre_m + 0.02 * normalized(direction);
    const Answer answer = object.query(cast<float>(p_m), {Layer::kTwo});
    EXPECT_TRUE(answer.inside);
    EXPECT_NEAR(answer.signed_distance_m, norm(p_m) - 0.5, 0.02) << i;
    EXPECT_NEAR(norm(cast<double>(answer.surface_m)), 0.5, 1e-3) << i;
    EXPECT_GT(dot(cast<double>(answer.normal), normalized(cast<double>(answer.surface_m))), 0.9) << i;
  }
}

TEST(Object, ThirdLayerTellsTheDistanceToABall) {
  const Worst worst = worst_errors(built(test::ball_in_ellipsoid(kRadius, 65, 128)), Layer::kThree, 0);
  EXPECT_LT(worst.distance_m, 1e-3);
  EXPECT_LT(worst.normal, 0.06);  // bilinear depth: the slope errs by half a cell's turn, 0.05 rad here
  EXPECT_LT(worst.foot_m, 5e-3);
  EXPECT_EQ(worst.wrong_side, 0);
}

TEST(Object, ThirdLayerConvergesWithDensityAndSecondDoesNot) {
  // Corollary 1: on a Q1 shape the represented surface converges. Depth along the superquadric's normal is
  // not distance, however fine the map.
  const double coarse =
      worst_errors(built(test::ball_in_ellipsoid(kRadius, 17, 32)), Layer::kThree, 0).distance_m;
  const double fine =
      worst_errors(built(test::ball_in_ellipsoid(kRadius, 65, 128)), Layer::kThree, 0).distance_m;
  EXPECT_LT(fine, coarse / 8) << "bilinear: second order";
  const double second =
      worst_errors(built(test::ball_in_ellipsoid(kRadius, 65, 128)), Layer::kTwo, 0).distance_m;
  EXPECT_GT(second, 10 * fine);
}

TEST(Object, CoarseLevelAnswersLikeTheCoarseMap) {
  const Object pyramid = built(test::ball_in_ellipsoid(kRadius, 65, 128, 3));
  const Object coarse = built(test::ball_in_ellipsoid(kRadius, 17, 32));
  EXPECT_EQ(pyramid.level_count(), 3U);
  std::mt19937_64 rng(8);
  for (int i = 0; i < 500; ++i) {
    const Vec3f p = cast<float>(kCentre + 0.75 * random_direction(rng));
    for (const Layer layer : {Layer::kTwo, Layer::kThree}) {
      EXPECT_NEAR(pyramid.query(p, {.layer = layer, .level = 2}).signed_distance_m,
                  coarse.query(p, {.layer = layer, .level = 0}).signed_distance_m, 2e-3);
    }
  }
}

TEST(Object, FirstLayerIsTheSuperquadricItself) {
  const Object object = built(test::ball_in_ellipsoid(kRadius, 17, 32));
  EXPECT_TRUE(object.query({1.14F, 0, 0}, {Layer::kOne}).inside);
  EXPECT_FALSE(object.query({1.16F, 0, 0}, {Layer::kOne}).inside);
  EXPECT_TRUE(std::isnan(object.query({1.14F, 0, 0}, {Layer::kOne}).signed_distance_m));
  EXPECT_FALSE(object.query({1.14F, 0, 0}, {Layer::kTwo}).inside);
}

TEST(Object, AutomaticLayerFollowsThePapersRule) {
  Asset asset = test::ball_in_ellipsoid(kRadius, 17, 32);
  asset.parts[0].vertex_count = 17 * 32 / 10 + 1;  // rows * cols < 10 N_m
  EXPECT_EQ(built(asset).query({0.5F, 0, 0}).layer, Layer::kThree);
  asset.parts[0].vertex_count = 17 * 32 / 10;
  EXPECT_EQ(built(asset).query({0.5F, 0, 0}).layer, Layer::kTwo);
}

TEST(Object, SaysNowhereOutsideEverySuperquadricAndForPointsThatAreNotFinite) {
  const Object object = built(test::ball_in_ellipsoid(kRadius, 17, 32));
  const float nan = std::numeric_limits<float>::quiet_NaN(),
              infinity = std::numeric_limits<float>::infinity();
  for (const Vec3f& p :
       {Vec3f{5, 0, 0}, Vec3f{1e30F, 1e30F, -1e30F}, Vec3f{nan, 0, 0}, Vec3f{0, infinity, 0}}) {
    const Answer answer = object.query(p);
    EXPECT_FALSE(answer.inside);
    EXPECT_EQ(answer.part, kNowhere);
    EXPECT_TRUE(std::isnan(answer.signed_distance_m));
    EXPECT_EQ(answer.normal, Vec3f{});
  }
}

TEST(Object, AnswersAreFiniteAtCentrePolesSeamsAndAxes) {
  const Object object = built(test::ball_in_ellipsoid(kRadius, 17, 32));
  for (const float x : {-0.999F, -0.5F, -1e-30F, 0.0F, 1e-38F, 0.5F, 0.999F}) {
    for (const Vec3f& p :
         {Vec3f{x, 0, 0}, Vec3f{0, 1.2F * x, 0}, Vec3f{0, 0, 1.4F * x}, Vec3f{x / 2, x / 2, 0}}) {
      for (const Layer layer : {Layer::kTwo, Layer::kThree}) {
        const Answer answer = object.query(p, {layer});
        EXPECT_TRUE(std::isfinite(answer.signed_distance_m)) << p.x << ' ' << p.y << ' ' << p.z;
        EXPECT_NEAR(norm(answer.normal), 1, 1e-4);
      }
    }
  }
}

TEST(Object, SecondSheetBehindTheFirstIsOutside) {
  // A hollow ball: material between radii 0.6 and 0.8; the cavity is outside of the material.
  Part part =
      test::traced_part({{1, 1, 1}, 1, 1}, {}, 33, 64, 1, 1, [](const Vec3d&, const Vec3d&, bool& inside) {
        inside = false;
        return std::vector<double>{0.2, 0.4};
      });
  const Object object = built(test::asset_of({part}, 2));
  std::mt19937_64 rng(9);
  for (int i = 0; i < 200; ++i) {
    const Vec3d n = random_direction(rng);
    std::vector<Vec3f> points;
    for (const double r : {0.55, 0.62, 0.7, 0.85}) points.push_back(cast<float>(r * n));
    for (const Layer layer : {Layer::kTwo, Layer::kThree}) {
      EXPECT_TRUE(test::every_target_agrees(object, points, {layer}));
      const auto ask = [&](double r) { return object.query(cast<float>(r * n), {layer}); };
      EXPECT_FALSE(ask(0.85).inside);
      EXPECT_TRUE(ask(0.7).inside);
      EXPECT_FALSE(ask(0.55).inside);
      EXPECT_NEAR(ask(0.55).signed_distance_m, 0.05, 3e-3);
      EXPECT_NEAR(ask(0.62).signed_distance_m, -0.02, 3e-3);
      EXPECT_LT(dot(cast<double>(ask(0.55).normal), n), -0.99) << "the cavity's wall faces the centre";
    }
  }
}

TEST(Object, CrossingASeamKeepsTheDepth) {
  const std::vector<test::Ball> balls{{{-0.5, 0, 0}, 0.8}, {{0.5, 0.1, 0}, 0.7}};
  const Object object = built(test::two_balls(balls, 65, 128));
  // The plane z = 0 holds both centres, so nearest points lie in it: the outline of the union, densely.
  std::vector<Vec3d> outline;
  const auto inside_any = [&](const Vec3d& p) {
    return std::any_of(balls.begin(), balls.end(),
                       [&](const test::Ball& b) { return norm(p - b.centre_m) < b.radius_m - 1e-9; });
  };
  for (const test::Ball& b : balls) {
    for (int i = 0; i < 4000; ++i) {
      const double turn = i * 2 * 3.14159265358979 / 4000;
      const Vec3d p = b.centre_m + b.radius_m * Vec3d{std::cos(turn), std::sin(turn), 0};
      if (!inside_any(p)) outline.push_back(p);
    }
  }
  const auto distance_m = [&](const Vec3d& p) {
    double least = 1e9;
    for (const Vec3d& q : outline) least = std::min(least, norm(p - q));
    return least;
  };
  // Slide at constant depth over one ball, across the seam, onto the other.
  int counted = 0, off = 0, wrong_side = 0;
  std::vector<Vec3f> points;
  for (const Vec3d& surface_m : outline) {
    const Vec3d centre = norm(surface_m - balls[0].centre_m) < balls[0].radius_m + 1e-6 ? balls[0].centre_m
                                                                                        : balls[1].centre_m;
    const Vec3d p = surface_m - 0.02 * normalized(surface_m - centre);
    points.push_back(cast<float>(p));
    const Answer answer = object.query(points.back(), {Layer::kThree});
    const double ratio = -answer.signed_distance_m / distance_m(p);
    ++counted;
    wrong_side += !answer.inside;
    off += !(ratio > 0.5 && ratio < 1.5);
  }
  EXPECT_TRUE(test::every_target_agrees(object, points, {Layer::kThree}));
  EXPECT_GT(counted, 4000);
  EXPECT_EQ(wrong_side, 0);
  EXPECT_EQ(off, 0) << "depth jumps at the seam";
}

TEST(Object, InnerPointsHaveADistanceEvenBesideASeam) {
  // The hole that the seam leaves in both maps: the feet of points between the balls lie inside the mesh.
  const std::vector<test::Ball> balls{{{-0.5, 0, 0}, 0.8}, {{0.5, 0, 0}, 0.8}};
  const Object object = built(test::two_balls(balls, 65, 128));
  std::mt19937 rng(11);
  std::uniform_real_distribution<double> share(-1, 1);
  int inner = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3d p_m{1.3 * share(rng), 0.8 * share(rng), 0.8 * share(rng)};
    const Answer answer = object.query(cast<float>(p_m), {Layer::kThree, 0});
    if (!answer.inside) continue;
    ++inner;
    ASSERT_TRUE(std::isfinite(answer.signed_distance_m)) << p_m.x << ' ' << p_m.y << ' ' << p_m.z;
    // The surface it speaks of is the mesh's: on one ball and not inside the other.
    double nearest_m = 10;
    for (const auto& ball : balls)
      nearest_m = std::min(nearest_m, norm(cast<double>(answer.surface_m) - ball.centre_m) - ball.radius_m);
    EXPECT_NEAR(nearest_m, 0, 0.02);
  }
  EXPECT_GT(inner, 5000);
}

TEST(Object, MostInnerPointsFindTheNearestWallWhereTheirFootLiesBehindAnother) {
  // A plate across a wide superquadric: of most points of its sides the foot lies behind an edge of the
  // plate.
  const Vec3d half_m{0.4, 0.8, 0.75}, centre_m{0.05, 0, 0};
  const auto crossings = [&](const Vec3d& o, const Vec3d& d, bool& inside) {
    double enter = -1e9, leave = 1e9;
    for (int k = 0; k < 3; ++k) {
      const double a = (centre_m[k] - half_m[k] - o[k]) / d[k], b = (centre_m[k] + half_m[k] - o[k]) / d[k];
      enter = std::max(enter, std::min(a, b));
      leave = std::min(leave, std::max(a, b));
    }
    inside = false;
    return enter < leave && leave > 0 ? std::vector<double>{enter, leave} : std::vector<double>{};
  };
  const Object object =
      built(test::asset_of({test::traced_part({{1.3, 1.1, 1}, 0.8, 0.8}, {}, 65, 128, 1, 2, crossings)}, 2));
  std::mt19937 rng(21);
  std::uniform_real_distribution<double> share(-0.85, 0.85);
  int far_off = 0;
  for (int i = 0; i < 4000; ++i) {
    const Vec3d from_centre{half_m.x * share(rng), half_m.y * share(rng), half_m.z * share(rng)};
    double nearest_m = 1;
    for (int k = 0; k < 3; ++k) nearest_m = std::min(nearest_m, half_m[k] - std::abs(from_centre[k]));
    const Answer answer = object.query(cast<float>(centre_m + from_centre), {Layer::kThree});
    ASSERT_TRUE(answer.inside);
    far_off += std::abs(-answer.signed_distance_m - nearest_m) > 0.03;
  }
  EXPECT_LT(far_off, 700) << "of 4000; from the feet alone more than half are";
}

TEST(Object, OffsetKeepsFacesOutThatTheirCornersMiss) {
  const Object object = built(test::ball_in_ellipsoid(kRadius, 65, 128));
  constexpr float kEdge = 0.4F;
  std::mt19937_64 rng(12);
  double deepest_plain = 0, deepest_offset = 0;
  for (int i = 0; i < 300; ++i) {
    // An equilateral face over the ball, lowered until its first corner is at distance 0.
    const Vec3d n = random_direction(rng), u = normalized(cross(n, random_direction(rng))), v = cross(n, u);
    for (const float edge : {0.0F, kEdge}) {
      double height = kRadius + 0.05;
      const auto corner = [&](int k) {
        const double turn = k * 2 * 3.14159265358979 / 3;
        return kCentre + height * n + kEdge / std::sqrt(3.0) * (std::cos(turn) * u + std::sin(turn) * v);
      };
      const auto touches = [&] {
        for (int k = 0; k < 3; ++k) {
          const Answer answer = object.query(cast<float>(corner(k)),
                                             {.layer = Layer::kThree, .level = 0, .edge_length_m = edge});
          if (answer.signed_distance_m <= 0) return true;
        }
        return false;
      };
      while (!touches() && height > 0.5) height -= 1e-3;
      double& deepest = edge > 0 ? deepest_offset : deepest_plain;
      deepest = std::max(deepest, kRadius - height);  // how far the face's middle is inside the ball
    }
  }
  EXPECT_GT(deepest_plain, 0.02) << "corners alone let the face cut the ball";
  EXPECT_LT(deepest_offset, 0.006);
}

TEST(Object, BatchEqualsSinglePointsAndWritesOnlyWhatIsWanted) {
  const Object object = built(test::ball_in_ellipsoid(kRadius, 17, 32));
  std::mt19937_64 rng(10);
  std::vector<Vec3f> points;
  for (int i = 0; i < 300; ++i) points.push_back(cast<float>(1.1 * random_direction(rng)));
  points.push_back({std::numeric_limits<float>::quiet_NaN(), 0, 0});
  std::vector<float> distance(points.size(), 42);
  std::vector<Vec3f> normal(points.size());
  std::vector<std::uint8_t> inside(points.size());
  object.query(points, {.signed_distance_m = distance, .normal = normal, .inside = inside});
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Answer one = object.query(points[i]);
    EXPECT_TRUE(distance[i] == one.signed_distance_m ||
                (std::isnan(distance[i]) && std::isnan(one.signed_distance_m)));
    EXPECT_EQ(normal[i], one.normal);
    EXPECT_EQ(inside[i] != 0, one.inside);
  }
}

TEST(Object, ManyThreadsReadOneObject) {
  const Object object = built(test::ball_in_ellipsoid(kRadius, 33, 64));
  std::vector<Vec3f> points;
  std::mt19937_64 rng(11);
  for (int i = 0; i < 2000; ++i) points.push_back(cast<float>(0.9 * random_direction(rng)));
  std::vector<std::vector<float>> answers(4, std::vector<float>(points.size()));
  {
    std::vector<std::jthread> threads;
    for (auto& out : answers) threads.emplace_back([&] { object.query(points, {.signed_distance_m = out}); });
  }
  for (const auto& out : answers) EXPECT_EQ(out, answers[0]);
}

TEST(Object, RefusesAnAssetThatBreaksARule) {
  Asset asset = test::ball_in_ellipsoid(kRadius, 17, 32);
  asset.parts[0].map.code.pop_back();
  const auto object = Object::build(asset);
  ASSERT_FALSE(object.ok());
  EXPECT_EQ(object.error().status, Status::kInvalidAsset);
}

}  // namespace
}  // namespace sqmap::runtime
