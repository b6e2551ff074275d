// SPDX-License-Identifier: Apache-2.0
//
// Corollaries 1 and 2 of the paper's section 5: where the error of the represented surface goes when the maps
// get denser. It is measured at points of the true surface, whose distance is zero.
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "sqmap/runtime/object.hpp"

#include "support/analytic_asset.hpp"

namespace sqmap::runtime {
namespace {

using test::Ball;

/// Points of the surface of a union of balls, even over each ball.
std::vector<Vec3d> surface_points(const std::vector<Ball>& balls) {
  std::mt19937_64 rng(5);
  std::normal_distribution<double> normal;
  std::vector<Vec3d> points;
  for (const Ball& ball : balls) {
    for (int i = 0; i < 4000; ++i) {
      const Vec3d p =
          ball.centre_m + ball.radius_m * normalized(Vec3d{normal(rng), normal(rng), normal(rng)});
      bool is_covered = false;
      for (const Ball& other : balls)
        is_covered = is_covered || norm(p - other.centre_m) < other.radius_m - 1e-9;
      if (!is_covered) points.push_back(p);
    }
  }
  return points;
}

struct Chart {
  Superquadric shape;
  Vec3d centre_m;
};

/// Mean distance that layer 3 sees at points of the surface [m], for maps of rows x 2 (rows - 1) texels.
double error_m(const std::vector<Ball>& balls, const std::vector<Chart>& charts, std::uint32_t rows,
               bool keeps_further_crossings) {
  std::vector<Part> parts;
  for (const Chart& chart : charts) {
    Part part = test::traced_part(chart.shape, chart.centre_m, rows, 2 * (rows - 1), 1, 2,
                                  [&](const Vec3d& origin_m, const Vec3d& direction, bool& inside) {
                                    return test::union_crossings_m(balls, origin_m, direction, inside);
                                  });
    if (!keeps_further_crossings) part.map.crossings.clear();
    parts.push_back(std::move(part));
  }
  const auto object = Object::build(test::asset_of(std::move(parts), 2));
  EXPECT_TRUE(object.ok()) << (object.ok() ? "" : object.error().finding);
  if (!object.ok()) return 0;
  double sum_m = 0;
  const std::vector<Vec3d> points_m = surface_points(balls);
  for (const Vec3d& p_m : points_m) {
    const double d_m = object.value().query(cast<float>(p_m), {Layer::kThree}).signed_distance_m;
    EXPECT_FALSE(std::isnan(d_m)) << p_m.x << ' ' << p_m.y << ' ' << p_m.z;
    sum_m += std::abs(d_m);
  }
  return sum_m / static_cast<double>(points_m.size());
}

/// Each halving of the texel divides the error by more than `factor`, down to less than `last_m`.
void expect_falling(const std::vector<Ball>& balls, const Chart& chart, double factor, double last_m) {
  double before_m = error_m(balls, {chart}, 17, true);
  for (const std::uint32_t rows : {33U, 65U, 129U}) {
    const double after_m = error_m(balls, {chart}, rows, true);
    EXPECT_LT(after_m, before_m / factor) << rows << " rows";
    before_m = after_m;
  }
  EXPECT_LT(before_m, last_m);
}

TEST(Corollaries, ErrorOfAConvexShapeFallsWithTheSquareOfTheTexel) {
  expect_falling({{{0.1, -0.05, 0.15}, 0.7}}, {{{1, 1.1, 1.2}, 1, 1}, {}}, 3.5, 1e-4);
}

TEST(Corollaries, ErrorOfAQ1ConcavityFallsAtLeastWithTheTexel) {
  // The crease of two balls is seen from everywhere; cells that straddle it are only first order.
  expect_falling({{{0, 0, 0.35}, 0.5}, {{0, 0, -0.35}, 0.5}}, {{{0.7, 0.7, 1.0}, 1, 1}, {}}, 2, 3e-4);
}

TEST(Corollaries, ErrorOfAQ2ConcavityHasAFloorThatFurtherCrossingsOrASplitRemove) {
  // The upper ball hides its own underside and a cap of the lower one, which holds the centre of the
  // superquadric.
  const std::vector<Ball> balls{{{0, 0, -0.3}, 0.5}, {{0, 0, 0.6}, 0.38}};
  const std::vector<Chart> whole{{{{1, 1, 1}, 1, 1}, {}}};
  const std::vector<Chart> split{{{{0.51, 0.51, 0.51}, 1, 1}, balls[0].centre_m},
                                 {{{0.39, 0.39, 0.39}, 1, 1}, balls[1].centre_m}};
  EXPECT_LT(error_m(balls, split, 65, false), 1e-4);
  const double floor_m = error_m(balls, whole, 65, false);
  EXPECT_GT(floor_m, 4e-3);
  EXPECT_GT(error_m(balls, whole, 257, false), 0.9 * floor_m) << "sixteen times the texels change nothing";
  double before_m = error_m(balls, whole, 65, true);
  for (const std::uint32_t rows : {129U, 257U}) {
    const double after_m = error_m(balls, whole, rows, true);
    EXPECT_LT(after_m, before_m / 1.8) << rows << " rows";
    before_m = after_m;
  }
  EXPECT_LT(before_m, floor_m / 5);
}

}  // namespace
}  // namespace sqmap::runtime
