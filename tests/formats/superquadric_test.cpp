// SPDX-License-Identifier: Apache-2.0
#include "sqmap/asset/superquadric.hpp"

#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace sqmap {
namespace {

constexpr double kPi = std::numbers::pi;
const double kExponents[] = {0.1, 0.3, 1.0, 1.9, 2.0};

/// The paper's eq. (1) as printed (2/e2 for its 2/e^2), in long double: shares no line with the ratio form.
long double paper_f(const Superquadric& sq, const Vec3d& p) {
  const long double e1 = sq.e1, e2 = sq.e2;
  const long double x = std::pow(std::fabs(static_cast<long double>(p.x) / sq.semi_axes_m.x), 2 / e2);
  const long double y = std::pow(std::fabs(static_cast<long double>(p.y) / sq.semi_axes_m.y), 2 / e2);
  const long double z = std::pow(std::fabs(static_cast<long double>(p.z) / sq.semi_axes_m.z), 2 / e1);
  return std::pow(std::pow(x + y, e2 / e1) + z, e1);
}

TEST(InsideOutside, AgreesWithThePaperInLongDouble) {
  std::mt19937_64 rng(1);
  std::uniform_real_distribution<double> unit(0, 1);
  int inside = 0, count = 0;
  for (const double e1 : kExponents) {
    for (const double e2 : kExponents) {
      for (int i = 0; i < 200; ++i, ++count) {
        const Superquadric sq{{0.2 + unit(rng), 0.2 + unit(rng), 0.2 + unit(rng)}, e1, e2};
        const Vec3d p{2 * unit(rng) - 1, 2 * unit(rng) - 1, 2 * unit(rng) - 1};
        const auto expected = static_cast<double>(paper_f(sq, p));
        EXPECT_NEAR(inside_outside(sq, p), expected, 1e-12 * expected);
        inside += expected < 1;
      }
    }
  }
  EXPECT_GT(inside, count / 10);
  EXPECT_LT(inside, count * 9 / 10);
}

const double kTaperShares[] = {-1, -0.5, 0.7, 1};  // of max_taper

Superquadric tapered(const Vec3d& axes, double e1, double e2, double share) {
  return {axes, e1, e2, share * max_taper(e1)};
}
Superquadric rigid(Superquadric sq) {
  sq.taper = 0;
  return sq;
}
/// The paper's eq. (2) with K_x = K_y, in long double, and its inverse.
long double taper_width(const Superquadric& sq, double z) {
  return 1 + static_cast<long double>(sq.taper) / sq.semi_axes_m.z * z;
}
Vec3d untapered(const Superquadric& sq, const Vec3d& p) {
  const long double width = taper_width(sq, p.z);
  return {static_cast<double>(p.x / width), static_cast<double>(p.y / width), p.z};
}

TEST(Taper, SurfaceIsTheRigidOneTaperedAndHasBetaOne) {
  for (const double e1 : kExponents) {
    for (const double e2 : kExponents) {
      for (const double share : kTaperShares) {
        const Superquadric sq = tapered({1, 0.4, 2}, e1, e2, share);
        for (int row = -16; row <= 16; ++row) {
          for (int col = 0; col < 64; ++col) {
            const auto eta = superellipse_point(std::cos(row * kPi / 32), std::sin(row * kPi / 32), e1);
            const auto omega = superellipse_point(std::cos(col * kPi / 32), std::sin(col * kPi / 32), e2);
            const Vec3d p = surface_point(sq, eta, omega);
            const Vec3d bare = surface_point(rigid(sq), eta, omega);
            EXPECT_NEAR(norm(untapered(sq, p) - bare), 0, 1e-13);
            EXPECT_NEAR(inside_outside_radial(sq, p), 1, 1e-13);
            EXPECT_NEAR(inside_outside_radial(sq, 1e-3 * p), 1e-3, 1e-15);
            EXPECT_NEAR(inside_outside_radial(sq, 1e3 * p), 1e3, 1e-9);
          }
        }
      }
    }
  }
}

TEST(Taper, InsideIsWhereThePaperSaysSoOfTheUntaperedPoint) {
  std::mt19937_64 rng(11);
  std::uniform_real_distribution<double> unit(-1, 1);
  int inside = 0, count = 0;
  for (const double e1 : kExponents) {
    for (const double share : kTaperShares) {
      const Superquadric sq = tapered({1, 0.4, 2}, e1, 0.7, share);
      const SuperquadricOf<float> narrow{
          {1, 0.4F, 2}, static_cast<float>(e1), 0.7F, static_cast<float>(sq.taper)};
      for (int i = 0; i < 500; ++i) {
        const Vec3d p{2 * unit(rng), 0.8 * unit(rng), 2 * unit(rng)};
        const auto f = static_cast<double>(paper_f(sq, untapered(sq, p)));
        if (std::abs(f - 1) < 1e-5) continue;
        ++count;
        inside += f < 1;
        EXPECT_EQ(inside_outside_radial(sq, p) < 1, f < 1);
        EXPECT_EQ(inside_outside_radial(narrow, cast<float>(p)) < 1, f < 1);
        EXPECT_EQ(norm(normal_at(sq, p)) > 0.999, true);
      }
      EXPECT_EQ(inside_outside_radial(sq, {}), 0);
      EXPECT_EQ(inside_outside_radial(sq, {0, 0, -4}), 2);
      EXPECT_TRUE(std::isfinite(inside_outside_radial(sq, {1e-300, 0, 1e-300})));
      EXPECT_TRUE(std::isnan(inside_outside_radial(sq, {std::nan(""), 0, 1})));
    }
  }
  EXPECT_GT(inside, count / 20);
  EXPECT_LT(inside, count * 9 / 10);
}

// By halves of chords on a fine grid: no formula of a derivative.
TEST(MaxTaper, IsWhereTheProfileCeasesToBeConcave) {
  constexpr int kSteps = 4000;
  for (const double e1 : {0.1, 0.2, 0.5, 1.0, 1.5, 1.9}) {
    const auto dent = [&](double taper) {
      const auto width = [&](int k) {
        const double w = static_cast<double>(k) / kSteps;
        return std::pow(std::max(0.0, 1 - std::pow(std::abs(w), 2 / e1)), e1 / 2) * (1 + taper * w);
      };
      double most = 0;
      for (int k = 1 - kSteps; k < kSteps; ++k)
        most = std::max(most, (width(k - 1) + width(k + 1)) / 2 - width(k));
      return most;
    };
    constexpr double kRounding = 1e-15;
    EXPECT_LT(dent(max_taper(e1)), kRounding) << e1;
    EXPECT_LT(dent(-max_taper(e1)), kRounding) << e1;
    EXPECT_GT(dent(1.01 * max_taper(e1)), kRounding) << e1;
  }
  EXPECT_EQ(max_taper(2), 0);
}

TEST(InsideOutside, StaysAccurateInFloatAtEveryScaleAndExponent) {
  std::mt19937_64 rng(2);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const double e1 : kExponents) {
    for (const double e2 : kExponents) {
      for (double scale = 1e-6; scale < 2e6; scale *= 10) {
        const Superquadric sq{{1, 0.5, 2}, e1, e2};
        const SuperquadricOf<float> narrow{{1, 0.5F, 2}, static_cast<float>(e1), static_cast<float>(e2)};
        const Vec3f p{static_cast<float>(scale * unit(rng)), static_cast<float>(scale * unit(rng)),
                      static_cast<float>(scale * unit(rng))};
        const auto expected = static_cast<double>(std::sqrt(paper_f(sq, cast<double>(p))));
        const float beta = inside_outside_radial(narrow, p);
        ASSERT_TRUE(std::isfinite(beta));
        EXPECT_NEAR(beta, expected, 1e-6 * expected) << "e1 " << e1 << " e2 " << e2 << " scale " << scale;
      }
    }
  }
}

TEST(InsideOutside, IsZeroAtTheCentreAndOneOnEverySemiAxis) {
  for (const double e1 : kExponents) {
    for (const double e2 : kExponents) {
      const Superquadric sq{{3, 0.5, 7}, e1, e2};
      EXPECT_EQ(inside_outside_radial(sq, {0, 0, 0}), 0);
      EXPECT_EQ(inside_outside_radial(sq, {-3, 0, 0}), 1);
      EXPECT_EQ(inside_outside_radial(sq, {0, 0.5, 0}), 1);
      EXPECT_EQ(inside_outside_radial(sq, {0, 0, -7}), 1);
    }
  }
}

template <class T>
class Poles : public testing::Test {};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Poles, Scalars);

TYPED_TEST(Poles, NormalsAreFiniteUnitAndOutwardAtEveryPoleAxisAndSeam) {
  using T = TypeParam;
  for (const double e1 : kExponents) {
    for (const double e2 : kExponents) {
      const SuperquadricOf<T> sq{{T(1), T(0.2), T(10)}, T(e1), T(e2)};
      for (const double eta : {-kPi / 2, 0.0, kPi / 2}) {
        for (const double omega : {-kPi, -kPi / 2, 0.0, kPi / 2, kPi}) {
          const auto u = superellipse_point<T>(std::cos(T(eta)), std::sin(T(eta)), T(e1));
          const auto v = superellipse_point<T>(std::cos(T(omega)), std::sin(T(omega)), T(e2));
          const Vec3<T> p = surface_point(sq, u, v), n = surface_normal(sq, u, v);
          EXPECT_NEAR(norm(n), 1, 1e-5);
          EXPECT_GT(dot(n, p), 0);
          EXPECT_EQ(std::signbit(p.z), eta < 0) << "a pole changed sides";
          EXPECT_NEAR(inside_outside_radial(sq, p), 1, 1e-5);
        }
      }
    }
  }
}

// The plane through a surface point across its normal supports the convex body: no other point lies beyond
// it.
TEST(SurfaceNormal, SupportsTheBody) {
  std::mt19937_64 rng(3);
  std::uniform_real_distribution<double> turn(-kPi, kPi);
  for (const double e1 : kExponents) {
    for (const double e2 : kExponents) {
      for (const double share : {0.0, -1.0, 0.6}) {
        const Superquadric sq = tapered({1, 0.4, 2}, e1, e2, share);
        const auto point = [&] {
          const double eta = turn(rng) / 2, omega = turn(rng);
          return std::pair{superellipse_point<double>(std::cos(eta), std::sin(eta), e1),
                           superellipse_point<double>(std::cos(omega), std::sin(omega), e2)};
        };
        for (int i = 0; i < 200; ++i) {
          const auto [u, v] = point();
          const auto [a, b] = point();
          const Vec3d n = surface_normal(sq, u, v);
          EXPECT_LE(dot(n, surface_point(sq, a, b) - surface_point(sq, u, v)), 1e-12);
        }
      }
    }
  }
}

TEST(NormalAt, IsTheGradientOfTheInsideOutsideFunction) {
  std::mt19937_64 rng(4);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (const double e1 : {0.3, 1.0, 1.9}) {
    for (const double e2 : {0.3, 1.0, 1.9}) {
      for (int i = 0; i < 150; ++i) {
        const Superquadric sq = tapered({1, 0.4, 2}, e1, e2, 0.9 * (i % 3 - 1));
        const Vec3d p{unit(rng), unit(rng), unit(rng)};
        constexpr double kStep = 1e-6;
        Vec3d gradient;
        for (int axis = 0; axis < 3; ++axis) {
          Vec3d step;
          step[axis] = kStep;
          gradient[axis] = inside_outside_radial(sq, p + step) - inside_outside_radial(sq, p - step);
        }
        EXPECT_NEAR(norm(normal_at(sq, p) - normalized(gradient)), 0, 1e-4);
      }
    }
  }
}

TEST(BoundingRadius, IsTheFarthestSurfacePoint) {
  for (const double e1 : kExponents) {
    for (const double e2 : kExponents) {
      for (const Vec3d axes : {Vec3d{1, 1, 1}, Vec3d{1, 0.3, 2}, Vec3d{5, 0.1, 0.4}}) {
        for (const double share : {0.0, 1.0, -0.6}) {
          const Superquadric sq = tapered(axes, e1, e2, share);
          const Vec3d half_m = half_extents_m(sq);
          double farthest = 0, widest = 0;
          for (int i = share == 0 ? 0 : -300; i <= 300; ++i) {
            for (int k = 0; k <= 300; ++k) {
              const double eta = i * kPi / 600, omega = k * kPi / 600;
              const Vec3d p = surface_point(sq, superellipse_point<double>(std::cos(eta), std::sin(eta), e1),
                                            superellipse_point<double>(std::cos(omega), std::sin(omega), e2));
              farthest = std::max(farthest, norm(p));
              widest = std::max({widest, p.x / half_m.x, p.y / half_m.y, std::abs(p.z) / half_m.z});
            }
          }
          EXPECT_GE(bounding_radius_m(sq), farthest * (1 - 1e-14));
          EXPECT_LE(bounding_radius_m(sq), farthest * (share == 0 ? 1 + 1e-3 : 1 + 5e-3));
          EXPECT_LE(widest, 1 + 1e-14);
        }
      }
    }
  }
}

/// Bent shapes: thin, thick, hardly and as far as they may, tapered too; in all directions.
std::vector<Superquadric> bent_shapes() {
  std::vector<Superquadric> shapes;
  for (const double e1 : {0.1, 0.4, 1.0, 2.0})
    for (const double direction : {0.0, 0.7, kPi / 2, 2.5, -1.2})
      for (const double turn : {0.002, 0.5, 2.0}) {
        Superquadric sq{{0.3, 0.2, 2}, e1, 0.7, turn == 0.5 ? 0.8 * max_taper(e1) : 0};
        const double k = turn / sq.semi_axes_m.z;
        sq.bend = {k * std::cos(direction), k * std::sin(direction)};
        shapes.push_back(sq);
        sq.semi_axes_m = {1, 1.5, 0.5};
        const double most = kMostBendReach / bend_reach(sq);
        sq.bend = {most * sq.bend.x, most * sq.bend.y};
        if (sq.bend.curvature() * sq.semi_axes_m.z <= kMostBendTurn) shapes.push_back(sq);
      }
  return shapes;
}

/// The bend as a turn in the complex plane, in long double: shares no line with bent().
Vec3d turned_over(const Superquadric& sq, const Vec3d& q) {
  using Real = long double;
  const Real k = std::hypot(Real(sq.bend.x), Real(sq.bend.y));
  const Real along_x = sq.bend.x / k, along_y = sq.bend.y / k, r = along_x * q.x + along_y * q.y;
  const std::complex<Real> place = (1 - k * r) * std::exp(std::complex<Real>(0, k * q.z));
  const Real lean = (1 - place.real()) / k - r;
  return {static_cast<double>(q.x + lean * along_x), static_cast<double>(q.y + lean * along_y),
          static_cast<double>(place.imag() / k)};
}

/// Surface points of eta by omega, straight and bent.
template <class Use>
void over_surface(const Superquadric& sq, int steps, const Use& use) {
  for (int row = -steps; row <= steps; ++row) {
    for (int col = 0; col < 4 * steps; ++col) {
      const double half_turn = kPi / 2 / steps;
      const auto eta = superellipse_point(std::cos(row * half_turn), std::sin(row * half_turn), sq.e1);
      const auto omega = superellipse_point(std::cos(col * half_turn), std::sin(col * half_turn), sq.e2);
      use(surface_point(straight(sq), eta, omega), surface_point(sq, eta, omega),
          surface_normal(sq, eta, omega));
    }
  }
}

TEST(Bend, TurnsWhatIsStraightAroundTheMiddleOfItsArcAndBack) {
  for (const Superquadric& sq : bent_shapes()) {
    over_surface(sq, 8, [&](const Vec3d& q, const Vec3d& p, const Vec3d&) {
      for (const double share : {1.0, 0.6, 0.0}) {
        const Vec3d inner = share * q, expected = turned_over(sq, inner);
        EXPECT_NEAR(norm(bent(sq.bend, inner) - expected), 0, 1e-12);
        EXPECT_NEAR(norm(straightened(sq.bend, expected) - inner), 0, 1e-12);
        EXPECT_NEAR(inside_outside_radial(sq, expected), share, 1e-9);
      }
      EXPECT_NEAR(norm(p - turned_over(sq, q)), 0, 1e-12);
    });
  }
}

// Every point has one place: none outside comes to lie inside by what is done beyond the reach of bends.
TEST(Bend, NoPointBeyondTheEndsIsInside) {
  std::mt19937_64 rng(12);
  std::uniform_real_distribution<double> unit(-1, 1);
  int inside = 0;
  for (const Superquadric& sq : bent_shapes()) {
    for (int i = 0; i < 2000; ++i) {
      const Vec3d p{4 * unit(rng), 4 * unit(rng), 4 * unit(rng)};
      const double beta = inside_outside_radial(sq, p);
      ASSERT_TRUE(std::isfinite(beta));
      EXPECT_NEAR(norm(normal_at(sq, p)), 1, 1e-9);
      if (beta > 1) continue;
      ++inside;
      // What is inside comes back by the other way, too.
      EXPECT_NEAR(norm(turned_over(sq, straightened(sq.bend, p)) - p), 0, 1e-11);
    }
    // The middle of the arc, and behind it.
    const double k = sq.bend.curvature();
    for (const double radii : {1.0, 1.5, 2.0, 3.0}) {
      const Vec3d p{radii * sq.bend.x / (k * k), radii * sq.bend.y / (k * k), 0};
      EXPECT_GT(inside_outside_radial(sq, p), 1);
      EXPECT_TRUE(std::isfinite(norm(normal_at(sq, p))));
    }
  }
  EXPECT_GT(inside, 1000);
}

TEST(Bend, NormalsAreThoseOfTheBentSurface) {
  for (const Superquadric& sq : bent_shapes()) {
    if (sq.e1 < 0.4 || sq.e1 > 1.9) continue;  // edges, and tips that have no normal
    int count = 0;
    over_surface(sq, 16, [&](const Vec3d&, const Vec3d& p, const Vec3d& n) {
      EXPECT_NEAR(norm(normal_at(sq, p) - n), 0, 1e-6);
      constexpr double kStep = 1e-5;
      Vec3d slope;
      double change = 0;
      for (int axis = 0; axis < 3; ++axis) {
        Vec3d above = p, below = p;
        above[axis] += kStep;
        below[axis] -= kStep;
        slope[axis] = inside_outside_radial(sq, above) - inside_outside_radial(sq, below);
        change += std::abs(inside_outside_radial(sq, above) + inside_outside_radial(sq, below) - 2);
      }
      if (change > 1e-3 * norm(slope)) return;
      ++count;
      EXPECT_GT(dot(normalized(slope), n), 1 - 1e-5);
    });
    EXPECT_GT(count, 300);
  }
}

TEST(Bend, SphereHoldsTheBodyAndIsTight) {
  for (const Superquadric& sq : bent_shapes()) {
    const BoundingSphere sphere = bounding_sphere(sq);
    double farthest = 0;
    over_surface(sq, 64, [&](const Vec3d&, const Vec3d& p, const Vec3d&) {
      farthest = std::max(farthest, norm(p - sphere.centre_m));
    });
    EXPECT_GE(sphere.radius_m, farthest);
    EXPECT_LE(sphere.radius_m, 1.35 * farthest);  // discs stand for thin cross-sections
    EXPECT_LE(bounding_sphere(sq, {{0.5, 0.5, -0.5, 0.5}, {1, 2, 3}}).radius_m, sphere.radius_m);
  }
  // A half ring: its ball is hardly larger than the ring.
  Superquadric ring{{0.1, 0.1, 3.1}, 1, 1};
  ring.bend = {0.6, 0};
  EXPECT_LT(bounding_sphere(ring).radius_m, 1.9);
}

TEST(Bend, LeavesTheVolume) {
  std::mt19937_64 rng(13);
  std::uniform_real_distribution<double> unit(-1, 1);
  Superquadric sq{{0.5, 0.3, 1.2}, 0.5, 0.8, 0.3};
  sq.bend = {0.9, 0.5};
  const BoundingSphere sphere = bounding_sphere(sq);
  constexpr int kPoints = 400000;
  int inside = 0;
  for (int i = 0; i < kPoints; ++i) {
    const Vec3d d{unit(rng), unit(rng), unit(rng)};
    inside += inside_outside_radial(sq, sphere.centre_m + sphere.radius_m * d) <= 1;
  }
  const double found = 8 * std::pow(sphere.radius_m, 3) * inside / kPoints;
  EXPECT_NEAR(found, volume_m3(sq), 0.01 * found);
}

}  // namespace
}  // namespace sqmap
