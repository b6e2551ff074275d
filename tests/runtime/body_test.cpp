// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/body.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "sqmap/runtime/budget.hpp"
#include "sqmap/runtime/contact.hpp"
#include "sqmap/runtime/object.hpp"

#include "support/mixed_asset.hpp"

namespace sqmap::runtime {
namespace {

const Asset& asset() {
  static const Asset instance = test::mixed_asset();
  return instance;
}
const Object& object() {
  static const Result<Object> instance = Object::build(asset());
  return instance.value();
}

/// A hand-like cloud: a ball's surface, dense, and a spike.
std::vector<Vec3f> cloud(std::size_t count, std::uint64_t seed, double radius_m = 0.5) {
  std::mt19937_64 rng(seed);
  std::normal_distribution<double> normal;
  std::vector<Vec3f> points;
  while (points.size() < count) {
    const Vec3d d = normalized(Vec3d{normal(rng), normal(rng), normal(rng)});
    points.push_back(cast<float>(radius_m * (points.size() % 7 == 0 ? std::abs(normal(rng)) : 1) * d));
  }
  return points;
}

PointBody built(const std::vector<Vec3f>& points) {
  auto body = PointBody::build(points);
  EXPECT_TRUE(body.ok());
  return std::move(body).value();
}

std::vector<BodyPlacement> placements(double scale) {
  std::mt19937_64 rng(31);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<BodyPlacement> result;
  for (int i = 0; i < 12; ++i) {
    BodyPlacement placement;
    placement.object_from_body.orientation = {unit(rng), unit(rng), unit(rng), unit(rng)};
    placement.object_from_body.translation_m = 1.2 * Vec3d{unit(rng), unit(rng), 1.5 * unit(rng)};
    placement.scale = scale;
    result.push_back(placement);
  }
  return result;
}

std::vector<Vec3f> moved(const std::vector<Vec3f>& points, const BodyPlacement& placement) {
  const Rotation<double> r = rotation<double>(placement.object_from_body.orientation);
  Rotation<float> turn;
  for (std::size_t k = 0; k < 3; ++k) turn.row[k] = cast<float>(placement.scale * r.row[k]);
  const Vec3f t = cast<float>(placement.object_from_body.translation_m);
  std::vector<Vec3f> result;
  for (const Vec3f& p : points) result.push_back(turn.apply(p) + t);
  return result;
}

bool same(float a, float b) { return a == b || (std::isnan(a) && std::isnan(b)); }

TEST(Body, AnswersLikeABatchOfTheMovedPoints) {
  const std::vector<Vec3f> points = cloud(1234, 32);
  const PointBody body = built(points);
  int known = 0;
  for (const double scale : {1.0, 0.25, 1.7}) {
    for (const BodyPlacement& placement : placements(scale)) {
      for (const Layer layer : {Layer::kOne, Layer::kTwo, Layer::kThree}) {
        std::vector<float> distance_m(points.size());
        std::vector<Vec3f> normal(points.size()), surface_m(points.size());
        std::vector<std::uint8_t> inside(points.size());
        object().query(
            body, placement,
            {.signed_distance_m = distance_m, .normal = normal, .surface_m = surface_m, .inside = inside},
            {layer});
        const std::vector<Vec3f> there = moved(points, placement);
        for (std::size_t i = 0; i < points.size(); ++i) {
          const Answer one = object().query(there[i], {layer});
          ASSERT_TRUE(same(distance_m[i], one.signed_distance_m)) << i;
          ASSERT_EQ(normal[i], one.normal);
          ASSERT_EQ(surface_m[i], one.surface_m);
          ASSERT_EQ(inside[i] != 0, one.inside);
          known += !std::isnan(one.signed_distance_m);
        }
      }
    }
  }
  EXPECT_GT(known, 5000);
}

TEST(Body, ContactsAreThePointsBelowTheLimit) {
  const std::vector<Vec3f> points = cloud(1500, 33);
  const PointBody body = built(points);
  std::size_t total = 0;
  for (const float within_m : {0.0F, 0.05F}) {
    for (const Layer layer : {Layer::kOne, Layer::kTwo, Layer::kThree, Layer::kAuto}) {
      for (const BodyPlacement& placement : placements(1)) {
        ContactQuery query;
        query.options.layer = layer;
        query.within_m = within_m;
        const std::vector<Vec3f> there = moved(points, placement);
        std::vector<Contact> expected;
        for (std::uint32_t i = 0; i < points.size(); ++i) {
          const Answer one = object().query(there[i], query.options);
          const bool unknown = std::isnan(one.signed_distance_m);
          if (!(one.signed_distance_m < within_m) && !(unknown && one.inside)) continue;
          expected.push_back(
              {i, one.part, unknown ? 0 : -one.signed_distance_m, one.normal, there[i], one.surface_m});
        }
        std::vector<Contact> found(points.size());
        const std::size_t count = object().contacts(body, placement, found, query);
        found.resize(count);
        std::sort(found.begin(), found.end(),
                  [](const Contact& a, const Contact& b) { return a.point < b.point; });
        ASSERT_EQ(found.size(), expected.size()) << "layer " << int(layer) << " within " << within_m;
        for (std::size_t k = 0; k < found.size(); ++k) {
          ASSERT_EQ(found[k].point, expected[k].point);
          ASSERT_EQ(found[k].part, expected[k].part);
          ASSERT_EQ(found[k].depth_m, expected[k].depth_m);
          ASSERT_EQ(found[k].normal, expected[k].normal);
          ASSERT_EQ(found[k].position_m, expected[k].position_m);
          ASSERT_EQ(found[k].surface_m, expected[k].surface_m);
        }
        total += count;

        Contact one;
        query.seek = Seek::kAny;
        ASSERT_EQ(object().contacts(body, placement, {&one, 1}, query), std::min<std::size_t>(1, count));
        if (count > 0) {
          ASSERT_TRUE(std::any_of(expected.begin(), expected.end(),
                                  [&](const Contact& c) { return c.point == one.point; }));
        }
        query.seek = Seek::kDeepest;
        ASSERT_EQ(object().contacts(body, placement, {&one, 1}, query), std::min<std::size_t>(1, count));
        if (count == 0) continue;
        const auto deepest =
            std::max_element(expected.begin(), expected.end(),
                             [](const Contact& a, const Contact& b) { return a.depth_m < b.depth_m; });
        ASSERT_EQ(one.point, deepest->point);
        ASSERT_EQ(one.depth_m, deepest->depth_m);
      }
    }
  }
  EXPECT_GT(total, 2000U);
}

TEST(Body, CountsContactsThatDoNotFit) {
  const std::vector<Vec3f> points = cloud(900, 34);
  const PointBody body = built(points);
  BodyPlacement inside;
  inside.object_from_body.translation_m = {-0.4, 0, 0};
  std::vector<Contact> all(points.size()), few(5);
  const std::size_t count = object().contacts(body, inside, all, {});
  ASSERT_GT(count, 20U);
  EXPECT_EQ(object().contacts(body, inside, few, {}), count);
  EXPECT_EQ(object().contacts(body, inside, {}, {}), count);
  for (std::size_t k = 0; k < few.size(); ++k) EXPECT_EQ(few[k].point, all[k].point);
}

TEST(Body, RefitAnswersLikeABodyBuiltFromThere) {
  std::vector<Vec3f> points = cloud(700, 35);
  PointBody cloth = built(points);
  for (Vec3f& p : points) p = {0.6F * p.x + 0.3F * p.y * p.y, p.z, -1.4F * p.y};
  ASSERT_TRUE(cloth.refit(points));
  const PointBody fresh = built(points);
  EXPECT_EQ(cloth.sphere_centre_m(), fresh.sphere_centre_m());
  for (const BodyPlacement& placement : placements(1)) {
    std::vector<float> a(points.size()), b(points.size());
    object().query(cloth, placement, {.signed_distance_m = a});
    object().query(fresh, placement, {.signed_distance_m = b});
    for (std::size_t i = 0; i < points.size(); ++i) ASSERT_TRUE(same(a[i], b[i]));
  }
}

TEST(Body, RefitRefusesAnotherCountAndPointsThatAreNotFinite) {
  std::vector<Vec3f> points = cloud(100, 36);
  PointBody body = built(points);
  const Vec3f centre = body.sphere_centre_m();
  EXPECT_FALSE(body.refit(std::span(points).first(99)));
  points[40].y = std::numeric_limits<float>::infinity();
  EXPECT_FALSE(body.refit(points));
  EXPECT_EQ(body.sphere_centre_m(), centre);
}

TEST(Body, RefusesPointsThatAreNotFinite) {
  std::vector<Vec3f> points = cloud(100, 37);
  points[17].z = std::numeric_limits<float>::quiet_NaN();
  const auto body = PointBody::build(points);
  ASSERT_FALSE(body.ok());
  EXPECT_EQ(body.error().status, Status::kInvalidMesh);
  EXPECT_NE(body.error().finding.find("point 17"), std::string::npos);
}

TEST(Body, EmptyBodiesAndPlacesThatAreNotFiniteTouchNothing) {
  const PointBody empty = built({});
  EXPECT_EQ(object().contacts(empty, {}, {}, {}), 0U);
  const PointBody body = built(cloud(50, 38));
  BodyPlacement nowhere;
  nowhere.object_from_body.translation_m.y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(object().contacts(body, nowhere, {}, {}), 0U);
  nowhere = {};
  nowhere.scale = std::numeric_limits<double>::infinity();
  EXPECT_EQ(object().contacts(body, nowhere, {}, {}), 0U);
}

TEST(Body, HoldsEveryPointInABlockOfNeighbours) {
  // The point of blocks: with 4,000 points their balls are far smaller than the ball around all.
  const std::vector<Vec3f> points = cloud(4000, 39, 1.0);
  const PointBody body = built(points);
  EXPECT_EQ(body.point_count(), points.size());
  EXPECT_GE(body.resident_bytes(), 16 * points.size());
  EXPECT_LE(body.resident_bytes(), 16 * (points.size() + 160) + 1024);
  float most = 0;
  for (const Vec3f& p : points) most = std::max(most, norm(p - body.sphere_centre_m()));
  EXPECT_GE(body.sphere_radius_m(), most);
  EXPECT_LE(body.sphere_radius_m(), 1.1F * most);
}

TEST(Budget, AffordsTheDeepestLayerWithinItAndSaysSo) {
  const std::vector<Vec3f> points = cloud(1500, 41);
  const PointBody body = built(points);
  int deeper = 0;
  for (const BodyPlacement& placement : placements(1)) {
    ContactQuery query;
    query.options.layer = Layer::kThree;
    query.within_m = 0.05F;
    WorkBudget all{.units = 1U << 30};
    std::vector<Contact> found(points.size()), expected(points.size());
    object().contacts(body, placement, found, query, all);
    ASSERT_EQ(all.layer, Layer::kThree);
    ASSERT_LE(all.spent, all.units);
    Layer last = Layer::kThree;
    for (std::uint64_t units = all.spent;; units = units * 3 / 4) {
      WorkBudget budget{.units = units};
      const std::size_t count = object().contacts(body, placement, found, query, budget);
      ASSERT_LE(budget.layer, last) << "less to spend looked closer";
      ASSERT_TRUE(budget.spent <= units || budget.layer == Layer::kOne);
      deeper += budget.layer != last;
      last = budget.layer;
      ContactQuery fixed = query;
      fixed.options.layer = budget.layer;
      ASSERT_EQ(object().contacts(body, placement, expected, fixed), count);
      for (std::size_t k = 0; k < count; ++k) {
        ASSERT_EQ(found[k].point, expected[k].point);
        ASSERT_EQ(found[k].depth_m, expected[k].depth_m);
        ASSERT_EQ(found[k].normal, expected[k].normal);
      }
      if (units == 0) break;
    }
  }
  EXPECT_GT(deeper, 10) << "the placements hardly touch";
}

TEST(Budget, CostsTheSameOnEveryInstructionSetAndNothingFarAway) {
  const PointBody body = built(cloud(1500, 42));
  const SimdTarget before = simd_target();
  BodyPlacement far;
  far.object_from_body.translation_m = {50, 0, 0};
  for (const SimdTarget target :
       {SimdTarget::kBaseline, SimdTarget::kSse4, SimdTarget::kAvx2, SimdTarget::kAvx512}) {
    if (!set_simd_target(target)) continue;
    for (const BodyPlacement& placement : placements(1)) {
      WorkBudget here{.units = 5000}, there{.units = 5000};
      object().contacts(body, placement, {}, {}, here);
      set_simd_target(before);
      object().contacts(body, placement, {}, {}, there);
      set_simd_target(target);
      ASSERT_EQ(here.spent, there.spent);
      ASSERT_EQ(here.layer, there.layer);
    }
    WorkBudget nothing;
    EXPECT_EQ(object().contacts(body, far, {}, {}, nothing), 0U);
    EXPECT_EQ(nothing.spent, 0U);
    EXPECT_EQ(nothing.layer, Layer::kThree) << "what costs nothing is always afforded";
  }
  set_simd_target(before);
}

TEST(Budget, RateFollowsSlowFramesFasterThanFastOnes) {
  WorkRate rate(100);
  rate.learn(1000, 20);  // 50 units a microsecond
  EXPECT_DOUBLE_EQ(rate.units_per_us(), 75);
  rate.learn(1000, 1000.0 / 91);
  EXPECT_NEAR(rate.units_per_us(), 76, 1e-9);
  for (const double took_us : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()})
    rate.learn(1000, took_us);
  rate.learn(3, 1e9);
  EXPECT_NEAR(rate.units_per_us(), 76, 1e-9) << "frames that say nothing changed it";
  EXPECT_EQ(rate.units_for(10), 760U);
  EXPECT_EQ(rate.units_for(std::numeric_limits<double>::quiet_NaN()), 0U);
  EXPECT_GT(rate.units_for(std::numeric_limits<double>::infinity()), 1U << 30);
}

TEST(Body, EveryInstructionSetFindsTheSameContacts) {
  const std::vector<Vec3f> points = cloud(2000, 40);
  const PointBody body = built(points);
  const SimdTarget before = simd_target();
  for (const BodyPlacement& placement : placements(1)) {
    std::vector<Contact> first(points.size()), other(points.size());
    set_simd_target(SimdTarget::kBaseline);
    const std::size_t count = object().contacts(body, placement, first, {});
    for (const SimdTarget target : {SimdTarget::kSse4, SimdTarget::kAvx2, SimdTarget::kAvx512}) {
      if (!set_simd_target(target)) continue;
      ASSERT_EQ(object().contacts(body, placement, other, {}), count);
      for (std::size_t k = 0; k < count; ++k) {
        ASSERT_EQ(other[k].point, first[k].point);
        ASSERT_EQ(other[k].depth_m, first[k].depth_m);
        ASSERT_EQ(other[k].normal, first[k].normal);
      }
    }
  }
  set_simd_target(before);
}

}  // namespace
}  // namespace sqmap::runtime
