// SPDX-License-Identifier: Apache-2.0
// Needles, plates and blades of axis ratios 10, 100 and 1000 in all permutations, on every instruction set,
// against searches.
#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "sqmap/runtime/object.hpp"

#include "hard/shells.hpp"
#include "hard/surface_search.hpp"

namespace sqmap::runtime {
namespace {

/// All orders of (1, 1/r, 1/r), a needle, (1, 1, 1/r), a plate, and (1, 1/sqrt(r), 1/r), a blade.
std::vector<Vec3d> slim_axes(double ratio) {
  std::vector<Vec3d> all;
  for (const double middle : {1 / ratio, 1.0, 1 / std::sqrt(ratio)}) {
    std::vector<double> axes{1 / ratio, middle, 1};
    std::sort(axes.begin(), axes.end());
    do {
      all.push_back({axes[0], axes[1], axes[2]});
    } while (std::next_permutation(axes.begin(), axes.end()));
  }
  return all;
}

// Known weakness, which the limits below state by ratio: the foot search starts from 8 x 8 places of an
// octant and takes three steps, so that on slim shapes it often ends beside the nearest one. Distances then
// err by shares of the thinnest axis, though hardly by any of the longest.
struct Errors {
  int count = 0, over_a_tenth = 0;  ///< of the thinnest axis
  double worst = 0;                 ///< of the longest
  int wrong_side = 0;
  void add(double error_m, double thinnest_m) {
    ++count;
    over_a_tenth += !(error_m <= 0.1 * thinnest_m);  // NaN: over
    worst = std::max(worst, error_m);
  }
};

void record(const std::string& name, const Errors& errors) {
  testing::Test::RecordProperty(
      name, std::to_string(errors.over_a_tenth) + " of " + std::to_string(errors.count) + " over, worst " +
                std::to_string(errors.worst) + ", wrong side " + std::to_string(errors.wrong_side));
}

struct Limits {
  double ratio;
  double second_over, third_over;  ///< shells: share of errors over a tenth of the thinnest axis
  double worst;                    ///< of the longest axis
  double ellipsoid_over, ellipsoid_worst;
  double wrong_side;  ///< of ellipsoids
};
class AxisRatios : public testing::TestWithParam<Limits> {};

// Points deeper than the shell are exactly their distance to the superquadric, less the shell's depth, deep:
// no point of the represented surface is farther from the superquadric than that.
TEST_P(AxisRatios, DepthsBelowShellsAreThoseOfASearchInLayersTwoAndThree) {
  const Limits& limits = GetParam();
  std::mt19937_64 rng(71);
  std::uniform_real_distribution<double> unit(-1, 1);
  Errors second, third;
  for (const Vec3d& axes : slim_axes(limits.ratio))
    for (const auto& [e1, e2] : {std::pair{1.0, 1.0}, {0.3, 1.0}, {1.0, 0.3}, {1.7, 0.6}}) {
      const Superquadric shape{axes, e1, e2};
      const double thin_m = std::min({axes.x, axes.y, axes.z}), depth_m = 0.2 * thin_m;
      const auto object = Object::build(test::shell_asset(shape, depth_m, 33, 64));
      ASSERT_TRUE(object.ok());
      const reference::SurfaceSearch search(shape);
      std::vector<Vec3f> points;
      for (int i = 0; i < 8; ++i) {
        Vec3d d{axes.x * unit(rng), axes.y * unit(rng), axes.z * unit(rng)};
        if (i == 6) d[static_cast<int>(rng() % 3)] = 0;
        const Vec3f p =
            cast<float>((0.75 * std::cbrt(std::abs(unit(rng))) / inside_outside_radial(shape, d)) * d);
        const double below_m = search.distance_m(cast<double>(p));
        if (!(below_m > depth_m)) continue;
        points.push_back(p);
        const Answer two = object.value().query(p, {Layer::kTwo}),
                     three = object.value().query(p, {Layer::kThree});
        for (const auto& [answer, errors] : {std::pair{&two, &second}, {&three, &third}}) {
          errors->add(std::abs(answer->signed_distance_m - (depth_m - below_m)), thin_m);
          errors->wrong_side += !answer->inside;
          ASSERT_NEAR(norm(answer->normal), 1, 1e-4) << test::name_of(shape);
        }
      }
      for (const Layer layer : {Layer::kTwo, Layer::kThree})
        EXPECT_TRUE(test::every_target_agrees(object.value(), points, {layer})) << test::name_of(shape);
    }
  record("layer_2", second);
  record("layer_3", third);
  EXPECT_GT(second.count, 300);
  EXPECT_EQ(second.wrong_side + third.wrong_side, 0);
  EXPECT_LE(second.over_a_tenth, limits.second_over * second.count);
  EXPECT_LE(third.over_a_tenth, limits.third_over * third.count);
  EXPECT_LT(std::max(second.worst, third.worst), limits.worst);
}

/// An ellipsoid in a superquadric of the same axes times 1.2: rays cross it at all angles.
Asset slim_ellipsoid(const Vec3d& axes, double e) {
  const Vec3d& b = axes;
  const auto crossings = [b](const Vec3d& origin, const Vec3d& direction, bool& inside) {
    const Vec3d o{origin.x / b.x, origin.y / b.y, origin.z / b.z},
        d{direction.x / b.x, direction.y / b.y, direction.z / b.z};
    const double square = dot(d, d), half = dot(o, d), root = half * half - square * (dot(o, o) - 1);
    inside = dot(o, o) < 1;
    std::vector<double> found;
    if (root <= 0) return found;
    for (const double t : {(-half - std::sqrt(root)) / square, (-half + std::sqrt(root)) / square})
      if (t > 0) found.push_back(t);
    return found;
  };
  const double thin_m = std::min({axes.x, axes.y, axes.z});
  return test::asset_of(
      {test::traced_part({1.2 * axes, e, e}, {}, 65, 128, 1, std::min(3 * thin_m, 2.0), crossings)}, 2);
}

TEST_P(AxisRatios, LayerThreeTellsTheDistanceToSlimEllipsoids) {
  const Limits& limits = GetParam();
  std::mt19937_64 rng(72);
  std::uniform_real_distribution<double> unit(-1, 1);
  Errors second, third;
  int inside = 0, outside = 0;
  for (const Vec3d& axes : slim_axes(limits.ratio))
    for (const double e : {0.6, 1.0}) {
      const auto object = Object::build(slim_ellipsoid(axes, e));
      ASSERT_TRUE(object.ok());
      const reference::SurfaceSearch search({axes, 1, 1});
      const double thin_m = std::min({axes.x, axes.y, axes.z});
      std::vector<Vec3f> points;
      for (int i = 0; i < 12; ++i) {
        const Vec3d d = normalized(Vec3d{unit(rng), unit(rng), unit(rng)});
        const double reach = 1 + 0.15 * unit(rng);
        const Vec3f p = cast<float>(Vec3d{reach * axes.x * d.x, reach * axes.y * d.y, reach * axes.z * d.z});
        points.push_back(p);
        const double exact_m = (reach < 1 ? -1 : 1) * search.distance_m(cast<double>(p));
        (reach < 1 ? inside : outside)++;
        const Answer two = object.value().query(p, {Layer::kTwo}),
                     three = object.value().query(p, {Layer::kThree});
        for (const auto& [answer, errors] : {std::pair{&two, &second}, {&three, &third}}) {
          errors->add(std::abs(answer->signed_distance_m - exact_m), thin_m);
          errors->wrong_side += answer->inside != (reach < 1) && std::abs(exact_m) > 0.02 * thin_m;
        }
      }
      for (const Layer layer : {Layer::kTwo, Layer::kThree})
        EXPECT_TRUE(test::every_target_agrees(object.value(), points, {layer}));
    }
  record("layer_2", second);
  record("layer_3", third);
  EXPECT_GT(inside, 100);
  EXPECT_GT(outside, 100);
  for (const Errors& errors : {second, third}) {
    EXPECT_LE(errors.over_a_tenth, limits.ellipsoid_over * errors.count);
    EXPECT_LE(errors.wrong_side, limits.wrong_side * errors.count);
    EXPECT_LT(errors.worst, limits.ellipsoid_worst);
  }
}

INSTANTIATE_TEST_SUITE_P(Slim, AxisRatios,
                         testing::Values(Limits{10, 0, 0, 0.01, 0.1, 0.03, 0},
                                         Limits{100, 0.04, 0.06, 0.01, 0.25, 0.015, 0.03},
                                         Limits{1000, 0.18, 0.28, 0.035, 0.45, 0.02, 0.1}),
                         [](const auto& limits) {
                           return std::to_string(static_cast<int>(limits.param.ratio));
                         });

}  // namespace
}  // namespace sqmap::runtime
