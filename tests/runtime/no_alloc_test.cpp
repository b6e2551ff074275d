// SPDX-License-Identifier: Apache-2.0
// What a frame calls, under an operator new that ends the program, with every kind of number a float can
// hold.
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "sqmap/runtime/body.hpp"
#include "sqmap/runtime/budget.hpp"
#include "sqmap/runtime/contacts.hpp"
#include "sqmap/runtime/instance.hpp"
#include "sqmap/runtime/sweep.hpp"

#include "runtime/no_allocation.hpp"
#include "support/analytic_asset.hpp"

namespace sqmap::runtime {
namespace {

const float kInfinity = std::numeric_limits<float>::infinity();
const float kNan = std::numeric_limits<float>::quiet_NaN();
const float kDenormal = std::numeric_limits<float>::denorm_min();
const float kLargest = std::numeric_limits<float>::max();

struct Scene {
  Asset asset = test::two_balls({{{-0.5, 0, 0}, 0.8}, {{0.5, 0.1, 0}, 0.7}}, 33, 64);
  Object object = std::move(Object::build(asset)).value();
  Sweeper sweeper = std::move(Sweeper::build(asset)).value();

  Instance at(const Vec3d& t_m, double scale = 1, bool mirrored = false) const {
    return Instance::place(object, Placement{{{0.9, 0.1, -0.2, 0.3}, t_m}, scale, mirrored}).value();
  }
};

bool is_finite(const Vec3f& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }
bool is_finite(const Contact& c) {
  return std::isfinite(c.depth_m) && is_finite(c.normal) && is_finite(c.position_m) && is_finite(c.surface_m);
}

/// Points in and around the instance.
std::vector<Vec3f> cloud(const Instance& instance, int count) {
  std::mt19937_64 rng(1);
  std::uniform_real_distribution<double> side(-1.2, 1.2);
  const BoundingSphere sphere = instance.sphere();
  std::vector<Vec3f> points;
  for (int i = 0; i < count; ++i)
    points.push_back(cast<float>(sphere.centre_m + sphere.radius_m * Vec3d{side(rng), side(rng), side(rng)}));
  return points;
}

/// All triples of extreme coordinates.
std::vector<Vec3f> extremes() {
  const std::array<float, 13> values{0,  -0.0F, kDenormal, -kDenormal, 1e-38F,   1e-20F,   0.5F,
                                     -1, 1e6F,  -1e18F,    1e30F,      kLargest, -kLargest};
  std::vector<Vec3f> points;
  for (const float x : values)
    for (const float y : values)
      for (const float z : values) points.push_back({x, y, z});
  return points;
}

TEST(NoAllocation, InQueriesContactsAndSweeps) {
  const Scene scene;
  const Instance start = scene.at({3, 1, 2}, 0.7, true), end = scene.at({3.2, 1, 2}, 0.7, true);
  const std::vector<Vec3f> points = cloud(start, 1000);
  std::vector<PointMotion> motions;
  for (std::size_t i = 1; i < points.size(); ++i) motions.push_back({points[i - 1], points[i]});
  std::vector<float> distance(points.size());
  std::vector<Vec3f> normal(points.size()), surface(points.size());
  std::vector<std::uint32_t> part(points.size());
  std::vector<std::uint8_t> layer(points.size()), inside(points.size());
  std::vector<Contact> contacts(points.size());
  std::vector<SweepResult> results(motions.size());
  std::vector<Certainty> certainty(points.size());
  std::size_t found = 0, swept = 0;
  {
    const test::NoAllocation guard;
    for (const Layer which : {Layer::kAuto, Layer::kOne, Layer::kTwo, Layer::kThree}) {
      const QueryOptions options{which};
      const Instance copy = start;
      copy.query(points, {distance, normal, surface, part, layer, inside}, options);
      for (const Vec3f& p : points) found += copy.query(p, options).inside;
      copy.certainty(points, certainty);
      found += any_contact(copy, points, options);
      found += first_contact(copy, points, options)->point;
      found += deepest_contact(copy, points, options)->point;
      found += all_contacts(copy, points, contacts, options).found;
      scene.sweeper.sweep(start, end, motions, results, {.query = options});
      for (const SweepResult& result : results) swept += result.status == SweepStatus::kContact;
    }
  }
  EXPECT_GT(found, 100U);
  EXPECT_GT(swept, 100U);
}

TEST(NoAllocation, InQuestionsAboutBodies) {
  const Scene scene;
  const std::vector<Vec3f> points = cloud(scene.at({}), 1000);
  std::vector<Vec3f> moved(points), broken(points);
  for (Vec3f& p : moved) p.x += 0.01F;
  broken[500].y = kNan;
  PointBody body = std::move(PointBody::build(points)).value();
  const BodyPlacement placement{{{0.9, 0.1, -0.2, 0.3}, {0.1, 0, 0}}, 0.9};
  const Placement in_world{{{0.9, 0.1, -0.2, 0.3}, {0.1, 0, 0}}, 0.9};
  const Instance upright = scene.at({0.2, 0, 0}), mirrored = scene.at({0.2, 0, 0}, 1.1, true);
  std::vector<float> distance(points.size());
  std::vector<Vec3f> normal(points.size()), surface(points.size());
  std::vector<std::uint32_t> part(points.size());
  std::vector<std::uint8_t> layer(points.size()), inside(points.size());
  std::vector<Contact> contacts(points.size());
  std::size_t found = 0, refitted = 0;
  std::uint64_t spent = 0;
  {
    const test::NoAllocation guard;
    WorkRate rate;
    for (const Layer which : {Layer::kAuto, Layer::kOne, Layer::kTwo, Layer::kThree}) {
      refitted += body.refit(which == Layer::kTwo ? points : moved);
      refitted += body.refit(broken);
      scene.object.query(body, placement, {distance, normal, surface, part, layer, inside}, {which});
      for (const Seek seek : {Seek::kAll, Seek::kAny, Seek::kDeepest}) {
        const ContactQuery query{{which}, 0.01F, seek};
        found += scene.object.contacts(body, placement, contacts, query);
        WorkBudget budget{rate.units_for(100)};
        found += scene.object.contacts(body, placement, contacts, query, budget);
        for (const Instance& instance : {upright, mirrored}) {
          found += instance.contacts(body, in_world, contacts, query);
          found += instance.contacts(body, in_world, contacts, query, budget);
        }
        rate.learn(budget.spent, 100);
        spent += budget.spent;
      }
      for (const Instance& instance : {upright, mirrored})
        instance.query(body, in_world, {distance, normal, surface, part, layer, inside}, {which});
    }
  }
  EXPECT_EQ(refitted, 4U);
  EXPECT_GT(found, 100U);
  EXPECT_GT(spent, 1000U);
}

TEST(NoAllocation, TheGuardEndsAProgramThatAllocates) {
  EXPECT_DEATH(
      {
        const test::NoAllocation guard;
        std::vector<int> memory(10);
        std::fprintf(stderr, "%p", static_cast<void*>(memory.data()));
      },
      "an allocation where none is allowed");
}

TEST(ExtremeInput, GivesFiniteAnswersOrTheFlaggedDefault) {
  const Scene scene;
  const std::vector<Vec3f> points = extremes();
  for (const double scale : {1e-9, 1e-3, 1.0, 1e6}) {
    for (const Vec3d& t : {Vec3d{}, Vec3d{1e6, -1e6, 1e6}, Vec3d{1e17, 0, 0}, Vec3d{1e-40, 0, 0}}) {
      const Instance instance = scene.at(t, scale);
      for (const Vec3f& p : points) {
        const Answer answer = instance.query(p, {.layer = Layer::kThree, .edge_length_m = 0.01F});
        ASSERT_TRUE(is_finite(answer.normal) && is_finite(answer.surface_m));
        ASSERT_TRUE(std::isfinite(answer.signed_distance_m) || std::isnan(answer.signed_distance_m));
        if (answer.part == kNowhere) {
          ASSERT_TRUE(std::isnan(answer.signed_distance_m) && !answer.inside);
        }
      }
      const Vec3f middle = instance.to_world({-0.5F, 0, 0});
      EXPECT_TRUE(instance.query(middle).inside || norm(t) > 1e5 * scale) << scale << ' ' << t.x;
    }
  }
}

TEST(ExtremeInput, GivesFiniteContactsAndSweeps) {
  const Scene scene;
  const std::vector<Vec3f> points = extremes();
  std::vector<Contact> contacts(points.size());
  for (const double scale : {1e-9, 1.0, 1e6}) {
    const Instance start = scene.at({0.1, 0, 0}, scale), end = scene.at({1e6, 0, 0}, scale);
    const std::size_t found = all_contacts(start, points, contacts).written;
    for (std::size_t k = 0; k < found; ++k) ASSERT_TRUE(is_finite(contacts[k]));
    for (std::size_t i = 0; i < points.size(); i += 7) {
      for (const std::size_t j : {i, (i + 500) % points.size(), points.size() - 1 - i}) {
        const SweepResult result =
            scene.sweeper.sweep(start, j % 2 == 0 ? start : end, {points[i], points[j]});
        ASSERT_TRUE(is_finite(result.contact));
        ASSERT_TRUE(result.time >= 0 && result.time <= 1);
        ASSERT_NE(result.status, SweepStatus::kInvalid);
        ASSERT_LE(result.steps, SweepOptions{}.max_steps);
      }
    }
  }
}

TEST(ExtremeInput, NanAndInfinityAreFlagged) {
  const Scene scene;
  const Instance instance = scene.at({0.1, 0, 0});
  std::vector<Contact> contacts(1);
  for (int axis = 0; axis < 3; ++axis) {
    for (const float bad : {kNan, kInfinity, -kInfinity}) {
      std::array<Vec3f, 1> p{};
      p[0][axis] = bad;
      const Answer answer = instance.query(p[0]);
      EXPECT_TRUE(std::isnan(answer.signed_distance_m));
      EXPECT_EQ(answer.part, kNowhere);
      EXPECT_EQ(answer.layer, Layer::kAuto);
      EXPECT_FALSE(answer.inside);
      EXPECT_EQ(all_contacts(instance, p, contacts).found, 0U);
      EXPECT_EQ(scene.sweeper.sweep(instance, {p[0], {}}).status, SweepStatus::kInvalid);
      EXPECT_EQ(scene.sweeper.sweep(instance, {{}, p[0]}).status, SweepStatus::kInvalid);
      SweepOptions options;
      options.tolerance_m = options.error_m = bad;
      const SweepResult result = scene.sweeper.sweep(instance, {{3, 0, 0}, {-3, 0, 0}}, options);
      EXPECT_TRUE(result.time >= 0 && result.time <= 1);
    }
  }
}

}  // namespace
}  // namespace sqmap::runtime
