// SPDX-License-Identifier: Apache-2.0
// Foot points in float and double, against searches over the surface: plane ones that a rule by direction
// misses by up to 71 degrees, those as shells on every instruction set too, and those of hard shapes.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "sqmap/asset/shape_table.hpp"
#include "sqmap/runtime/object.hpp"

#include "hard/shells.hpp"
#include "hard/surface_search.hpp"

namespace sqmap {
namespace {

struct FootCase {
  double a2, e, x, y;
  double by_direction_deg, nearest_deg;  ///< parameter of eq. (14): what the paper's rule says and what is so
};
constexpr FootCase kCases[] = {
    {0.2, 0.6, 0.3, 0.04, 27.0, 82.2}, {0.25, 1.3, 0.3, 0.1, 51.3, 65.6}, {0.5, 0.4, 0.55, 0.1, 4.6, 75.7}};
// a3 is so long, and e1 so small, that the nearest point lies in the plane of the question.
Superquadric column_of(const FootCase& c) { return {{1, c.a2, 50}, 0.1, c.e}; }

struct Nearest {
  double parameter_deg, distance_m;
};
Nearest by_search(const FootCase& c) {
  Nearest nearest{0, std::numeric_limits<double>::infinity()};
  constexpr int kSteps = 90000;
  for (int k = 0; k <= kSteps; ++k) {
    const double t = k * std::numbers::pi / 2 / kSteps;
    const double distance_m =
        std::hypot(std::pow(std::cos(t), c.e) - c.x, c.a2 * std::pow(std::sin(t), c.e) - c.y);
    if (distance_m < nearest.distance_m) nearest = {k * 90.0 / kSteps, distance_m};
  }
  return nearest;
}
template <class T>
double parameter_deg(const FootCase& c, const Vec3<T>& r) {
  const double x = std::abs(double(r.x)), y = std::abs(double(r.y)) / c.a2;
  return std::atan2(std::pow(y, 1 / c.e), std::pow(x, 1 / c.e)) * 180 / std::numbers::pi;
}
constexpr double kSigns[][2] = {{1, 1}, {-1, 1}, {1, -1}, {-1, -1}};

TEST(PlaneFootPoints, SearchFindsWhatTheFindingsState) {
  for (const FootCase& c : kCases) {
    EXPECT_NEAR(by_search(c).parameter_deg, c.nearest_deg, 0.06);
    EXPECT_GT(std::abs(c.by_direction_deg - c.nearest_deg), 14) << "the rule by direction misses it";
  }
}

template <class T>
class PlaneFootPoints : public testing::Test {};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(PlaneFootPoints, Scalars);

TYPED_TEST(PlaneFootPoints, AreTheNearestInEveryQuadrant) {
  using T = TypeParam;
  double worst_deg = 0, worst_m = 0;
  for (const FootCase& c : kCases) {
    const Nearest nearest = by_search(c);
    const ShapeTable<T> table(column_of(c), 65, 512);
    for (const auto& sign : kSigns) {
      const Foot<T> foot = table.foot({static_cast<T>(sign[0] * c.x), static_cast<T>(sign[1] * c.y), T(0)});
      const Vec3<T> r = table.sample(foot.row, foot.col).point_m;
      EXPECT_GT(r.x * sign[0], 0);
      EXPECT_GT(r.y * sign[1], 0);
      worst_deg = std::max(worst_deg, std::abs(parameter_deg(c, r) - nearest.parameter_deg));
      worst_m = std::max(worst_m, std::abs(static_cast<double>(foot.depth_m) - nearest.distance_m));
    }
  }
  this->RecordProperty("worst_deg", std::to_string(worst_deg));
  this->RecordProperty("worst_m", std::to_string(worst_m * 1e6) + "e-6");
  EXPECT_LT(worst_deg, 2e-3) << "the search itself looks every thousandth";
  EXPECT_LT(worst_m, 1e-6);
}

// A shell's surface lies D below the superquadric: what lies at S, by search, is S - D deep in it, along the
// same line. Points of the surface represented are D from the superquadric, so none is nearer than that.
TEST(PlaneFootPoints, AreThoseOfShellsOnEveryTarget) {
  constexpr double kDepth_m = 0.03;
  double worst_deg = 0, worst_m = 0;
  for (const FootCase& c : kCases) {
    const Nearest nearest = by_search(c);
    const auto object = runtime::Object::build(test::shell_asset(column_of(c), kDepth_m, 33, 128));
    ASSERT_TRUE(object.ok());
    std::vector<Vec3f> points;
    for (const auto& sign : kSigns) points.push_back(cast<float>(Vec3d{sign[0] * c.x, sign[1] * c.y, 0}));
    test::for_each_target([&](runtime::SimdTarget target) {
      for (const runtime::Layer layer : {runtime::Layer::kTwo, runtime::Layer::kThree}) {
        test::Batch batch(points.size());
        object.value().query(points, batch.answers(), {layer});
        for (std::size_t i = 0; i < points.size(); ++i) {
          ASSERT_TRUE(batch.inside[i] != 0) << static_cast<int>(target);
          const Vec3d p = cast<double>(points[i]), surface = cast<double>(batch.surface_m[i]);
          const double deep_m = nearest.distance_m - kDepth_m;
          worst_m = std::max(worst_m, std::abs(-static_cast<double>(batch.distance_m[i]) - deep_m));
          const Vec3d foot = p + (nearest.distance_m / deep_m) * (surface - p);
          worst_deg = std::max(worst_deg, std::abs(parameter_deg(c, foot) - nearest.parameter_deg));
        }
      }
    });
  }
  RecordProperty("worst_deg", std::to_string(worst_deg));
  RecordProperty("worst_m", std::to_string(worst_m * 1e6) + "e-6");
  EXPECT_LT(worst_deg, 2e-3);
  EXPECT_LT(worst_m, 1e-5);
}

/// Shapes whose feet are alike hard to find, and how many may be missed.
struct FootClass {
  std::string name;
  std::vector<Vec3d> axes;
  std::vector<double> exponents;
  double
      most_missed;  ///< share of points whose foot is farther than the nearest by 0.1 % of the shape's size
  double most_off;  ///< of the depth from the distance to the nearest, as a share of the size
};
const std::vector<Vec3d> kCompact{{1, 1, 1}, {1, 0.7, 0.5}, {0.5, 0.9, 1}};
const FootClass kFootClasses[] = {
    {"round", kCompact, {0.5, 1.0, 1.5}, 0.005, 2e-3},
    {"near_boxes", kCompact, {0.1}, 0.02, 0.02},
    {"pointed", kCompact, {1.9, 2.0}, 0.01, 2e-3},
    {"mixed_exponents", kCompact, {0.1, 0.5, 2.0}, 0.015, 0.015},
    {"needles_and_plates",
     {{0.1, 0.1, 1}, {1, 0.1, 1}, {0.01, 1, 1}, {1, 0.01, 0.01}},
     {0.3, 1.0},
     0.09,
     0.012},
    {"thousand_to_one", {{0.001, 0.001, 1}, {1, 0.001, 1}, {1, 0.03, 0.001}}, {0.3, 1.0, 1.7}, 0.015, 0.01}};

template <class T>
class HardFeet : public testing::Test {};
TYPED_TEST_SUITE(HardFeet, Scalars);

// Known weakness, by kind of shape: the search starts from the nearest of 8 x 8 places of an octant and takes
// three steps. Where two faces are nearly as near it may end on the other, and on slim shapes beside the
// nearest place, from where the depth, a projection on the normal, may also be less.
TYPED_TEST(HardFeet, AreTheNearestButForTheSharesStated) {
  using T = TypeParam;
  std::mt19937_64 rng(76);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (const FootClass& kind : kFootClasses) {
    int count = 0, missed = 0;
    double most = 0, least = 0;
    for (const Vec3d& axes : kind.axes)
      for (const double e1 : kind.exponents)
        for (const double e2 : kind.exponents) {
          const Superquadric shape{axes, e1, e2};
          const ShapeTable<T> table(shape, 65, 128);
          const reference::SurfaceSearch search(shape);
          const double size = norm(axes);
          for (int i = 0; i < 120 / static_cast<int>(kind.exponents.size() * kind.exponents.size()); ++i) {
            const Vec3d d{axes.x * unit(rng), axes.y * unit(rng), axes.z * unit(rng)};
            const double reach = i % 8 == 0 ? 1 : std::cbrt(std::abs(unit(rng)));
            const Vec3<T> m = cast<T>((reach / inside_outside_radial(shape, d)) * d);
            const Foot<T> foot = table.foot(m);
            const double nearest_m = search.distance_m(cast<double>(m));
            const double off = (std::abs(static_cast<double>(foot.depth_m)) - nearest_m) / size;
            ASSERT_TRUE(std::isfinite(off)) << test::name_of(shape);
            ++count;
            missed += off > 1e-3;
            most = std::max(most, off);
            least = std::min(least, off);
          }
        }
    SCOPED_TRACE(kind.name);
    this->RecordProperty(kind.name, std::to_string(missed) + " of " + std::to_string(count) + ", most " +
                                        std::to_string(most) + ", least " + std::to_string(least));
    EXPECT_GE(count, 300);
    EXPECT_LE(missed, kind.most_missed * count);
    EXPECT_LE(std::max(most, -least), kind.most_off);
  }
}

// By symmetry to the last bit, zeros of either sign included; by scale but for the rounding of arc lengths in
// the tables. In float the fourth powers of a cell's lengths underflow where micrometres are given in metres;
// the runtime keeps lengths in units near the object's size. No formula of the surface in it.
TYPED_TEST(HardFeet, FollowMirrorsAndScale) {
  using T = TypeParam;
  constexpr double kFactor = sizeof(T) == 4 ? 0x1p8 : 0x1p20;
  std::mt19937_64 rng(77);
  std::uniform_real_distribution<double> unit(0, 1);
  double worst = 0, worst_scaled = 0;
  for (const double e1 : test::kExponents)
    for (const double e2 : test::kExponents)
      for (const Vec3d& axes : test::kHardAxes) {
        const Superquadric shape{axes, e1, e2};
        const ShapeTable<T> table(shape, 65, 128), small({(1 / kFactor) * axes, e1, e2}, 65, 128),
            large({kFactor * axes, e1, e2}, 65, 128);
        SCOPED_TRACE(test::name_of(shape));
        for (int i = 0; i < 8; ++i) {
          Vec3d d{axes.x * unit(rng), axes.y * unit(rng), axes.z * unit(rng)};
          if (i > 4) d[i % 3] = 0;
          const Vec3<T> m = cast<T>((0.99 * std::cbrt(unit(rng)) / inside_outside_radial(shape, d)) * d);
          const Foot<T> foot = table.foot(m);
          const Vec3<T> place = table.sample(foot.row, foot.col).point_m;
          for (int signs = 0; signs < 8; ++signs) {
            const Vec3<T> sign{signs & 1 ? T(-1) : T(1), signs & 2 ? T(-1) : T(1), signs & 4 ? T(-1) : T(1)};
            const Foot<T> mirrored = table.foot({sign.x * m.x, sign.y * m.y, sign.z * m.z});
            ASSERT_EQ(mirrored.depth_m, foot.depth_m);
            ASSERT_EQ(mirrored.cell_m, foot.cell_m);
            const Vec3<T> there = table.sample(mirrored.row, mirrored.col).point_m;
            // On a plane of symmetry either of two feet is right.
            for (int axis = 0; axis < 3; ++axis)
              worst = std::max(worst,
                               std::abs(static_cast<double>(std::abs(there[axis]) - std::abs(place[axis]))));
            for (int axis = 0; axis < 3; ++axis)
              ASSERT_TRUE(m[axis] == 0 || sign[axis] * there[axis] >= 0) << axis;
          }
          for (const auto& [other, factor] : {std::pair{&small, T(1 / kFactor)}, {&large, T(kFactor)}}) {
            const T depth_m = other->foot(factor * m).depth_m / factor;
            worst_scaled = std::max(worst_scaled, static_cast<double>(std::abs(depth_m - foot.depth_m)));
          }
        }
      }
  this->RecordProperty("worst_epsilons", std::to_string(worst / std::numeric_limits<T>::epsilon()));
  this->RecordProperty("worst_epsilons_scaled",
                       std::to_string(worst_scaled / std::numeric_limits<T>::epsilon()));
  EXPECT_LT(worst, 32 * std::numeric_limits<T>::epsilon());
  EXPECT_LT(worst_scaled, 32 * std::numeric_limits<T>::epsilon());
}

}  // namespace
}  // namespace sqmap
