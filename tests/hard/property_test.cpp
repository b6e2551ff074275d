// SPDX-License-Identifier: Apache-2.0
// Claims over random points and paths, of the answers of every instruction set. Each says which branches its
// cases took, and fails where one was never taken.
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "sqmap/runtime/force.hpp"
#include "sqmap/runtime/object.hpp"

#include "hard/shells.hpp"
#include "support/branches.hpp"
#include "support/mixed_asset.hpp"

namespace sqmap::runtime {
namespace {

const bool kIsSeeded = test::seed_rapidcheck("seed=2007 max_success=1000");

using test::Branches;
using test::check;
using test::every_target_agrees;
using test::share;
using test::vector;

using Points = std::vector<Vec3f>;

Object built(const Asset& asset) { return std::move(Object::build(asset)).value(); }

TEST(Inside, IsWhereTheSignedDistanceIsNegativeOnEveryLayerAndLevel) {
  const Object object = built(test::mixed_asset());
  Branches branches;
  check([&] {
    const Vec3d p = Vec3d{1.2 * share(), 0.8 * share(), 0.4 + 1.2 * share()};
    const Layer layer = *rc::gen::element(Layer::kAuto, Layer::kTwo, Layer::kThree);
    const auto level = *rc::gen::inRange(0U, 4U);
    const Answer answer = object.query(cast<float>(p), {layer, level});
    RC_ASSERT(every_target_agrees(object, Points{cast<float>(p)}, {layer, level}));
    if (std::isnan(answer.signed_distance_m)) {
      branches.take(answer.part == kNowhere ? "nowhere" : "no distance");
      RC_ASSERT(answer.part != kNowhere || !answer.inside);
      if (layer == Layer::kThree || level == 0) RC_ASSERT(!answer.inside);
      return;
    }
    branches.take(answer.inside ? "inside" : "outside");
    branches.take("layer " + std::to_string(static_cast<int>(answer.layer)));
    if (answer.signed_distance_m != 0) RC_ASSERT(answer.inside == (answer.signed_distance_m < 0));
  });
  branches.expect({"nowhere", "inside", "outside", "layer 2", "layer 3"}, 50);
  branches.expect({"no distance"}, 1);
}

TEST(Layers, AFinerOneNeverFindsAPointInsideThatLayerOneFindsOutside) {
  const Object object = built(test::mixed_asset());
  Branches branches;
  check([&] {
    const Vec3f p = cast<float>(Vec3d{1.2 * share(), 0.8 * share(), 0.4 + 1.2 * share()});
    const bool conservative = object.query(p, {Layer::kOne}).inside;
    const bool two = object.query(p, {Layer::kTwo}).inside, three = object.query(p, {Layer::kThree}).inside;
    for (const Layer layer : {Layer::kOne, Layer::kTwo, Layer::kThree})
      RC_ASSERT(every_target_agrees(object, Points{p}, {layer}));
    branches.take(conservative ? two ? "in both" : "in the superquadric only" : "outside");
    RC_ASSERT(conservative || (!two && !three));
  });
  branches.expect({"in both", "in the superquadric only", "outside"}, 100);
}

/// Two sheets at constant depths below a superquadric: the field of layer 2 is a known function of the
/// distance to it, and its gradient is known by differences alone.
constexpr double kOuter = 0.2, kInner = 0.35;
Asset two_sheets() {
  Part part = test::traced_part({{1, 0.8, 0.9}, 0.9, 0.8}, {}, 33, 64, 1, 1,
                                [](const Vec3d&, const Vec3d&, bool& inside) {
                                  inside = false;
                                  return std::vector<double>{kOuter, kInner};
                                });
  return test::asset_of({part}, 2);
}

TEST(Gradient, OfTheFieldOfLayerTwoIsItsNormalAtEveryBranch) {
  const Object object = built(two_sheets());
  Branches branches;
  check([&] {
    const Vec3d d = vector();
    RC_PRE(norm(d) > 0.1);
    // By the radial distance, which moves through the gap, the material and the hollow.
    const Superquadric shape{{1, 0.8, 0.9}, 0.9, 0.8};
    const Vec3d p = ((0.55 + 0.44 * std::abs(share())) / inside_outside_radial(shape, d)) * d;
    const Answer here = object.query(cast<float>(p), {Layer::kTwo});
    RC_PRE(std::isfinite(here.signed_distance_m));
    constexpr double kStep_m = 2e-3;
    const Vec3d along = normalized(vector() + Vec3d{1e-3, 0, 0});
    const float ahead = object.query(cast<float>(p + kStep_m * along), {Layer::kTwo}).signed_distance_m,
                behind = object.query(cast<float>(p - kStep_m * along), {Layer::kTwo}).signed_distance_m;
    RC_ASSERT(every_target_agrees(
        object, Points{cast<float>(p), cast<float>(p + kStep_m * along), cast<float>(p - kStep_m * along)},
        {Layer::kTwo}));
    RC_PRE(std::isfinite(ahead) && std::isfinite(behind));
    // Where the three do not look at the same sheet there is a ridge, the medial axis between the two.
    const double bend = std::abs(double(ahead) - 2.0 * here.signed_distance_m + behind);
    if (bend > 0.3 * kStep_m) {
      branches.take("ridge");
      return;
    }
    const double slope = (double(ahead) - behind) / (2 * kStep_m);
    const bool is_inner = dot(cast<double>(here.normal), d) < 0;
    branches.take(std::string(is_inner ? "inner" : "outer") +
                  (here.inside ? ", in the material" : ", out of it"));
    RC_ASSERT(std::abs(slope - dot(cast<double>(here.normal), along)) < 0.08);
  });
  branches.expect(
      {"outer, out of it", "outer, in the material", "inner, in the material", "inner, out of it"}, 40);
  branches.expect({"ridge"}, 1);
}

constexpr double kRadius = 0.8;
const Vec3d kCentre{0.1, -0.05, 0.2};  // of the ball in test::ball_in_ellipsoid

TEST(ThirdLayer, GoingByTheDistanceAgainstTheNormalLeadsToTheSurface) {
  const Object object = built(test::ball_in_ellipsoid(kRadius, 65, 128));
  Branches branches;
  check([&] {
    const Vec3d d = vector();
    RC_PRE(norm(d) > 0.1);
    const Vec3d p = kCentre + (kRadius + (share() < 0 ? -0.15 : 0.12) * std::abs(share())) * normalized(d);
    const Answer answer = object.query(cast<float>(p), {Layer::kThree});
    RC_PRE(std::isfinite(answer.signed_distance_m));
    branches.take(answer.inside ? "inside" : "outside");
    const Vec3d foot = p - double{answer.signed_distance_m} * cast<double>(answer.normal);
    // Normals are those of facets, off by up to 0.05 rad here: to first order the foot slides along the
    // surface.
    const double slide_m = 0.06 * std::abs(double{answer.signed_distance_m});
    RC_ASSERT(std::abs(norm(foot - kCentre) - kRadius) < 1e-3 + slide_m * slide_m / kRadius + 0.06 * slide_m);
    RC_ASSERT(norm(foot - cast<double>(answer.surface_m)) < 1e-3 + slide_m);
    RC_ASSERT(std::abs(object.query(cast<float>(foot), {Layer::kThree}).signed_distance_m) < 2e-3);
    RC_ASSERT(every_target_agrees(object, Points{cast<float>(p), cast<float>(foot)}, {Layer::kThree}));
  });
  branches.expect({"inside", "outside"}, 200);
}

TEST(Force, AlongAPathOverABallChangesNoFasterThanItsStiffnessAllows) {
  const Object object = built(test::ball_in_ellipsoid(kRadius, 65, 128));
  Branches branches;
  constexpr float kStiffness = 500;
  constexpr double kStep_m = 1e-3;
  check([&] {
    Vec3d p = kCentre + (kRadius - 0.015 + 0.02 * share()) * normalized(vector() + Vec3d{0, 0, 0.01});
    Vec3f before = reaction_force(object.query(cast<float>(p), {Layer::kThree}), kStiffness);
    const Vec3d along = normalized(vector() + Vec3d{0.01, 0, 0});
    Points path{cast<float>(p)};
    for (int k = 0; k < 40; ++k) {
      p = p + kStep_m * normalized(along + 0.5 * Vec3d{std::sin(k), std::cos(2.0 * k), std::sin(3.0 * k)});
      if (norm(p - kCentre) < 0.5) break;  // towards the centre directions change at once
      path.push_back(cast<float>(p));
      const Vec3f now = reaction_force(object.query(cast<float>(p), {Layer::kThree}), kStiffness);
      branches.take(norm(now) > 0      ? norm(before) > 0 ? "in contact" : "enters"
                    : norm(before) > 0 ? "leaves"
                                       : "free");
      // The spring itself, the map's error, and a turn of the normal from facet to facet at the depth there.
      const float depth = norm(before) / kStiffness;
      RC_ASSERT(norm(now - before) <=
                kStiffness * (1.1F * static_cast<float>(kStep_m) + 1e-3F + 0.06F * depth));
      before = now;
    }
    RC_ASSERT(every_target_agrees(object, path, {Layer::kThree}));
  });
  branches.expect({"in contact", "enters", "leaves", "free"}, 20);
}

TEST(Energy, ClosedLoopsUnderTheSurfaceOfABallReturnWhatTheyTook) {
  const Object object = built(test::ball_in_ellipsoid(kRadius, 65, 128));
  constexpr float kStiffness = 500;
  double net_j = 0, passed_j = 0;
  int loops = 0;
  check([&] {
    // A circle of random place and plane in the shell 0.5 .. 0.9: partly in contact, partly free.
    const Vec3d d = vector();
    RC_PRE(norm(d) > 0.1);
    const double radius_m = 0.05 + 0.1 * std::abs(share());
    const Vec3d middle = kCentre + (kRadius - 0.05 - 0.05 * std::abs(share())) * normalized(d);
    const Vec3d u = normalized(cross(d, vector() + Vec3d{0, 0.02, 0.01})),
                v = normalized(cross(u, vector() + Vec3d{0.02, 0, 0.01}));
    RC_PRE(norm(u) > 0.5 && norm(v) > 0.5);
    double work_j = 0, turned_j = 0;
    constexpr int kSteps = 400;
    Points loop;
    for (int k = 0; k < kSteps; ++k) {
      const auto at = [&](double step) {
        const double turn = step * 2 * 3.14159265358979 / kSteps;
        return middle + radius_m * (std::cos(turn) * u + std::sin(turn) * v);
      };
      const Vec3d way = at(k + 1) - at(k);
      loop.push_back(cast<float>(at(k + 0.5)));
      const Vec3f force = reaction_force(object.query(loop.back(), {Layer::kThree}), kStiffness);
      work_j += dot(cast<double>(force), way);
      turned_j += std::abs(dot(cast<double>(force), way));
    }
    net_j += work_j;
    passed_j += turned_j;
    RC_ASSERT(every_target_agrees(object, loop, {Layer::kThree}));
    ++loops;
    // Facets of the map tilt the force by up to 0.05 rad, to both sides.
    RC_ASSERT(std::abs(work_j) <= 0.03 * turned_j + 2e-4);
  });
  EXPECT_GT(loops, 900);
  EXPECT_GT(passed_j, 100 * std::abs(net_j)) << "over all loops, gains and losses cancel";
}

}  // namespace
}  // namespace sqmap::runtime
