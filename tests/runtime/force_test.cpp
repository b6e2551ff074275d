// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/force.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "support/analytic_asset.hpp"

namespace sqmap::runtime {
namespace {

Answer at(const Vec3d& p_m) {
  static const Asset asset = test::ball_in_ellipsoid(0.8, 65, 128);
  static const Result<Object> object = Object::build(asset);
  return object.value().query(cast<float>(p_m), {Layer::kThree});
}

TEST(ReactionForce, PushesAPenetratingPointOutByHookesLaw) {
  const Vec3d centre{0.1, -0.05, 0.2}, n = normalized(Vec3d{1, 2, -1});
  const Vec3f force = reaction_force(at(centre + 0.75 * n), 200);
  EXPECT_NEAR(norm(force), 200 * 0.05, 0.2);
  EXPECT_GT(dot(normalized(cast<double>(force)), n), 0.999);
}

TEST(ReactionForce, IsZeroOutsideThoughThePointIsInsideTheSuperquadric) {
  // The paper's abs(S - D) would push here.
  const Answer answer = at(Vec3d{0.1, -0.05, 0.2} + 0.85 * normalized(Vec3d{1, 2, -1}));
  ASSERT_GT(answer.signed_distance_m, 0.04);
  EXPECT_EQ(reaction_force(answer, 200), Vec3f{});
  EXPECT_EQ(penetration_m(answer), 0);
}

TEST(ReactionForce, IsZeroWhereNothingIsKnown) {
  const Answer answer = at({5, 0, 0});
  ASSERT_TRUE(std::isnan(answer.signed_distance_m));
  EXPECT_EQ(reaction_force(answer, 200), Vec3f{});
}

}  // namespace
}  // namespace sqmap::runtime
