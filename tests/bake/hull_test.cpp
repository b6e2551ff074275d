// SPDX-License-Identifier: GPL-3.0-or-later
#include "hull.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace sqmap::bake {
namespace {

std::vector<Vec3d> random_cloud(int count, std::mt19937_64& rng) {
  std::uniform_real_distribution<double> coordinate(-1, 1);
  std::vector<Vec3d> points;
  for (int i = 0; i < count; ++i) points.push_back({coordinate(rng), coordinate(rng), coordinate(rng)});
  return points;
}

std::vector<Vec3d> cube() {
  std::vector<Vec3d> corners;
  for (const double x : {0.0, 1.0})
    for (const double y : {0.0, 1.0})
      for (const double z : {0.0, 1.0}) corners.push_back({x, y, z});
  return corners;
}

TEST(ConvexHull, OfACubeWithPointsInsideAndOnItsFacesIsTheCube) {
  std::vector<Vec3d> points = cube();
  points.push_back({0.5, 0.5, 0.5});
  points.push_back({0.5, 0.5, 1});
  points.push_back({0.25, 0, 0});
  const Hull hull = convex_hull(points);
  EXPECT_EQ(hull.vertices.size(), 8U);
  EXPECT_EQ(hull.faces.size(), 12U);
  EXPECT_NEAR(hull.volume_m3, 1, 1e-15);
  EXPECT_NEAR(hull.area, 6, 1e-14);
}

TEST(ConvexHull, EveryPointLiesBehindEveryFace) {
  std::mt19937_64 rng(1);
  const std::vector<Vec3d> points = random_cloud(300, rng);
  const Hull hull = convex_hull(points);
  ASSERT_GT(hull.faces.size(), 20U);
  for (const auto& face : hull.faces) {
    const Vec3d a = hull.vertices[face[0]], b = hull.vertices[face[1]], c = hull.vertices[face[2]];
    const Vec3d outward = normalized(cross(b - a, c - a));
    for (const Vec3d& p : points) ASSERT_LE(dot(p - a, outward), 1e-12);
  }
}

TEST(ConvexHull, VerticesArePointsOfTheInputBitForBit) {
  std::mt19937_64 rng(2);
  const std::vector<Vec3d> points = random_cloud(200, rng);
  for (const Vec3d& v : convex_hull(points).vertices)
    EXPECT_NE(std::find(points.begin(), points.end(), v), points.end());
}

TEST(ConvexHull, DoesNotDependOnTheOrderOfThePoints) {
  std::mt19937_64 rng(3);
  std::vector<Vec3d> points = random_cloud(200, rng);
  const Hull before = convex_hull(points);
  std::shuffle(points.begin(), points.end(), rng);
  const Hull after = convex_hull(points);
  EXPECT_EQ(before.vertices, after.vertices);
  EXPECT_EQ(before.faces, after.faces);
}

TEST(ConvexHull, VolumeSurvivesAFarTranslation) {
  std::vector<Vec3d> corners = cube();
  for (Vec3d& p : corners) p = p + Vec3d{1048576, -1048576, 1048576};  // exact in double
  EXPECT_NEAR(convex_hull(corners).volume_m3, 1, 1e-12);
}

TEST(ConvexHull, OfPointsWithoutVolumeKeepsTheirExtremePoints) {
  EXPECT_TRUE(convex_hull({}).vertices.empty());

  const std::vector<Vec3d> equal(5, Vec3d{1, 2, 3});
  EXPECT_EQ(convex_hull(equal).vertices, std::vector<Vec3d>({{1, 2, 3}}));

  const std::vector<Vec3d> line{{1, 1, 1}, {3, 3, 3}, {0, 0, 0}, {2, 2, 2}};
  EXPECT_EQ(convex_hull(line).vertices, std::vector<Vec3d>({{0, 0, 0}, {3, 3, 3}}));

  // A square with its middle, in planes that face each axis and in an oblique one.
  const Vec3d origin{2, 3, 5};
  const std::vector<std::pair<Vec3d, Vec3d>> planes{
      {{1, 0, 0}, {0, 1, 0}}, {{0, 1, 0}, {0, 0, 1}}, {{0, 0, 1}, {1, 0, 0}}, {{1, 1, 0}, {0, 1, 2}}};
  for (const auto& [u, v] : planes) {
    const std::vector<Vec3d> square{origin, origin + u, origin + v, origin + u + v,
                                    origin + 0.5 * u + 0.5 * v};
    const Hull hull = convex_hull(square);
    EXPECT_EQ(hull.vertices.size(), 4U);
    EXPECT_TRUE(hull.faces.empty());
    EXPECT_EQ(hull.volume_m3, 0);
    EXPECT_NEAR(hull.area, 2 * norm(cross(u, v)), 1e-12);
  }
}

TEST(ConvexHull, OfANearlyFlatSetHasItsTinyVolume) {
  std::vector<Vec3d> corners = cube();
  for (Vec3d& p : corners) p.z *= 1e-13;
  EXPECT_NEAR(convex_hull(corners).volume_m3, 1e-13, 1e-20);
}

}  // namespace
}  // namespace sqmap::bake
