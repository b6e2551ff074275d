// SPDX-License-Identifier: Apache-2.0
// The equations of formats against 50 digits, in float and double, over all exponents, scales and axis
// ratios.
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "sqmap/asset/superquadric.hpp"
#include "sqmap/asset/validate.hpp"

#include "hard/reference.hpp"
#include "hard/shells.hpp"

namespace sqmap {
namespace {

using reference::Real;

constexpr Vec3d kRatios[] = {{1, 1, 1},     {1, 0.1, 0.1}, {0.001, 1, 0.5},
                             {1, 1, 0.001}, {1, 0.001, 1}, {0.001, 0.001, 1}};

template <class T>
class Scalar : public testing::Test {
 protected:
  static constexpr T kEpsilon = std::numeric_limits<T>::epsilon();
};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Scalar, Scalars);

template <class T>
SuperquadricOf<T> narrowed(const Vec3d& axes, double e1, double e2) {
  // Narrowing may leave the range by half a unit in the last place.
  return {cast<T>(axes), static_cast<T>(e1), static_cast<T>(e2)};
}

TYPED_TEST(Scalar, RadialFunctionHoldsToAFewUnitsInTheLastPlace) {
  using T = TypeParam;
  std::mt19937_64 rng(61);
  std::uniform_real_distribution<double> unit(-1, 1);
  double worst = 0;
  int inside = 0, outside = 0;
  for (const double e1 : test::kExponents)
    for (const double e2 : test::kExponents)
      for (const Vec3d& ratio : kRatios)
        for (const double scale : {1e-6, 1.0, 1e6}) {
          const auto sq = narrowed<T>(scale * ratio, e1, e2);
          for (int i = 0; i < 12; ++i) {
            const double reach = i % 4 == 3 ? 1e6 : 1.5;
            Vec3<T> p{static_cast<T>(reach * scale * ratio.x * unit(rng)),
                      static_cast<T>(reach * scale * ratio.y * unit(rng)),
                      static_cast<T>(reach * scale * ratio.z * unit(rng))};
            if (i % 4 == 1) p[i / 4 % 3] = 0;                  // on a plane of symmetry
            if (i % 4 == 2) p[0] = p[(i / 4) % 2 + 1] = T(0);  // on an axis
            const Real exact = reference::radial(sq, p);
            const T beta = inside_outside_radial(sq, p);
            ASSERT_TRUE(std::isfinite(beta));
            (exact < 1 ? inside : outside)++;
            if (exact == 0) continue;
            worst = std::max(worst, static_cast<double>(abs(Real(beta) - exact) / exact));
          }
        }
  EXPECT_GT(inside, 500);
  EXPECT_GT(outside, 500);
  this->RecordProperty("worst_units_in_the_last_place", std::to_string(worst / TestFixture::kEpsilon));
  EXPECT_LT(worst, 4 * TestFixture::kEpsilon);
}

TYPED_TEST(Scalar, TaperedRadialFunctionHoldsToAFewUnitsInTheLastPlace) {
  using T = TypeParam;
  std::mt19937_64 rng(65);
  std::uniform_real_distribution<double> unit(-1, 1);
  double worst = 0, worst_on_surface = 0;
  int inside = 0, outside = 0;
  for (const double e1 : {0.1, 0.3, 1.0, 1.9})
    for (const double e2 : {0.1, 2.0})
      for (const Vec3d& ratio : kRatios)
        for (const double share : {-1.0, 0.6}) {
          auto sq = narrowed<T>(ratio, e1, e2);
          sq.taper = static_cast<T>(share * max_taper(e1));
          for (int i = 0; i < 4; ++i) {
            const double reach = i == 3 ? 1e6 : 1.5;
            Vec3<T> p{static_cast<T>(reach * ratio.x * unit(rng)),
                      static_cast<T>(reach * ratio.y * unit(rng)),
                      static_cast<T>(reach * ratio.z * unit(rng))};
            if (i == 1) p[static_cast<int>(rng() % 3)] = 0;
            if (i == 2) p[0] = p[1] = T(0);
            const Real exact = reference::radial(sq, p);
            const T beta = inside_outside_radial(sq, p);
            ASSERT_TRUE(std::isfinite(beta));
            (exact < 1 ? inside : outside)++;
            worst = std::max(worst, static_cast<double>(abs(Real(beta) - exact) / exact));
            const double eta = std::numbers::pi / 2 * unit(rng), omega = std::numbers::pi * unit(rng);
            const auto on = surface_point(
                sq, superellipse_point(static_cast<T>(std::cos(eta)), static_cast<T>(std::sin(eta)), sq.e1),
                superellipse_point(static_cast<T>(std::cos(omega)), static_cast<T>(std::sin(omega)), sq.e2));
            worst_on_surface =
                std::max(worst_on_surface, static_cast<double>(abs(reference::radial(sq, on) - 1)));
          }
        }
  EXPECT_GT(inside, 50);
  EXPECT_GT(outside, 50);
  this->RecordProperty("worst_units_in_the_last_place", std::to_string(worst / TestFixture::kEpsilon));
  this->RecordProperty("surface_points", std::to_string(worst_on_surface / TestFixture::kEpsilon));
  EXPECT_LT(worst, 4 * TestFixture::kEpsilon);
  EXPECT_LT(worst_on_surface, 4 * TestFixture::kEpsilon);
}

TYPED_TEST(Scalar, RadialFunctionStaysFiniteAtTheEndsOfTheNumbers) {
  using T = TypeParam;
  using Limits = std::numeric_limits<T>;
  const T far = sizeof(T) == 4 ? T(1e30) : T(1e200);
  for (const double e1 : test::kExponents)
    for (const double e2 : test::kExponents) {
      const auto sq = narrowed<T>({1, 0.5, 2}, e1, e2);
      for (const T x : {T(0), Limits::denorm_min(), Limits::min(), T(1), far})
        for (const T y : {T(0), Limits::denorm_min(), -far})
          for (const T z : {T(0), -Limits::denorm_min(), far}) {
            const T beta = inside_outside_radial(sq, {x, y, z});
            ASSERT_TRUE(std::isfinite(beta) && beta >= 0) << x << ' ' << y << ' ' << z;
            const Real exact = reference::radial(sq, Vec3<T>{x, y, z});
            if (exact > Real(Limits::min()) * 8) {
              EXPECT_LT(static_cast<double>(abs(Real(beta) - exact) / exact), 16 * TestFixture::kEpsilon);
            }
          }
    }
}

TYPED_TEST(Scalar, SurfacePointsLieOnTheSurface) {
  using T = TypeParam;
  std::mt19937_64 rng(62);
  std::uniform_real_distribution<double> turn(-std::numbers::pi, std::numbers::pi);
  double worst = 0;
  for (const double e1 : test::kExponents)
    for (const double e2 : test::kExponents)
      for (const Vec3d& ratio : kRatios) {
        const auto sq = narrowed<T>(ratio, e1, e2);
        for (int i = 0; i < 40; ++i) {
          const double eta = i < 5 ? (i - 2) * std::numbers::pi / 4 : turn(rng) / 2;
          const double omega = i < 10 ? (i - 5) * std::numbers::pi / 2 : turn(rng);
          const auto point = surface_point(
              sq, superellipse_point(static_cast<T>(std::cos(eta)), static_cast<T>(std::sin(eta)), sq.e1),
              superellipse_point(static_cast<T>(std::cos(omega)), static_cast<T>(std::sin(omega)), sq.e2));
          worst = std::max(worst, static_cast<double>(abs(reference::radial(sq, point) - 1)));
        }
      }
  this->RecordProperty("worst_units_in_the_last_place", std::to_string(worst / TestFixture::kEpsilon));
  EXPECT_LT(worst, 4 * TestFixture::kEpsilon);
}

TYPED_TEST(Scalar, NormalsPointAlongTheGradientCloseToPolesAndSeamsToo) {
  using T = TypeParam;
  double worst = 0;
  int count = 0;
  for (const double e1 : test::kExponents)
    for (const double e2 : test::kExponents)
      for (const Vec3d& ratio : kRatios) {
        const auto sq = narrowed<T>(ratio, e1, e2);
        for (const double eta : {1e-3, 0.01, 0.3, 0.785, 1.2, 1.5607})
          for (const double omega : {1e-3, 0.02, 0.6, 1.1, 1.5697}) {
            const Vec3d d{std::cos(eta) * std::cos(omega), std::cos(eta) * std::sin(omega), -std::sin(eta)};
            const Vec3<T> p{static_cast<T>(ratio.x * d.x), static_cast<T>(ratio.y * d.y),
                            static_cast<T>(ratio.z * d.z)};
            const Vec3<T> n = normal_at(sq, p);
            ASSERT_LT(std::abs(norm(n) - 1), 4 * TestFixture::kEpsilon);
            const auto g = reference::gradient(sq, reference::Point{Real(p.x), Real(p.y), Real(p.z)});
            const Real length = sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
            Real off = 0;
            for (int k = 0; k < 3; ++k) off += pow(Real(n[k]) - g[k] / length, 2);
            worst = std::max(worst, static_cast<double>(sqrt(off)));
            ++count;
          }
      }
  EXPECT_EQ(count, 25 * 6 * 30);
  this->RecordProperty("worst_units_in_the_last_place", std::to_string(worst / TestFixture::kEpsilon));
  // x^(2/e - 1) has 19 times the relative error of x at e = 0.1, and x itself a few units.
  EXPECT_LT(worst, 32 * TestFixture::kEpsilon);
}

TEST(Exponents, OutsideOfTheirRangeAreRefusedByRule21) {
  const auto rules = [](double e1, double e2) {
    Asset asset = test::shell_asset({{1, 1, 1}, 1, 1}, 0.1);
    asset.parts[0].shape.e1 = e1;
    asset.parts[0].shape.e2 = e2;
    const bool is_valid = validate(asset, CheckLevel::kQuick).empty();
    const auto object = runtime::Object::build(asset);
    EXPECT_EQ(object.ok(), is_valid);
    if (!object) {
      EXPECT_NE(object.error().finding.find("must be 0.1"), std::string::npos) << object.error().finding;
      EXPECT_FALSE(object.error().remedy.empty());
    }
    return is_valid;
  };
  for (const double good : {0.1, 0.3, 1.0, 2.0}) {
    EXPECT_TRUE(rules(good, 1));
    EXPECT_TRUE(rules(1, good));
  }
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad :
       {std::nextafter(0.1, 0), std::nextafter(2.0, 3), 0.0, -1.0, 1e300, nan, HUGE_VAL, 5e-324}) {
    EXPECT_FALSE(rules(bad, 1)) << bad;
    EXPECT_FALSE(rules(1, bad)) << bad;
  }
}

}  // namespace
}  // namespace sqmap
