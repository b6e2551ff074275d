// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "sqmap/runtime/instance.hpp"
#include "sqmap/runtime/object.hpp"

#include "support/analytic_asset.hpp"

namespace sqmap::runtime {
namespace {

/// A ball of radius 1 with bounds that are cubes: outside beyond `outer` from the middle, inside within
/// `inner`.
Part cube_bounds(const Vec3d& centre_m, double outer, double inner, std::uint32_t cells) {
  Part part = test::traced_part({{1, 1, 1}, 1, 1}, centre_m, 3, 4, 1, 1,
                                [](const Vec3d&, const Vec3d&, bool&) { return std::vector<double>{}; });
  part.bounds.cells = cells;
  part.bounds.tolerance_m = 1e-6;
  const auto code = [](double height) { return static_cast<std::uint8_t>(std::lround(240 * height)); };
  part.bounds.cell.assign(std::size_t{6} * cells * cells, {128, 128, code(outer), code(inner), 0, 2});
  return part;
}

Object built(const Asset& asset) { return std::move(Object::build(asset)).value(); }

double largest(const Vec3f& p) {
  return std::max({std::abs(double{p.x}), std::abs(double{p.y}), std::abs(double{p.z})});
}

TEST(Certainty, FollowsTheHeightsOfEachCell) {
  const Object object = built(test::asset_of({cube_bounds({}, 0.6, 0.5, 5)}, 2));
  EXPECT_EQ(object.certainty_tolerance_m(), 1e-6);
  std::mt19937_64 random(1);
  std::uniform_real_distribution<float> unit(-1.2F, 1.2F);
  int unsure = 0, inside = 0, outside = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3f p{unit(random), unit(random), unit(random)};
    const Certainty told = object.certainty(p);
    unsure += told == Certainty::kUnsure;
    inside += told == Certainty::kInside;
    outside += told == Certainty::kOutside;
    if (norm(p) > 1.01F || largest(p) > 0.6001) {
      ASSERT_EQ(told, Certainty::kOutside);
    } else if (largest(p) < 0.4999) {
      ASSERT_EQ(told, Certainty::kInside);
    } else if (largest(p) > 0.5001 && largest(p) < 0.5999) {
      ASSERT_EQ(told, Certainty::kUnsure);
    }
  }
  EXPECT_GT(unsure, 200);
  EXPECT_GT(inside, 500);
  EXPECT_GT(outside, 5000);
}

// Bytes by hand from FORMAT.md 3.1: cell (row 1, col 0) of face +x with m = 2, where u' = 2 u + 1, v' = 2 v
// - 1.
TEST(Certainty, TiltsItsPlanesAsTheFormatSays) {
  Part part = cube_bounds({}, 1, 0, 2);
  part.bounds.cell.assign(24, BoundCell{});
  part.bounds.cell[2] = {192, 96, 120, 90, 60, 1};  // tilts 1/4 and -1/8; inside beyond, outside between
  const Object object = built(test::asset_of({part}, 2));
  const auto told = [&](float h, float u, float v) {
    return object.certainty({h / 240, h / 240 * u, h / 240 * v});
  };
  // u = -1/2, v = 1/2 is the middle: H = h.
  EXPECT_EQ(told(121, -0.5F, 0.5F), Certainty::kInside);
  EXPECT_EQ(told(119, -0.5F, 0.5F), Certainty::kUnsure);
  EXPECT_EQ(told(89, -0.5F, 0.5F), Certainty::kOutside);
  EXPECT_EQ(told(61, -0.5F, 0.5F), Certainty::kOutside);
  EXPECT_EQ(told(59, -0.5F, 0.5F), Certainty::kUnsure);
  // u = -1/8, v = 3/4: u' = 3/4, v' = 1/2, H = h (1 + 3/16 - 1/16) = 9/8 h.
  EXPECT_EQ(told(107, -0.125F, 0.75F), Certainty::kInside);
  EXPECT_EQ(told(106, -0.125F, 0.75F), Certainty::kUnsure);
  EXPECT_EQ(told(79, -0.125F, 0.75F), Certainty::kOutside);
  EXPECT_EQ(told(53, -0.125F, 0.75F), Certainty::kUnsure);
  // Another cell, another face.
  EXPECT_EQ(told(121, 0.5F, 0.5F), Certainty::kUnsure);
  EXPECT_EQ(object.certainty({-0.5F, 0.25F, 0.25F}), Certainty::kUnsure);
}

TEST(Certainty, IsToldByAnyPartThatIsSure) {
  const Object both =
      built(test::asset_of({cube_bounds({}, 1, 0.05, 2), cube_bounds({0.6, 0, 0}, 0.9, 0.3, 2)}, 3));
  EXPECT_EQ(both.certainty({0.5F, 0, 0}), Certainty::kInside) << "the second is sure";
  EXPECT_EQ(both.certainty({0.01F, 0, 0}), Certainty::kInside) << "the first is sure";
  EXPECT_EQ(both.certainty({-0.5F, 0, 0}), Certainty::kUnsure);
  EXPECT_EQ(both.certainty({-1.5F, 0, 0}), Certainty::kOutside);
}

TEST(Certainty, WithoutBoundsNothingWithinIsSure) {
  Part bare = cube_bounds({0.6, 0, 0}, 0.9, 0.3, 2);
  bare.bounds = {};
  const Object object = built(test::asset_of({cube_bounds({}, 1, 0.05, 2), bare}, 3));
  EXPECT_TRUE(std::isnan(object.certainty_tolerance_m()));
  EXPECT_EQ(object.certainty({0.8F, 0, 0}), Certainty::kUnsure);
  EXPECT_EQ(object.certainty({1.8F, 0, 0}), Certainty::kOutside);
  EXPECT_EQ(object.certainty({0.01F, 0, 0}), Certainty::kInside);
}

TEST(Certainty, WhatIsNoPointIsUnsure) {
  const Object object = built(test::asset_of({cube_bounds({}, 0.6, 0.5, 3)}, 2));
  const float nan = std::numeric_limits<float>::quiet_NaN(),
              infinity = std::numeric_limits<float>::infinity();
  EXPECT_EQ(object.certainty({nan, 0, 0}), Certainty::kUnsure);
  EXPECT_EQ(object.certainty({0, infinity, 0}), Certainty::kUnsure);
  EXPECT_EQ(object.certainty({3e38F, 3e38F, 0}), Certainty::kOutside);
  EXPECT_EQ(object.certainty({0, 0, 0}), Certainty::kInside) << "where all cells meet";
  EXPECT_EQ(object.certainty({1e-45F, 0, -1e-45F}), Certainty::kInside);
}

TEST(Certainty, OfAnInstanceIsThatOfItsObject) {
  const Object object = built(test::asset_of({cube_bounds({0.1, 0, 0}, 0.6, 0.5, 4)}, 2));
  const Instance instance =
      Instance::place(object, Placement{{{0.9, 0.1, -0.2, 0.3}, {3, 1, 2}}, 0.5, true}).value();
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<Vec3f> points;
  for (int i = 0; i < 600; ++i)
    points.push_back(
        cast<float>(instance.sphere().centre_m + 0.5 * Vec3d{unit(random), unit(random), unit(random)}));
  std::vector<Certainty> told(points.size());
  instance.certainty(points, told);
  std::size_t kinds[3] = {};
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_EQ(told[i], object.certainty(instance.to_object(points[i])));
    ++kinds[static_cast<int>(told[i])];
  }
  for (const std::size_t count : kinds) EXPECT_GT(count, 20U);
}

}  // namespace
}  // namespace sqmap::runtime
