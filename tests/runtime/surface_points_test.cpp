// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/surface_points.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "sqmap/runtime/body.hpp"
#include "sqmap/runtime/contact.hpp"
#include "sqmap/runtime/instance.hpp"

#include "support/analytic_asset.hpp"

namespace sqmap::runtime {
namespace {

constexpr double kRadius_m = 0.8;
const Vec3d kCentre_m{0.1, -0.05, 0.2};  // of test::ball_in_ellipsoid
constexpr double kCodeError_m = 1e-3;    // of the depths of such a map

const Asset& ball() {
  static const Asset asset = test::ball_in_ellipsoid(kRadius_m, 65, 128);
  return asset;
}

TEST(SurfacePoints, LieOnTheBallOneACubeAndEverywhereOnIt) {
  constexpr double kSpacing_m = 0.1;
  const auto points = surface_points_m(ball(), kSpacing_m);
  ASSERT_TRUE(points.ok());
  std::set<std::tuple<int, int, int>> cubes;
  for (const Vec3f& p : points.value()) {
    EXPECT_NEAR(norm(cast<double>(p) - kCentre_m), kRadius_m, kCodeError_m);
    const auto cell = [](float x) {
      return static_cast<int>(std::floor(static_cast<double>(x) / kSpacing_m));
    };
    EXPECT_TRUE(cubes.insert({cell(p.x), cell(p.y), cell(p.z)}).second);
  }
  for (int i = 0; i < 500; ++i) {  // evenly spread directions
    const double z = 1 - (2 * i + 1) / 500.0, turn = 2.399963229728653 * i, r = std::sqrt(1 - z * z);
    const Vec3d place_m = kCentre_m + kRadius_m * Vec3d{r * std::cos(turn), r * std::sin(turn), z};
    double nearest_m = 1;
    for (const Vec3f& p : points.value()) nearest_m = std::min(nearest_m, norm(cast<double>(p) - place_m));
    EXPECT_LT(nearest_m, 2 * kSpacing_m);
  }
}

TEST(SurfacePoints, MakeABodyThatMeetsAnotherBundleAsDeepAsTheBallsOverlap) {
  const auto points = surface_points_m(ball(), 0.02);
  ASSERT_TRUE(points.ok());
  const PointBody body = std::move(PointBody::build(points.value())).value();
  const Object object = std::move(Object::build(ball())).value();
  const Instance instance = Instance::place(object, Placement{}).value();
  std::vector<Contact> deepest(1);
  for (const double overlap_m : {0.01, 0.1, 0.3}) {
    const Vec3d direction = normalized(Vec3d{1, 2, -1});
    const Placement other{{{}, (2 * kRadius_m - overlap_m) * direction}};
    ASSERT_EQ(instance.contacts(body, other, deepest, {{Layer::kThree}, 0, Seek::kDeepest}), 1U);
    // A sample lies within 0.04 m of the deepest place: 0.04^2 / 1.6 m above it.
    EXPECT_NEAR(deepest[0].depth_m, overlap_m, 3e-3);
    EXPECT_GT(dot(cast<double>(deepest[0].normal), direction), 0.99);
  }
  const Placement apart{{{}, {2 * kRadius_m + 0.01, 0, 0}}};
  EXPECT_EQ(instance.contacts(body, apart, deepest, {{Layer::kThree}}), 0U);
}

TEST(SurfacePoints, RefuseASpacingThatIsNone) {
  for (const double spacing_m : {0.0, -1.0, 1e9, std::numeric_limits<double>::quiet_NaN()}) {
    const auto points = surface_points_m(ball(), spacing_m);
    ASSERT_FALSE(points.ok());
    EXPECT_EQ(points.error().status, Status::kBadOption);
  }
}

}  // namespace
}  // namespace sqmap::runtime
