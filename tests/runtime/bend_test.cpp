// SPDX-License-Identifier: Apache-2.0
//
// Queries of bent parts, whose maps are of solids with distances that are known.
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "sqmap/runtime/object.hpp"

#include "part_bend.hpp"
#include "support/analytic_asset.hpp"

namespace sqmap::runtime {
namespace {

/// A ball at some place of a part.
struct Held {
  Superquadric shape;
  Vec3d centre_m;
  double radius_m;

  Asset asset() const {
    constexpr double kReach_m = 1.2;
    const auto holds = [this](const Vec3d& p) { return norm(p - centre_m) < radius_m; };
    return test::asset_of({test::traced_part(shape, {}, 129, 256, 1, kReach_m,
                                             [&](const Vec3d& o, const Vec3d& d, bool& inside) {
                                               return test::bent_crossings_m(shape, holds, o, d, kReach_m,
                                                                             inside);
                                             })},
                          3);
  }
};

Superquadric bent_shape(double bend_x, double bend_y, double taper) {
  Superquadric shape{{0.5, 0.6, 1.3}, 0.8, 0.9, taper};
  shape.bend = {bend_x, bend_y};
  return shape;
}

const Held kHeld[] = {{bent_shape(0.9, 0.3, 0), {0.05, -0.02, 0.1}, 0.35},
                      {bent_shape(-0.5, 0.4, 0.25), {-0.25, 0.18, 0.8}, 0.3},
                      {bent_shape(0, -1.1, -0.2), {0, -0.1, -0.5}, 0.3}};

std::vector<Vec3f> points_in(const Superquadric& shape, std::size_t count) {
  const BoundingSphere sphere = bounding_sphere(shape);
  std::mt19937_64 rng(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<Vec3f> points;
  while (points.size() < count) {
    const Vec3d p = sphere.centre_m + sphere.radius_m * Vec3d{unit(rng), unit(rng), unit(rng)};
    if (inside_outside_radial(shape, p) < 0.999) points.push_back(cast<float>(p));
  }
  return points;
}

TEST(BentPart, LayerOneIsTheBentSuperquadric) {
  for (const Held& held : kHeld) {
    const Asset asset = held.asset();
    const Object object = std::move(Object::build(asset)).value();
    std::mt19937_64 rng(6);
    std::uniform_real_distribution<double> unit(-1, 1);
    int inside = 0;
    for (int i = 0; i < 20000; ++i) {
      const Vec3f p = cast<float>(Vec3d{2 * unit(rng), 2 * unit(rng), 2 * unit(rng)});
      const double beta = inside_outside_radial(held.shape, cast<double>(p));
      if (std::abs(beta - 1) < 1e-5) continue;
      const Answer answer = object.query(p, {Layer::kOne});
      ASSERT_EQ(answer.inside, beta < 1) << beta;
      if (beta > 1) continue;
      ++inside;
      // That of a tapered one is of another family of shapes (shape_normal).
      if (held.shape.taper != 0) continue;
      EXPECT_LT(norm(cast<double>(answer.normal) - normal_at(held.shape, cast<double>(p))), 5e-5);
    }
    EXPECT_GT(inside, 500);
  }
}

TEST(BentPart, TellsTheDistanceFromWhatItsMapHolds) {
  for (const Held& held : kHeld) {
    const Object object = std::move(Object::build(held.asset())).value();
    double sum_m = 0, sum_turn = 0;
    int known = 0, inside = 0, wrong = 0, off = 0, lost = 0;
    for (const Vec3f& p : points_in(held.shape, 12000)) {
      const Vec3d from_centre_m = cast<double>(p) - held.centre_m;
      const double truth_m = norm(from_centre_m) - held.radius_m;
      if (std::abs(truth_m) > 0.06) continue;  // farther off rays of the feet graze the ball or pass by
      const Answer answer = object.query(p, {Layer::kThree});
      if (std::isnan(answer.signed_distance_m)) {  // the ray of the foot passes by
        lost += truth_m < 0;
        continue;
      }
      ++known;
      inside += truth_m < 0;
      sum_m += std::abs(double{answer.signed_distance_m} - truth_m);
      wrong += std::abs(truth_m) > 1e-3 && answer.inside != (truth_m < 0);
      sum_turn += dot(cast<double>(answer.normal), normalized(from_centre_m));
      off += std::abs(norm(cast<double>(answer.surface_m) - held.centre_m) - held.radius_m) > 1e-3;
    }
    EXPECT_GT(known, 500);
    EXPECT_GT(inside, 100);
    // The rest lies where rays only graze the ball.
    EXPECT_LE(lost, known / 100);
    EXPECT_LT(sum_m / known, 8e-4);
    EXPECT_LE(wrong, known / 100);
    EXPECT_LE(off, known / 50);
    EXPECT_GT(sum_turn / known, 0.98);
  }
}

TEST(BentPart, LayerTwoTellsTheSide) {
  for (const Held& held : kHeld) {
    const Object object = std::move(Object::build(held.asset())).value();
    int wrong = 0, count = 0;
    for (const Vec3f& p : points_in(held.shape, 4000)) {
      const double truth_m = norm(cast<double>(p) - held.centre_m) - held.radius_m;
      if (std::abs(truth_m) < 2e-3) continue;
      ++count;
      wrong += object.query(p, {Layer::kTwo}).inside != (truth_m < 0);
    }
    EXPECT_LT(wrong, count / 200);
  }
}

// The float functions of queries against those in double.
TEST(BentPart, FloatFollowsDouble) {
  std::mt19937_64 rng(7);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (const double turn : {1e-3, 0.1, 1.0, 2.0}) {
    for (const double scale : {1e-3, 1.0, 1e3}) {
      Superquadric shape{scale * Vec3d{0.2, 0.1, 1}, 1, 1};
      const double direction = 3 * unit(rng), k = turn / shape.semi_axes_m.z;
      shape.bend = {k * std::cos(direction), k * std::sin(direction)};
      const PartBend bend = PartBend::of(shape, 1);
      for (int i = 0; i < 2000; ++i) {
        const Vec3d q = scale * Vec3d{0.2 * unit(rng), 0.1 * unit(rng), unit(rng)};
        const Vec3d p = bent(shape.bend, q);
        const PartBend::Turn at = bend.turn_at(cast<float>(q));
        EXPECT_LT(norm(cast<double>(bend.point(at, cast<float>(q))) - p), 2e-6 * scale);
        EXPECT_LT(norm(cast<double>(bend.straightened(cast<float>(p))) - q), 2e-6 * scale);
        const Vec3d g{unit(rng), unit(rng), unit(rng)};
        const Vec3d turned_g = turned(shape.bend, q, g);
        EXPECT_LT(norm(cast<double>(bend.gradient(at, cast<float>(g))) - turned_g), 3e-6 * norm(turned_g));
        // A step against differences.
        constexpr double kStep = 1e-5;
        const Vec3d way = (1 / (2 * kStep * scale)) *
                          (bent(shape.bend, q + kStep * scale * g) - bent(shape.bend, q - kStep * scale * g));
        EXPECT_LT(norm(cast<double>(bend.step(at, cast<float>(g))) - way), 1e-5);
        EXPECT_NEAR(dot(turned_g, way), dot(g, g), 1e-7) << "a gradient and a step keep their product";
      }
    }
  }
}

}  // namespace
}  // namespace sqmap::runtime
