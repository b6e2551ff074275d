// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/instance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "sqmap/runtime/body.hpp"
#include "sqmap/runtime/budget.hpp"
#include "sqmap/runtime/contact.hpp"

#include "support/analytic_asset.hpp"

namespace sqmap::runtime {
namespace {

constexpr double kRadius = 0.8;
const Vec3d kCentre{0.1, -0.05, 0.2};  // of the ball in test::ball_in_ellipsoid
constexpr double kMapError_m = 1e-3;   // of a 65 x 128 map of that ball, layer 3 (object_test.cpp)

const Object& ball() {
  static const Object kObject = std::move(Object::build(test::ball_in_ellipsoid(kRadius, 65, 128))).value();
  return kObject;
}

Vec3d random_direction(std::mt19937_64& rng) {
  std::normal_distribution<double> normal;
  return normalized(Vec3d{normal(rng), normal(rng), normal(rng)});
}

Quaternion random_turn(std::mt19937_64& rng) {
  std::normal_distribution<double> normal;
  return {normal(rng), normal(rng), normal(rng), normal(rng)};
}

Instance placed(const Placement& placement) {
  auto instance = Instance::place(ball(), placement);
  EXPECT_TRUE(instance.ok()) << (instance ? "" : instance.error().finding);
  return instance.value();
}

TEST(Instance, AnswersLikeTheTurnedScaledMirroredBall) {
  std::mt19937_64 rng(1);
  std::uniform_real_distribution<double> log_scale(-6, 6), depth(-0.1, 0.1);
  int inside = 0, mirrored = 0;
  constexpr int kDraws = 2000;
  for (int i = 0; i < kDraws; ++i) {
    const Placement placement{
        {random_turn(rng), 10.0 * random_direction(rng)}, std::exp(log_scale(rng)), i % 2 == 1};
    const Instance instance = placed(placement);
    Vec3d centre = kCentre;
    if (placement.mirrored) centre.x = -centre.x;
    const Pose& pose = placement.world_from_object;
    const double s = placement.scale;
    const Vec3d centre_world = s * rotation(pose.orientation).apply(centre) + pose.translation_m;
    const Vec3d n = random_direction(rng);
    const double d = depth(rng);
    const Answer answer =
        instance.query(cast<float>(centre_world + s * (kRadius + d) * n), {Layer::kThree, 0});
    // The world's floats resolve 1e-6 m at 10 m.
    const double tolerance_m = s * kMapError_m + 3e-6;
    EXPECT_NEAR(answer.signed_distance_m, s * d, tolerance_m);
    EXPECT_LT(norm(cast<double>(answer.normal) - n), 0.07 + 1e-5 / s);
    EXPECT_NEAR(norm(answer.normal), 1, 1e-5);
    EXPECT_NEAR(norm(cast<double>(answer.surface_m) - centre_world), s * kRadius, tolerance_m);
    inside += answer.inside;
    mirrored += instance.mirrored();
  }
  EXPECT_GT(inside, kDraws * 3 / 10);
  EXPECT_LT(inside, kDraws * 7 / 10);
  EXPECT_EQ(mirrored, kDraws / 2);
}

TEST(Instance, MatrixAndPlacementMeanTheSame) {
  std::mt19937_64 rng(2);
  std::uniform_real_distribution<double> log_scale(-3, 3);
  for (int i = 0; i < 300; ++i) {
    // Half turns too, where a quaternion is hardest to find.
    const Quaternion turn =
        i % 3 == 0 ? Quaternion{0, double(i % 2), double(i / 2 % 2), 1} : random_turn(rng);
    const Placement placement{{turn, random_direction(rng)}, std::exp(log_scale(rng)), i % 2 == 0};
    Affine affine;
    affine.translation_m = placement.world_from_object.translation_m;
    const Rotation<double> r = rotation(turn);
    for (int k = 0; k < 3; ++k) {
      affine.linear[k] = placement.scale * r.row[k];
      if (placement.mirrored) affine.linear[k].x = -affine.linear[k].x;
    }
    const auto from_matrix = Instance::place(ball(), affine);
    ASSERT_TRUE(from_matrix.ok()) << from_matrix.error().finding;
    const Instance instance = placed(placement);
    EXPECT_EQ(from_matrix.value().mirrored(), placement.mirrored);
    const Vec3f p = cast<float>(random_direction(rng));
    EXPECT_LT(norm(from_matrix.value().to_object(p) - instance.to_object(p)),
              2e-6F * norm(instance.to_object(p)) + 1e-6F);
  }
}

TEST(Instance, RefusesWhatIsNoRigidMotionWithOneScaleAndSaysWhatItFound) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  const auto expect = [](const Result<Instance>& instance, const std::string& finding) {
    ASSERT_FALSE(instance.ok()) << finding;
    EXPECT_EQ(instance.error().status, Status::kBadOption);
    EXPECT_NE(instance.error().finding.find(finding), std::string::npos) << instance.error().finding;
    EXPECT_FALSE(instance.error().remedy.empty());
  };
  for (const double scale : {0.0, -1.0, nan, inf, 1e-12, 1e12})
    expect(Instance::place(ball(), Placement{{}, scale}), "scale is");
  for (const Quaternion& q : {Quaternion{0, 0, 0, 0}, Quaternion{nan, 0, 0, 1}, Quaternion{1, inf, 0, 0}})
    expect(Instance::place(ball(), Placement{{q, {}}}), "orientation is");
  for (const Vec3d& t : {Vec3d{nan, 0, 0}, Vec3d{0, inf, 0}, Vec3d{0, 0, 1e30}})
    expect(Instance::place(ball(), Placement{{{}, t}}), "from the world's origin");

  const auto linear = [](Vec3d x, Vec3d y, Vec3d z) { return Affine{{x, y, z}, {}}; };
  expect(Instance::place(ball(), linear({1, 0, 0}, {0, 1, 0}, {0, 0, 1.01})), "scaled by 1.0");
  expect(Instance::place(ball(), linear({1, 0.01, 0}, {0, 1, 0}, {0, 0, 1})), "shears");
  expect(Instance::place(ball(), linear({1, 0, 0}, {0, 1, 0}, {0, 0, 0})), "column of zeros");
  expect(Instance::place(ball(), linear({1, 0, 0}, {0, nan, 0}, {0, 0, 1})), "not finite");
}

TEST(Instance, AcceptsQuaternionsOfAnyLengthAndFloatMatrices) {
  for (const double length : {1e-200, 1e-3, 1e3, 1e200}) {
    const Instance instance = placed({{{length, length, 0, 0}, {}}});  // a quarter turn about x
    EXPECT_LT(norm(instance.to_object({0, 0, 1}) - Vec3f{0, 1, 0}), 1e-6F);
  }
  const float c = std::cos(0.3F), s = std::sin(0.3F);
  EXPECT_TRUE(Instance::place(ball(), Affine{{Vec3d{c, -s, 0}, {s, c, 0}, {0, 0, 1}}, {}}).ok());
}

TEST(Instance, FarFromTheOriginItLosesNoMoreThanItsPoints) {
  // A million sizes away floats are 0.0625 m apart: take only points that they hold exactly.
  const Vec3d far{1048576, -1048576, 1048576};
  const Instance away = placed({{{}, far}}), here = placed({});
  for (double x = -1.5; x <= 1.5; x += 0.125) {
    const Vec3d p{x, 0.0625, -0.125};
    const Answer a = away.query(cast<float>(p + far)), b = here.query(cast<float>(p));
    EXPECT_TRUE(a.signed_distance_m == b.signed_distance_m ||
                (std::isnan(a.signed_distance_m) && std::isnan(b.signed_distance_m)));
    EXPECT_EQ(a.normal, b.normal);
    EXPECT_EQ(a.inside, b.inside);
  }
}

TEST(Instance, SphereHoldsEveryPointThatTheObjectAnswersFor) {
  std::mt19937_64 rng(3);
  int answered = 0;
  for (int i = 0; i < 2000; ++i) {
    const Instance instance = placed({{random_turn(rng), random_direction(rng)}, 2.5, i % 2 == 0});
    const BoundingSphere sphere = instance.sphere();
    const Vec3f p = cast<float>(sphere.centre_m + 0.6 * sphere.radius_m * random_direction(rng));
    answered += instance.query(p).part != kNowhere;
    const Vec3f beyond = cast<float>(sphere.centre_m + 1.0001 * sphere.radius_m * random_direction(rng));
    EXPECT_EQ(instance.query(beyond).part, kNowhere);
  }
  EXPECT_GT(answered, 1000);
}

TEST(Instance, EdgeLengthIsInWorldMetres) {
  const Vec3f p_object = cast<float>(kCentre + 0.85 * Vec3d{1, 0, 0});
  const float plain_m =
      ball().query(p_object, {.layer = Layer::kThree, .edge_length_m = 0.4F}).signed_distance_m;
  const float scaled_m = placed({{}, 8})
                             .query(8.0F * p_object, {.layer = Layer::kThree, .edge_length_m = 3.2F})
                             .signed_distance_m;
  EXPECT_NEAR(scaled_m, 8 * plain_m, 1e-5);
  EXPECT_LT(plain_m, 0.03F) << "the offset has no effect here, and this test none either";
}

TEST(Instance, BatchEqualsSinglePointsWhateverIsAskedFor) {
  std::mt19937_64 rng(4);
  const Instance instance = placed({{random_turn(rng), {3, 2, 1}}, 0.3, true});
  std::vector<Vec3f> points;
  for (int i = 0; i < 700; ++i)  // more than one chunk
    points.push_back(cast<float>(instance.sphere().centre_m + 0.35 * random_direction(rng)));
  points.push_back({std::numeric_limits<float>::quiet_NaN(), 0, 0});
  points.push_back({1e30F, 0, 0});
  const std::size_t n = points.size();
  std::vector<float> distance(n);
  std::vector<Vec3f> normal(n), surface(n), surface_alone(n);
  std::vector<std::uint32_t> part(n);
  std::vector<std::uint8_t> layer(n), inside(n);
  instance.query(points, {distance, normal, surface, part, layer, inside});
  instance.query(points, {.surface_m = surface_alone});
  int known = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const Answer one = instance.query(points[i]);
    EXPECT_TRUE(distance[i] == one.signed_distance_m ||
                (std::isnan(distance[i]) && std::isnan(one.signed_distance_m)));
    EXPECT_EQ(normal[i], one.normal);
    EXPECT_EQ(surface[i], one.surface_m);
    EXPECT_EQ(surface_alone[i], one.surface_m);
    EXPECT_EQ(part[i], one.part);
    EXPECT_EQ(layer[i], static_cast<std::uint8_t>(one.layer));
    EXPECT_EQ(inside[i] != 0, one.inside);
    known += !std::isnan(one.signed_distance_m);
  }
  EXPECT_GT(known, 400);
}

TEST(Instance, ThousandsShareOneObject) {
  std::vector<Instance> crowd;
  for (int i = 0; i < 5000; ++i) crowd.push_back(placed({{{}, {4.0 * i, 0, 0}}}));
  EXPECT_LE(sizeof(Instance), kInstanceBytes);
  for (const int i : {0, 17, 4999}) {
    EXPECT_EQ(&crowd[static_cast<std::size_t>(i)].object(), &ball());
    EXPECT_TRUE(crowd[static_cast<std::size_t>(i)].query({4.0F * static_cast<float>(i), 0, 0}).inside);
  }
}

/// A hand-like cloud about the origin: every contact of it is known from its points one by one.
std::vector<Vec3f> cloud(std::size_t count) {
  std::mt19937_64 rng(7);
  std::uniform_real_distribution<double> radius(0.1, 0.5);
  std::vector<Vec3f> points;
  while (points.size() < count) points.push_back(cast<float>(radius(rng) * random_direction(rng)));
  return points;
}

/// Placements of an instance and of a body near its surface, mirrored or not in all four ways.
struct Meeting {
  Placement object, body;
};
std::vector<Meeting> meetings() {
  std::mt19937_64 rng(11);
  std::uniform_real_distribution<double> log_scale(-2, 2);
  std::vector<Meeting> result;
  for (int i = 0; i < 40; ++i) {
    const double s = std::exp(log_scale(rng));
    const Placement object{{random_turn(rng), 3.0 * random_direction(rng)}, s, i % 2 == 1};
    Vec3d centre = kCentre;
    if (object.mirrored) centre.x = -centre.x;
    const Pose& pose = object.world_from_object;
    const Vec3d surface_m =
        pose.translation_m + s * (rotation(pose.orientation).apply(centre) + kRadius * random_direction(rng));
    result.push_back({object, {{random_turn(rng), surface_m}, 0.7 * s, i % 4 >= 2}});
  }
  return result;
}

Vec3f in_world(const Placement& placement, Vec3f p) {
  if (placement.mirrored) p.x = -p.x;
  return cast<float>(placement.scale *
                         rotation(placement.world_from_object.orientation).apply(cast<double>(p)) +
                     placement.world_from_object.translation_m);
}

TEST(Instance, AnswersABodyLikeItsPointsOneByOne) {
  const std::vector<Vec3f> points = cloud(500);
  const PointBody body = std::move(PointBody::build(points)).value();
  std::vector<float> distance(points.size());
  std::vector<Vec3f> normal(points.size()), surface(points.size());
  std::vector<std::uint8_t> inside(points.size());
  int known = 0, unknown = 0;
  for (const Meeting& meeting : meetings()) {
    const Instance instance = placed(meeting.object);
    const auto s = static_cast<float>(meeting.object.scale);
    instance.query(body, meeting.body,
                   {.signed_distance_m = distance, .normal = normal, .surface_m = surface, .inside = inside},
                   {Layer::kThree});
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Answer one = instance.query(in_world(meeting.body, points[i]), {Layer::kThree});
      if (std::isnan(one.signed_distance_m) || std::isnan(distance[i])) {
        unknown += std::isnan(distance[i]) ? 1 : 0;
        continue;
      }
      ++known;
      EXPECT_NEAR(distance[i], one.signed_distance_m, 1e-4F * s);
      EXPECT_GT(dot(normal[i], one.normal), 0.99F);
      EXPECT_LT(norm(surface[i] - one.surface_m), 3e-3F * s);
      if (std::abs(distance[i]) > 1e-3F * s) {
        EXPECT_EQ(inside[i] != 0, one.inside);
      }
    }
  }
  EXPECT_GT(known, 5000);
  EXPECT_GT(unknown, 100);
}

TEST(Instance, FindsTheContactsOfABodyHoweverEitherIsTurnedScaledAndMirrored) {
  const std::vector<Vec3f> points = cloud(500);
  const PointBody body = std::move(PointBody::build(points)).value();
  std::vector<Contact> contacts(points.size()), one(1);
  std::size_t all = 0;
  for (const Meeting& meeting : meetings()) {
    const Instance instance = placed(meeting.object);
    const auto s = static_cast<float>(meeting.object.scale);
    std::size_t surely = 0, perhaps = 0;
    float deepest_m = 0;
    for (const Vec3f& p : points) {
      const float depth_m = -instance.query(in_world(meeting.body, p), {Layer::kThree}).signed_distance_m;
      surely += depth_m > 1e-4F * s ? 1 : 0;
      perhaps += depth_m > -1e-4F * s ? 1 : 0;
      deepest_m = std::max(deepest_m, depth_m);  // NaN: as it was
    }
    const std::size_t found = instance.contacts(body, meeting.body, contacts, {{Layer::kThree}});
    EXPECT_GE(found, surely);
    EXPECT_LE(found, perhaps);
    for (std::size_t k = 0; k < found; ++k) {
      const Contact& contact = contacts[k];
      EXPECT_LT(norm(contact.position_m - in_world(meeting.body, points[contact.point])), 1e-5F * s + 1e-5F);
      EXPECT_NEAR(norm(contact.surface_m - contact.position_m), contact.depth_m, 1e-3F * s);
    }
    EXPECT_EQ(instance.contacts(body, meeting.body, one, {{Layer::kThree}, 0, Seek::kDeepest}),
              found > 0 ? 1U : 0U);
    if (found > 0) {
      EXPECT_NEAR(one[0].depth_m, deepest_m, 1e-4F * s);
    }
    EXPECT_EQ(instance.contacts(body, meeting.body, one, {{Layer::kThree}, 0, Seek::kAny}),
              found > 0 ? 1U : 0U);
    WorkBudget ample{1000000}, scarce{0};
    EXPECT_EQ(instance.contacts(body, meeting.body, contacts, {{Layer::kThree}}, ample), found);
    EXPECT_EQ(ample.layer, Layer::kThree);
    instance.contacts(body, meeting.body, contacts, {{Layer::kThree}}, scarce);
    EXPECT_EQ(scarce.layer, Layer::kOne);
    EXPECT_LT(scarce.spent, ample.spent);
    all += found;
  }
  EXPECT_GT(all, 2000U);
  Placement nowhere;
  nowhere.world_from_object.translation_m.x = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(placed({}).contacts(body, nowhere, contacts, {}), 0U);
}

}  // namespace
}  // namespace sqmap::runtime
