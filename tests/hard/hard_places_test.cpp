// SPDX-License-Identifier: Apache-2.0
// Coordinates of every kind, and points a float beside surfaces, on every instruction set.
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "sqmap/runtime/object.hpp"

#include "hard/shells.hpp"
#include "hard/surface_search.hpp"

namespace sqmap::runtime {
namespace {

Object built(const Asset& asset) {
  auto object = Object::build(asset);
  EXPECT_TRUE(object.ok()) << (object ? "" : object.error().finding);
  return std::move(object).value();
}

/// Coordinates of every kind, and each with one float more and less.
std::vector<float> hard_coordinates(double axis_m) {
  const auto a = static_cast<float>(axis_m);
  std::vector<float> values;
  for (const float v : {0.0F, a, a / 2, 1e-3F * a, 1e30F, std::numeric_limits<float>::denorm_min(),
                        std::numeric_limits<float>::min()})
    for (const float sign : {-1.0F, 1.0F})
      for (const float towards : {sign * v, HUGE_VALF, -HUGE_VALF})
        values.push_back(std::nextafter(sign * v, towards));
  for (const float v : {HUGE_VALF, -HUGE_VALF, std::numeric_limits<float>::quiet_NaN()}) values.push_back(v);
  return values;
}

TEST(HardPlaces, EveryAnswerIsFlaggedOrFiniteWithAUnitNormalAndTheSameOnEveryTarget) {
  int flagged = 0, known = 0, turned = 0;
  const int targets = test::for_each_target([&](SimdTarget) {
    for (const double e1 : {0.1, 1.0, 2.0})
      for (const double e2 : {0.1, 2.0})
        for (const Vec3d& axes : test::kHardAxes) {
          const Superquadric shape{axes, e1, e2};
          const Object object =
              built(test::shell_asset(shape, 0.3 * std::min({axes.x, axes.y, axes.z}), 5, 8));
          const std::vector<float> x = hard_coordinates(axes.x), y = hard_coordinates(axes.y),
                                   z = hard_coordinates(axes.z);
          std::vector<Vec3f> points;
          // Each value of one coordinate with a walk through those of the others.
          for (std::size_t i = 0; i < x.size(); ++i)
            for (std::size_t j = 0; j < y.size(); j += 4)
              points.push_back({x[i], y[(i + j) % y.size()], z[(3 * i + 7 * j) % z.size()]});
          for (std::size_t i = 0; i < x.size(); ++i) {
            points.push_back({x[i], 0, 0});
            points.push_back({0, y[i], 0});
            points.push_back({0, -0.0F, z[i]});
          }
          test::Batch batch(points.size());
          for (const Layer layer : {Layer::kOne, Layer::kTwo, Layer::kThree}) {
            object.query(points, batch.answers(), {layer});
            for (std::size_t i = 0; i < points.size(); ++i) {
              const Vec3f& p = points[i];
              const Answer one = object.query(p, {layer});
              const bool is_number = std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
              ASSERT_TRUE(one.inside == (batch.inside[i] != 0) && one.part == batch.part[i] &&
                          one.normal == batch.normal[i]);
              ASSERT_TRUE(one.signed_distance_m == batch.distance_m[i] ||
                          (std::isnan(one.signed_distance_m) && std::isnan(batch.distance_m[i])));
              ASSERT_FALSE(std::isinf(one.signed_distance_m));
              ASSERT_TRUE(std::isfinite(norm(one.normal)) && std::isfinite(norm(one.surface_m)));
              if (!is_number) {
                ASSERT_TRUE(one.part == kNowhere && !one.inside && std::isnan(one.signed_distance_m) &&
                            one.layer == Layer::kAuto);
                ++flagged;
                continue;
              }
              if (one.part == kNowhere) continue;
              // What vanishes in the units of the object counts as 0; at the centre layer 1 has no direction.
              constexpr float kVanishing = 1e-36F;
              const bool is_centre = std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) < kVanishing;
              if (layer != Layer::kOne || !is_centre) {
                ASSERT_NEAR(norm(one.normal), 1, 1e-4) << test::name_of(shape);
              }
              if (layer == Layer::kOne) {
                for (int axis = 0; axis < 3; ++axis)
                  ASSERT_TRUE(one.normal[axis] * p[axis] >= 0 || std::abs(p[axis]) < kVanishing);
              } else {
                // Outwards is from an inner point towards the surface, and from the surface to an outer one.
                const Vec3f up = (one.inside ? -1.0F : 1.0F) * (p - one.surface_m);
                turned += dot(up, one.normal) < -1e-3F * norm(up) && norm(up) > 1e-5F;
                ASSERT_TRUE(std::isfinite(one.signed_distance_m))
                    << test::name_of(shape) << ": " << p.x << ' ' << p.y << ' ' << p.z;
                ++known;
              }
            }
          }
        }
  });
  // A shell deeper than the radius of an edge folds over there: its normals turn round, as eq. (22) has it.
  RecordProperty("normals_turned_by_a_fold", turned);
  EXPECT_LT(turned, known / 100);
  EXPECT_GT(flagged, 1000 * targets);
  EXPECT_GT(known, 1000 * targets);
}

/// A shape, and what its curves' tables err by where they are worst.
struct Smooth {
  Superquadric shape;
  double distance_m, normal;
};

// Depths are less than the shapes' least radii, so that the surface lies kDepth_m below everywhere.
TEST(NearSurface, PointsOneFloatOffKnowTheirDistanceSideAndNormal) {
  constexpr double kDepth_m = 0.04;
  std::mt19937_64 rng(74);
  std::normal_distribution<double> normal;
  int on_surface = 0, on_superquadric = 0, nowhere = 0, targets = 0;
  for (const auto& [shape, most_m, most_normal] : {Smooth{{{1, 1, 1}, 1, 1}, 1e-6, 1e-4},
                                                   {{{1, 0.7, 0.5}, 1, 1}, 1e-6, 1e-4},
                                                   {{{0.6, 0.9, 1}, 0.8, 0.7}, 1e-6, 2e-4},
                                                   {{{1, 0.8, 0.9}, 1.3, 1}, 3e-4, 0.012}}) {
    const Object object = built(test::shell_asset(shape, kDepth_m, 65, 128));
    const reference::SurfaceSearch search(shape);
    struct Place {
      Vec3d outward;
      double beta, exact_m;
      bool is_on_surface;
    };
    std::vector<Vec3f> points;
    std::vector<Place> places;
    for (int i = 0; i < 40; ++i) {
      const Vec3d d = normalized(Vec3d{normal(rng), normal(rng), normal(rng)});
      const Vec3d r = (1 / inside_outside_radial(shape, d)) * d, n = normal_at(shape, r);
      for (const double below_m : {0.0, kDepth_m})
        for (const int step : {-1, 0, 1}) {
          Vec3f p = cast<float>(r - below_m * n);
          for (int axis = 0; axis < 3 && step != 0; ++axis)
            p[axis] = std::nextafter(p[axis], step < 0 ? 0.0F : std::copysign(HUGE_VALF, p[axis]));
          points.push_back(p);
          const double beta = inside_outside_radial(shape, cast<double>(p));
          const double below = (beta < 1 ? 1 : -1) * search.distance_m(cast<double>(p));
          places.push_back({n, beta, kDepth_m - below, below_m > 0});
        }
    }
    targets =
        test::for_each_target([&, &shape = shape, &most_m = most_m, &most_normal = most_normal](SimdTarget) {
          for (const Layer layer : {Layer::kTwo, Layer::kThree}) {
            test::Batch batch(points.size());
            object.query(points, batch.answers(), {layer});
            for (std::size_t i = 0; i < points.size(); ++i) {
              const Place& at = places[i];
              SCOPED_TRACE(test::name_of(shape) + ", layer " + std::to_string(static_cast<int>(layer)));
              if (batch.part[i] == kNowhere) {
                ++nowhere;
                ASSERT_GT(at.beta, 1 - 5e-7);  // as FirstLayer.ErrsOnlyWithinAFewFloatsOfTheSurface
                continue;
              }
              ASSERT_LT(at.beta, 1 + 5e-7);
              (at.is_on_surface ? on_surface : on_superquadric)++;
              ASSERT_NEAR(batch.distance_m[i], at.exact_m, most_m);
              if (batch.distance_m[i] != 0) {
                ASSERT_EQ(batch.inside[i] != 0, batch.distance_m[i] < 0);
              }
              ASSERT_LT(norm(cast<double>(batch.normal[i]) - at.outward), most_normal);
            }
          }
        });
  }
  EXPECT_GT(on_surface, 900 * targets);
  EXPECT_GT(on_superquadric, 400 * targets);
  EXPECT_GT(nowhere, 200 * targets);
}

}  // namespace
}  // namespace sqmap::runtime
