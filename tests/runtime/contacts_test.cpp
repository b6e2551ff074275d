// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/contacts.hpp"

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "support/analytic_asset.hpp"

namespace sqmap::runtime {
namespace {

const std::vector<test::Ball> kBalls{{{-0.5, 0, 0}, 0.8}, {{0.5, 0.1, 0}, 0.7}};

const Object& balls() {
  static const Object kObject = std::move(Object::build(test::two_balls(kBalls, 33, 64))).value();
  return kObject;
}

Instance placed() {
  return Instance::place(balls(), Placement{{{0.9, 0.1, -0.3, 0.2}, {5, -2, 1}}, 0.5, true}).value();
}

/// Points around the instance; `spread` in its radii.
std::vector<Vec3f> cloud(const Instance& instance, std::size_t count, double spread, std::uint64_t seed) {
  std::mt19937_64 rng(seed);
  std::uniform_real_distribution<double> side(-1, 1);
  const BoundingSphere sphere = instance.sphere();
  std::vector<Vec3f> points;
  for (std::size_t i = 0; i < count; ++i) {
    points.push_back(
        cast<float>(sphere.centre_m + spread * sphere.radius_m * Vec3d{side(rng), side(rng), side(rng)}));
  }
  return points;
}

void expect_same(const Contact& a, const Contact& b) {
  EXPECT_EQ(a.point, b.point);
  EXPECT_EQ(a.part, b.part);
  EXPECT_EQ(a.depth_m, b.depth_m);
  EXPECT_EQ(a.normal, b.normal);
  EXPECT_EQ(a.position_m, b.position_m);
  EXPECT_EQ(a.surface_m, b.surface_m);
}

/// All contacts by one query a point.
std::vector<Contact> one_by_one(const Instance& instance, const std::vector<Vec3f>& points,
                                const QueryOptions& options) {
  std::vector<Contact> contacts;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Answer answer = instance.query(points[i], options);
    const bool touches =
        answer.signed_distance_m < 0 || (answer.inside && std::isnan(answer.signed_distance_m));
    if (!touches) continue;
    const float depth_m = answer.signed_distance_m < 0 ? -answer.signed_distance_m : 0;
    contacts.push_back({static_cast<std::uint32_t>(i), answer.part, depth_m, answer.normal, points[i],
                        depth_m > 0 ? answer.surface_m : points[i]});
  }
  return contacts;
}

TEST(Contacts, OfABatchAreThoseOfItsPointsOneByOne) {
  const Instance instance = placed();
  const std::vector<Vec3f> points = cloud(instance, 3000, 1.3, 1);
  for (const Layer layer : {Layer::kOne, Layer::kTwo, Layer::kThree}) {
    const QueryOptions options{layer};
    const std::vector<Contact> expected = one_by_one(instance, points, options);
    ASSERT_GT(expected.size(), 200U);
    ASSERT_LT(expected.size(), 2000U);

    std::vector<Contact> found(points.size());
    const ContactCount count = all_contacts(instance, points, found, options);
    ASSERT_EQ(count.found, expected.size());
    EXPECT_TRUE(count.fits());
    for (std::size_t k = 0; k < expected.size(); ++k) expect_same(found[k], expected[k]);

    const auto first = first_contact(instance, points, options);
    ASSERT_TRUE(first.has_value());
    expect_same(*first, expected.front());

    const Contact* deepest_expected = expected.data();
    for (const Contact& contact : expected)
      if (contact.depth_m > deepest_expected->depth_m) deepest_expected = &contact;
    const auto deepest = deepest_contact(instance, points, options);
    ASSERT_TRUE(deepest.has_value());
    expect_same(*deepest, *deepest_expected);
    EXPECT_TRUE(any_contact(instance, points, options));
  }
}

TEST(Contacts, AreThePointsInsideTheBalls) {
  const Instance instance = placed();
  const std::vector<Vec3f> points = cloud(instance, 4000, 1.1, 2);
  std::vector<Contact> contacts(points.size());
  contacts.resize(all_contacts(instance, points, contacts, {Layer::kThree}).written);
  std::vector<bool> touches(points.size());
  for (const Contact& contact : contacts) touches[contact.point] = true;
  int inside = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    double gap_m = 1e9;  // object metres
    for (const test::Ball& b : kBalls) {
      const double gap = norm(cast<double>(instance.to_object(points[i])) - b.centre_m) - b.radius_m;
      gap_m = std::min(gap_m, gap);
    }
    if (std::abs(gap_m) < 0.01) continue;  // the map's error
    EXPECT_EQ(touches[i], gap_m < 0) << gap_m;
    inside += gap_m < 0;
  }
  EXPECT_GT(inside, 400);
}

TEST(Contacts, ThatDoNotFitAreCountedAndTheFirstAreKept) {
  const Instance instance = placed();
  const std::vector<Vec3f> points = cloud(instance, 1000, 0.8, 3);
  std::vector<Contact> all(points.size());
  const std::size_t total = all_contacts(instance, points, all).found;
  ASSERT_GT(total, 20U);
  for (const std::size_t room : {std::size_t{0}, std::size_t{1}, total - 1, total}) {
    std::vector<Contact> some(room);
    const ContactCount count = all_contacts(instance, points, some);
    EXPECT_EQ(count.found, total);
    EXPECT_EQ(count.written, room);
    EXPECT_EQ(count.fits(), room == total);
    for (std::size_t k = 0; k < room; ++k) expect_same(some[k], all[k]);
  }
}

TEST(Contacts, ALateOneIsFoundInEveryPlaceOfTheBatch) {
  const Instance instance = placed();
  const Vec3f inside = instance.to_world({-0.5F, 0.01F, 0});
  const Vec3f near = instance.to_world({-0.5F, 0, 0.812F});  // in a superquadric, outside the ball
  const Vec3f far{100, 0, 0};
  for (const Vec3f& filler : {near, far}) {
    for (const std::size_t at : {0U, 1U, 127U, 128U, 129U, 255U, 256U, 299U}) {
      std::vector<Vec3f> points(300, filler);
      EXPECT_FALSE(any_contact(instance, points));
      EXPECT_FALSE(first_contact(instance, points).has_value());
      EXPECT_FALSE(deepest_contact(instance, points).has_value());
      points[at] = inside;
      EXPECT_TRUE(any_contact(instance, points));
      const auto first = first_contact(instance, points), deepest = deepest_contact(instance, points);
      ASSERT_TRUE(first.has_value());
      ASSERT_TRUE(deepest.has_value());
      EXPECT_EQ(first->point, at);
      EXPECT_EQ(deepest->point, at);
    }
  }
}

TEST(Contacts, DeepestOfEqualsIsTheFirst) {
  const Instance instance = placed();
  const std::vector<Vec3f> points(200, instance.to_world({-0.5F, 0.3F, 0.2F}));
  const auto deepest = deepest_contact(instance, points);
  ASSERT_TRUE(deepest.has_value());
  EXPECT_EQ(deepest->point, 0U);
}

TEST(Contacts, PointsThatAreNotFiniteTouchNothing) {
  const Instance instance = placed();
  const float nan = std::numeric_limits<float>::quiet_NaN(),
              infinity = std::numeric_limits<float>::infinity();
  const std::vector<Vec3f> points{{nan, 0, 0}, {0, infinity, 0}, {-infinity, nan, 0}, {3e38F, -3e38F, 3e38F}};
  std::vector<Contact> contacts(points.size());
  EXPECT_FALSE(any_contact(instance, points));
  EXPECT_EQ(all_contacts(instance, points, contacts).found, 0U);
  EXPECT_FALSE(any_contact(instance, {}));
}

}  // namespace
}  // namespace sqmap::runtime
