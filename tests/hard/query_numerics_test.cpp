// SPDX-License-Identifier: Apache-2.0
// Queries of hard shapes at hard places, on every instruction set, against searches and 50 digits.
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "sqmap/runtime/body.hpp"
#include "sqmap/runtime/contact.hpp"
#include "sqmap/runtime/instance.hpp"
#include "sqmap/runtime/object.hpp"

#include "hard/reference.hpp"
#include "hard/shells.hpp"
#include "hard/surface_search.hpp"

namespace sqmap::runtime {
namespace {

using reference::Real;

Object built(const Asset& asset) {
  auto object = Object::build(asset);
  EXPECT_TRUE(object.ok()) << (object ? "" : object.error().finding);
  return std::move(object).value();
}

/// What a batch on every target says of points that layer 1 must place: `exact` radial value of each.
struct SideErrors {
  int wrong = 0, inside = 0, outside = 0;
  double worst = 0;  ///< largest |beta - 1| of a wrong answer
};

SideErrors first_layer_errors(const Object& object, const std::vector<Vec3f>& points,
                              const std::vector<double>& off) {
  SideErrors errors;
  test::Batch batch(points.size());
  object.query(points, batch.answers(), {Layer::kOne});
  for (std::size_t i = 0; i < points.size(); ++i) {
    const bool is_inside = off[i] <= 0;
    (is_inside ? errors.inside : errors.outside)++;
    EXPECT_EQ(batch.inside[i] != 0, object.query(points[i], {Layer::kOne}).inside) << "scalar and batch";
    if ((batch.inside[i] != 0) == is_inside) continue;
    ++errors.wrong;
    errors.worst = std::max(errors.worst, std::abs(off[i]));
  }
  return errors;
}

/// Places within a few floats of the surface and somewhat farther, and beta - 1 there in 50 digits.
void places_beside_the_surface(const Superquadric& shape, std::mt19937_64& rng, std::vector<Vec3f>& points,
                               std::vector<double>& off) {
  std::uniform_real_distribution<double> unit(-1, 1);
  const Vec3d& axes = shape.semi_axes_m;
  for (int i = 0; i < 18; ++i) {
    Vec3d d{axes.x * unit(rng), axes.y * unit(rng), axes.z * unit(rng)};
    if (i % 6 == 0) d[i / 6 % 3] = 0;             // a plane of symmetry
    if (i % 6 == 1) d[0] = d[1 + i / 6 % 2] = 0;  // a pole or the end of an axis
    const auto beta = static_cast<double>(reference::radial(shape, d));
    if (!(beta > 0)) continue;
    // One float in or out along each axis, or a hundred thousandth.
    const double share = i % 4 == 2 ? 1 - 1e-5 : i % 4 == 3 ? 1 + 1e-5 : 1;
    Vec3f p = cast<float>((share / beta) * d);
    for (int axis = 0; axis < 3 && i % 4 < 2; ++axis)
      if (p[axis] != 0)
        p[axis] = std::nextafter(p[axis], i % 4 == 0 ? 0.0F : std::copysign(HUGE_VALF, p[axis]));
    points.push_back(p);
    off.push_back(static_cast<double>(reference::radial(shape, p) - 1));
  }
}

TEST(FirstLayer, ErrsOnlyWithinAFewFloatsOfTheSurface) {
  double worst = 0;
  int inside = 0, outside = 0, targets = 0;
  std::mt19937_64 rng(63);
  for (const double e1 : test::kExponents)
    for (const double e2 : test::kExponents)
      for (const Vec3d& axes : test::kHardAxes) {
        const double taper_share = e2 == 1.0 ? -0.9 : 0;
        const Superquadric shape{axes, e1, e2, taper_share * max_taper(e1)};
        const Object object = built(test::shell_asset(shape, 0.1, 3, 4));
        std::vector<Vec3f> points;
        std::vector<double> off;
        places_beside_the_surface(shape, rng, points, off);
        targets = test::for_each_target([&](SimdTarget) {
          const SideErrors errors = first_layer_errors(object, points, off);
          worst = std::max(worst, errors.worst);
          inside += errors.inside;
          outside += errors.outside;
        });
      }
  EXPECT_GT(inside, 800 * targets);
  EXPECT_GT(outside, 800 * targets);
  RecordProperty("worst_radial_error_of_a_wrong_side", std::to_string(worst * 1e7) + "e-7");
  EXPECT_LT(worst, 5e-7);
}

/// Points of the inside: at random, the centre, axes, planes of symmetry, and the surface itself.
std::vector<Vec3f> places_inside(const Superquadric& shape, std::mt19937_64& rng, int count) {
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<Vec3f> points{{0, 0, 0}};
  for (int i = 0; i < count; ++i) {
    const Vec3d& a = shape.semi_axes_m;
    Vec3d d{a.x * unit(rng), a.y * unit(rng), a.z * unit(rng)};
    if (i % 5 == 0) d[i / 5 % 3] = 0;
    if (i % 5 == 1) d[0] = d[1 + i / 5 % 2] = 0;
    const double beta = inside_outside_radial(shape, d);
    if (!(beta > 0)) continue;
    const double reach = i % 3 == 0 ? 0.999 : std::cbrt(std::abs(unit(rng)));
    points.push_back(cast<float>((reach / beta) * d));
  }
  return points;
}

// Known weakness, see the counts: the foot search starts from 8 x 8 points of the octant and now and then
// ends in a valley beside the nearest one.
TEST(SecondLayer, DepthBelowHardShapesIsThatOfASearch) {
  std::mt19937_64 rng(64);
  int count = 0, over_1e3 = 0, over_1e2 = 0, over_tenth_of_thinnest = 0;
  double worst = 0;
  for (const double e1 : {0.1, 0.5, 1.0, 2.0})
    for (const double e2 : {0.1, 0.5, 1.0, 2.0})
      for (const Vec3d& axes : test::kHardAxes) {
        const Superquadric shape{axes, e1, e2};
        const double thin = std::min({axes.x, axes.y, axes.z}), size = norm(axes), depth_m = 0.5 * thin;
        const Object object = built(test::shell_asset(shape, depth_m));
        const reference::SurfaceSearch search(shape);
        const std::vector<Vec3f> points = places_inside(shape, rng, 12);
        EXPECT_TRUE(test::every_target_agrees(object, points, {Layer::kTwo})) << test::name_of(shape);
        for (const Vec3f& p : points) {
          const Answer answer = object.query(p, {Layer::kTwo});
          ASSERT_TRUE(std::isfinite(answer.signed_distance_m)) << test::name_of(shape);
          ASSERT_NEAR(norm(answer.normal), 1, 1e-4) << test::name_of(shape);
          const double expected_m = depth_m - search.distance_m(cast<double>(p));
          const double error_m = std::abs(answer.signed_distance_m - expected_m);
          ++count;
          over_1e3 += error_m > 1e-3 * size;
          over_1e2 += error_m > 1e-2 * size;
          over_tenth_of_thinnest += error_m > 0.1 * thin;
          worst = std::max(worst, error_m / size);
        }
      }
  EXPECT_GT(count, 1400);
  RecordProperty("over_1e-3", over_1e3);
  RecordProperty("over_1e-2", over_1e2);
  RecordProperty("over_a_tenth_of_the_thinnest_axis", over_tenth_of_thinnest);
  EXPECT_LE(over_1e3, count * 3 / 100);
  EXPECT_LE(over_1e2, count * 3 / 1000);
  EXPECT_LE(over_tenth_of_thinnest, count * 7 / 100);
  EXPECT_LT(worst, 0.1);
}

/// A ball of radius 0.8 about the origin in an ellipsoid, all lengths times `scale`, and its map's error.
constexpr double kRadius = 0.8, kMapError = 1.5e-3;
Asset ball_asset(double scale) {
  const std::vector<test::Ball> balls{{{0, 0, 0}, kRadius * scale}};
  return test::asset_of({test::traced_part({scale * Vec3d{1.0, 1.1, 1.2}, 1, 1}, {}, 33, 64, 1, scale,
                                           [balls](const Vec3d& o, const Vec3d& d, bool& inside) {
                                             return test::union_crossings_m(balls, o, d, inside);
                                           })},
                        2 * kRadius * scale);
}

TEST(Scales, FromAMicrometreToAThousandKilometresAnswersGrowInProportion) {
  const double scales[] = {1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1, 10, 1e2, 1e3, 1e4, 1e5, 1e6};
  int known = 0;
  const int targets = test::for_each_target([&](SimdTarget) {
    for (const double scale : scales) {
      const Object object = built(ball_asset(scale));
      std::mt19937_64 rng(65);
      std::normal_distribution<double> normal;
      std::uniform_real_distribution<double> depth(-0.15, 0.1);
      std::vector<Vec3f> points;
      for (int i = 0; i < 100; ++i) {
        const Vec3d n = normalized(Vec3d{normal(rng), normal(rng), normal(rng)});
        points.push_back(cast<float>((scale * (kRadius + depth(rng))) * n));
      }
      test::Batch batch(points.size());
      object.query(points, batch.answers(), {Layer::kThree});
      for (std::size_t i = 0; i < points.size(); ++i) {
        const double r = norm(cast<double>(points[i])) / scale;
        ASSERT_NEAR(batch.distance_m[i] / scale, r - kRadius, kMapError) << scale;
        ASSERT_GT(dot(cast<double>(batch.normal[i]), normalized(cast<double>(points[i]))), 0.99);
        ++known;
      }
    }
  });
  EXPECT_EQ(known, targets * 1300);
}

// The point that a float of the world stands for, taken to the object in 50 digits.
TEST(FarFromTheOrigin, AnswersErrLikeTheObjectNotLikeTheCoordinates) {
  int known = 0, inside = 0;
  const Object object = built(ball_asset(1));
  const int targets = test::for_each_target([&](SimdTarget) {
    for (const double scale : {1e-6, 1.0, 1e6})
      for (const double sizes_away : {1.0, 1e3, 1e6}) {
        const Vec3d t_m = (scale * sizes_away) * Vec3d{0.6, -0.64, 0.48};
        const auto placed = Instance::place(object, Placement{{{0.8, 0, 0.6, 0}, t_m}, scale, false});
        ASSERT_TRUE(placed.ok());
        const Instance& instance = placed.value();
        std::mt19937_64 rng(66);
        std::uniform_real_distribution<double> unit(-1, 1);
        std::vector<Vec3f> points;
        for (int i = 0; i < 200; ++i)
          points.push_back(cast<float>(t_m + scale * Vec3d{unit(rng), unit(rng), unit(rng)}));
        test::Batch batch(points.size());
        instance.query(points, batch.answers(), {Layer::kThree});
        for (std::size_t i = 0; i < points.size(); ++i) {
          Real square = 0;
          for (int k = 0; k < 3; ++k) square += pow((Real(points[i][k]) - Real(t_m[k])) / Real(scale), 2);
          const double r = static_cast<double>(sqrt(square));
          if (!std::isfinite(batch.distance_m[i])) {
            EXPECT_GT(r, 0.99) << "inside the superquadric there is a distance";
            continue;
          }
          ++known;
          inside += batch.inside[i];
          if (r < 0.5) continue;  // towards the centre, all medial axis, the map itself errs more
          ASSERT_NEAR(batch.distance_m[i] / scale, r - kRadius, kMapError) << scale << ' ' << sizes_away;
        }
      }
  });
  EXPECT_GT(known, targets * 800);
  EXPECT_GT(inside, targets * 300);
}

// A mesh far from its own origin, instead of an instance. Points there are as coarse as float is; of the
// points that float has, the answers are as good as near the origin.
TEST(FarFromTheOrigin, AMeshFarFromItsOwnOriginErrsLikeTheObject) {
  int known = 0, met = 0;
  const int targets = test::for_each_target([&](SimdTarget) {
    for (const double sizes_away : {1.0, 7.0, 9.0, 1e2, 1e3, 1e4, 1e5, 1e6}) {
      const Vec3d t_m = sizes_away * Vec3d{0.613, -0.647, 0.481} + Vec3d{0.0137, 0.0211, -0.0171};
      Asset asset = ball_asset(1);
      for (Part& part : asset.parts) {
        part.object_from_part.translation_m = part.object_from_part.translation_m + t_m;
        part.sphere.centre_m = part.sphere.centre_m + t_m;
      }
      asset.sphere.centre_m = asset.sphere.centre_m + t_m;
      const Object object = built(asset);
      std::mt19937_64 rng(67);
      std::uniform_real_distribution<double> unit(-1, 1);
      std::vector<Vec3f> points, near_origin;
      for (int i = 0; i < 200; ++i) {
        near_origin.push_back(cast<float>(Vec3d{unit(rng), unit(rng), unit(rng)}));
        points.push_back(cast<float>(t_m + cast<double>(near_origin.back())));
      }
      test::Batch batch(points.size());
      object.query(points, batch.answers(), {Layer::kThree});
      for (std::size_t i = 0; i < points.size(); ++i) {
        const double r = norm(cast<double>(points[i]) - t_m);
        if (!std::isfinite(batch.distance_m[i]) || r < 0.5) continue;
        ++known;
        ASSERT_NEAR(batch.distance_m[i], r - kRadius, kMapError) << sizes_away;
      }
      // The points of a body are placed in double: there not even float's spacing is lost.
      const auto body = PointBody::build(near_origin);
      ASSERT_TRUE(body.ok());
      std::vector<Contact> contacts(points.size());
      const std::size_t count = object.contacts(body.value(), {{{}, t_m}, 1}, contacts, {{Layer::kThree}});
      for (std::size_t k = 0; k < std::min(count, contacts.size()); ++k) {
        const double r = norm(cast<double>(near_origin[contacts[k].point]));
        if (r < 0.5) continue;
        ++met;
        ASSERT_NEAR(contacts[k].depth_m, kRadius - r, kMapError) << sizes_away;
        // Places are told in float round the mesh's origin again.
        const double spacing_m = 0x1p-22 * norm(t_m);
        const Vec3d there_m = cast<double>(near_origin[contacts[k].point]) + t_m;
        ASSERT_NEAR(norm(cast<double>(contacts[k].position_m) - there_m), 0, spacing_m + 1e-6);
        ASSERT_NEAR(norm(cast<double>(contacts[k].surface_m) - t_m), kRadius, kMapError + spacing_m);
      }
    }
  });
  EXPECT_GT(known, targets * 600);
  EXPECT_GT(met, targets * 200);
}

// Section 7.4 of the prototype's findings: centre and medial axis. Either foot is right, the depth is one
// number.
TEST(MedialAxis, DepthIsExactThereWhicheverFootIsTaken) {
  const Superquadric shapes[] = {{{1, 1, 1}, 1, 1},
                                 {{1, 0.5, 0.5}, 1, 1},
                                 {{1, 0.5, 0.25}, 0.3, 0.3},
                                 {{0.5, 1, 1}, 0.1, 0.1},
                                 {{1, 1, 0.3}, 1, 0.5}};
  int count = 0;
  for (const Superquadric& shape : shapes) {
    const Object object = built(test::shell_asset(shape, 0.1));
    const reference::SurfaceSearch search(shape);
    const Vec3d& a = shape.semi_axes_m;
    for (const double t : {0.0, 1e-30, 1e-7, 0.01, -0.1, 0.3})
      for (int axis = 0; axis < 3; ++axis) {
        Vec3d p;
        p[axis] = t * a[axis];
        for (const Layer layer : {Layer::kTwo, Layer::kThree}) {
          const Answer answer = object.query(cast<float>(p), {layer});
          EXPECT_TRUE(test::every_target_agrees(object, std::vector<Vec3f>{cast<float>(p)}, {layer}));
          EXPECT_TRUE(answer.inside);
          EXPECT_NEAR(norm(answer.normal), 1, 1e-4);
          if (layer == Layer::kTwo) {
            EXPECT_NEAR(answer.signed_distance_m, 0.1 - search.distance_m(p), 2e-3 * norm(a))
                << test::name_of(shape) << ' ' << t << ' ' << axis;
          }
          EXPECT_LT(answer.signed_distance_m, 0);
          ++count;
        }
      }
  }
  EXPECT_EQ(count, 5 * 6 * 3 * 2);
}

}  // namespace
}  // namespace sqmap::runtime
