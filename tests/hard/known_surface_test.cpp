// SPDX-License-Identifier: Apache-2.0
// Properties of the third layer, on every instruction set, where the surface is known exactly: balls that
// meet, and a box.
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "sqmap/runtime/force.hpp"
#include "sqmap/runtime/instance.hpp"
#include "sqmap/runtime/object.hpp"

#include "hard/shells.hpp"
#include "runtime/touch_shapes.hpp"
#include "support/branches.hpp"
#include "support/mixed_asset.hpp"
#include "support/union_of_balls.hpp"

namespace sqmap::runtime {
namespace {

const bool kIsSeeded = test::seed_rapidcheck("seed=2007 max_success=2000");

using test::Branches;
using test::check;
using test::every_target_agrees;
using test::Nearest;
using test::share;
using test::vector;

const std::vector<test::Ball> kTwoBalls{{{-0.5, 0, 0}, 0.8}, {{0.5, 0.1, 0}, 0.7}};
const Vec3d kHalf{0.5, 0.4, 0.3};

/// An object whose surface is known.
struct Known {
  Object object;
  Nearest (*nearest)(const Vec3d&);
  Vec3d (*crease)();  ///< a random point of its edges or seams
  Vec3d reach_m;
};
const Known& two_balls() {
  static const Known kKnown{std::move(Object::build(test::two_balls(kTwoBalls, 65, 128))).value(),
                            [](const Vec3d& p) { return test::nearest_of_union(kTwoBalls, p); },
                            [] {
                              // Of a point far off the axis, inside the groove, the seam is the nearest.
                              const double turn = 3.14159265358979 * share();
                              const Vec3d off{0, 0.3 * std::cos(turn), 0.3 * std::sin(turn)};
                              return test::nearest_of_union(kTwoBalls, Vec3d{0.07, 0.05, 0} + off).point_m;
                            },
                            {1.35, 0.85, 0.85}};
  return kKnown;
}
const Known& box() {
  static const Known kKnown{std::move(Object::build(test::box_asset(kHalf))).value(),
                            [](const Vec3d& p) { return test::nearest_of_box(kHalf, p); },
                            [] {
                              const int along = *rc::gen::inRange(0, 3);
                              Vec3d p = vector();
                              for (int axis = 0; axis < 3; ++axis)
                                p[axis] = axis == along ? p[axis] * kHalf[axis]
                                                        : std::copysign(kHalf[axis], p[axis]);
                              return p;
                            },
                            {0.56, 0.45, 0.34}};
  return kKnown;
}
const Known& mixed() {
  static const Known kKnown{std::move(Object::build(test::mixed_asset())).value(),
                            [](const Vec3d& p) { return test::nearest_of_union(test::mixed_balls(), p); },
                            nullptr,
                            {0.9, 0.5, 1.4}};
  return kKnown;
}

Vec3d somewhere(const Known& known) {
  const Vec3d v = vector();
  return {known.reach_m.x * v.x, known.reach_m.y * v.y, known.reach_m.z * v.z};
}

struct FootLimits {
  double flat_m;      ///< off the surface, but for `flat_share` of the flat places
  double flat_share;  ///< of feet beside a crease that another chart answered
  double crease_m;    ///< error of the distance to a crease
  double surface_m;   ///< of surface_m off the surface
  double astray;      ///< share of the places nearest to a crease whose normal is not the way from it
};

/// p - d n lies on the surface where that is smooth. Nearest to a crease the normal is that of one of its
/// sides, so p - d n is off by up to |d|; there surface_m is claimed instead, and the distance.
void feet_lie_on(const Known& known, const FootLimits& limits, const std::vector<std::string>& classes) {
  Branches branches;
  check([&] {
    const bool by_crease = *rc::gen::arbitrary<bool>();
    const Vec3d p = by_crease ? known.crease() + 0.08 * vector() : somewhere(known);
    const Nearest exact = known.nearest(p);
    RC_PRE(std::abs(exact.signed_distance_m) < 0.12);
    const Answer answer = known.object.query(cast<float>(p), {Layer::kThree});
    RC_ASSERT(every_target_agrees(known.object, std::vector<Vec3f>{cast<float>(p)}, {Layer::kThree}));
    if (!std::isfinite(answer.signed_distance_m)) {
      RC_ASSERT(exact.signed_distance_m > -5e-3);  // inside there is always a distance
      return branches.take("no distance");
    }
    const auto d = static_cast<double>(answer.signed_distance_m);
    const std::string side = exact.signed_distance_m < 0 ? ", inside" : ", outside";
    if (std::abs(known.nearest(cast<double>(answer.surface_m)).signed_distance_m) > limits.surface_m)
      branches.take("surface_m off");
    const double off_m = std::abs(known.nearest(p - d * cast<double>(answer.normal)).signed_distance_m);
    if (exact.is_crease) {
      branches.take("crease" + side);
      RC_ASSERT(off_m <= std::abs(d) + limits.surface_m);
      if (std::abs(d - exact.signed_distance_m) > limits.crease_m) branches.take("crease, wrong distance");
      // Beside an edge the distance grows away from it, not as beside one of its sides.
      const Vec3d away = normalized((exact.signed_distance_m < 0 ? -1.0 : 1.0) * (p - exact.point_m));
      if (std::abs(exact.signed_distance_m) > 0.02) {
        branches.take("crease, away");
        if (norm(cast<double>(answer.normal) - away) > 0.25) branches.take("crease, not along the distance");
      }
      return;
    }
    branches.take("flat");
    branches.take("flat" + side);
    if (off_m > limits.flat_m) branches.take("flat, off");
  });
  branches.expect(classes, 50);
  const int all =
      branches.count("flat") + branches.count("crease, inside") + branches.count("crease, outside");
  branches.expect_at_most("flat, off", static_cast<int>(limits.flat_share * branches.count("flat")));
  branches.expect_at_most("crease, wrong distance",
                          (branches.count("crease, inside") + branches.count("crease, outside")) / 50);
  branches.expect_at_most("crease, not along the distance",
                          static_cast<int>(limits.astray * branches.count("crease, away")));
  branches.expect_at_most("surface_m off", all * 3 / 100);
  for (const char* name :
       {"flat", "flat, off", "crease, wrong distance", "surface_m off", "no distance", "crease, inside",
        "crease, outside", "crease, away", "crease, not along the distance"})
    testing::Test::RecordProperty(name, branches.count(name));
}

TEST(Foot, OfTwoBallsLiesOnTheSurfaceButAtTheSeam) {
  feet_lie_on(two_balls(), {2e-3, 0.08, 0.04, 2e-3, 0.7},
              {"flat, inside", "flat, outside", "crease, inside"});
}
TEST(Foot, OfABoxLiesOnTheSurfaceButAtEdges) {
  feet_lie_on(box(), {2e-3, 0.01, 5e-3, 3e-3, 0.15}, {"flat, inside", "flat, outside", "crease, outside"});
}

/// Deep inside, where surfaces on several sides are nearly as near, the distance is that of the nearest but
/// for few places, from which the search started on another side.
void depths_are_the_least(const Known& known, double off_share) {
  Branches branches;
  check([&] {
    const Vec3d p = somewhere(known);
    const Nearest exact = known.nearest(p);
    RC_PRE(exact.signed_distance_m < -0.05);
    const Answer answer = known.object.query(cast<float>(p), {Layer::kThree});
    RC_ASSERT(every_target_agrees(known.object, std::vector<Vec3f>{cast<float>(p)}, {Layer::kThree}));
    branches.take("deep");
    if (!(std::abs(static_cast<double>(answer.signed_distance_m) - exact.signed_distance_m) < 0.02))
      branches.take("off");
  });
  branches.expect({"deep"}, 1900);
  branches.expect_at_most("off", static_cast<int>(off_share * branches.count("deep")));
  testing::Test::RecordProperty("off", branches.count("off"));
}

TEST(Depth, OfTwoBallsIsTheLeast) { depths_are_the_least(two_balls(), 0.004); }
TEST(Depth, OfABoxIsTheLeastButForFewPlaces) { depths_are_the_least(box(), 0.015); }

/// Whether the answered normal is the way from surface_m or back: on the rims of charts and very near the
/// surface it is a facet's.
bool is_gradient(const Answer& answer, const Vec3d& p) {
  const Vec3d way = p - cast<double>(answer.surface_m);
  const double depth_m = norm(way);
  const Vec3d out = (answer.inside ? -1.0 : 1.0) * way;
  return norm(depth_m * cast<double>(answer.normal) - out) < 0.05 * depth_m + 2e-4;
}

struct ForceLimits {
  double place, normal;  ///< jumps at a new place and at a normal that is no gradient, as shares of the steps
  double nothing;        ///< jumps that no answer tells
};

/// Between two places, the force on a spring of 1 N/m changes by no more than the step, the map's error and
/// a tenth of itself, but where the answers tell of another part, side or place of the surface, or that a
/// normal is not the gradient of the distance.
void force_changes_slowly(const Known& known, const ForceLimits& limits) {
  Branches branches;
  constexpr double kStep_m = 1e-3, kMapError_m = 1e-3, kTurn = 0.1, kSamePlace_m = 2 * kStep_m;
  check([&] {
    Vec3d p = somewhere(known);
    const Nearest start = known.nearest(p);
    p = start.point_m + (0.03 * share()) * normalized(p - start.point_m);
    const Vec3d along = normalized(vector() + Vec3d{0.01, 0, 0});
    Answer before = known.object.query(cast<float>(p), {Layer::kThree});
    std::vector<Vec3f> path{cast<float>(p)};
    for (int k = 0; k < 40; ++k) {
      const Vec3d p_before = p;
      p = p + kStep_m * normalized(along + 0.5 * Vec3d{std::sin(k), std::cos(2.0 * k), std::sin(3.0 * k)});
      path.push_back(cast<float>(p));
      const Answer now = known.object.query(path.back(), {Layer::kThree});
      const Vec3f force_before = reaction_force(before, 1), force = reaction_force(now, 1);
      const auto change = static_cast<double>(norm(force - force_before));
      const auto depth_m = static_cast<double>(std::max(norm(force), norm(force_before)));
      branches.take(!(depth_m > 0)            ? "free"
                    : norm(force_before) == 0 ? "enters"
                    : norm(force) == 0        ? "leaves"
                                              : "in contact");
      const char* told = now.part != before.part       ? "part"
                         : now.inside != before.inside ? "side"
                         : static_cast<double>(norm(now.surface_m - before.surface_m)) > kSamePlace_m
                             ? "place"
                         : !is_gradient(before, p_before) || !is_gradient(now, p) ? "normal"
                                                                                  : "nothing";
      branches.take(std::string("new: ") + told);
      if (change > 1.1 * kStep_m + kMapError_m + kTurn * depth_m)
        branches.take(std::string("jump, new: ") + told);
      before = now;
    }
    RC_ASSERT(every_target_agrees(known.object, path, {Layer::kThree}));
  });
  branches.expect({"in contact", "enters", "leaves", "free"}, 200);
  branches.expect({"new: part", "new: place", "new: side", "new: normal"}, 10);
  branches.expect({"jump, new: place"}, 5);
  const int steps = branches.count("in contact") + branches.count("enters") + branches.count("leaves");
  branches.expect_at_most("jump, new: nothing", static_cast<int>(limits.nothing * steps));
  branches.expect_at_most("jump, new: place", static_cast<int>(limits.place * steps));
  branches.expect_at_most("jump, new: normal", static_cast<int>(limits.normal * steps));
  branches.expect_at_most("jump, new: part", branches.count("new: part") / 2);
  branches.expect_at_most("jump, new: side", branches.count("new: side") / 8);
  branches.expect_at_most("new: normal", branches.count("new: nothing") / 10);
  for (const char* told : {"part", "side", "place", "normal", "nothing"})
    for (const char* name : {"new: ", "jump, new: "})
      testing::Test::RecordProperty(std::string(name) + told, branches.count(std::string(name) + told));
  testing::Test::RecordProperty("in contact", branches.count("in contact"));
}

TEST(Force, OverTwoBallsJumpsOnlyWhereTheAnswersSaySo) {
  force_changes_slowly(two_balls(), {.place = 0.001, .normal = 0.0015, .nothing = 0});
}
TEST(Force, OverABoxJumpsOnlyWhereTheAnswersSaySo) {
  force_changes_slowly(box(), {.place = 0.003, .normal = 0.0001, .nothing = 0});
}
// Its vertex samples are random, so its facets do not meet.
TEST(Force, OverAMixedAssetJumpsSeldomButWhereTheAnswersSaySo) {
  force_changes_slowly(mixed(), {.place = 0.012, .normal = 0.005, .nothing = 1e-4});
}

/// Rotation about a unit axis (Rodrigues), then the frame: shares nothing with the quaternions of the code.
struct Motion {
  Vec3d axis;
  double angle, scale;
  bool mirrored;
  Vec3d translation_m;
  Vec3d turned(Vec3d v) const {
    if (mirrored) v.x = -v.x;
    return std::cos(angle) * v + std::sin(angle) * cross(axis, v) +
           (1 - std::cos(angle)) * dot(axis, v) * axis;
  }
  Vec3d moved(const Vec3d& p) const { return scale * turned(p) + translation_m; }
  Placement placement() const {
    const double s = std::sin(angle / 2);
    return {{{std::cos(angle / 2), s * axis.x, s * axis.y, s * axis.z}, translation_m}, scale, mirrored};
  }
};

TEST(Placed, AnswersOfAMixedAssetTurnMoveScaleAndMirrorWithIt) {
  constexpr double kRest = 2e-3;  // layer 3 stops when a step is below a thirtieth of a cell; a place, in m
  Branches branches;
  check([&] {
    const Vec3d axis = vector();
    RC_PRE(norm(axis) > 0.1);
    const double scale = std::pow(10.0, 3 * share());
    const Motion motion{normalized(axis), 3.1 * share(), scale, *rc::gen::arbitrary<bool>(),
                        (5 * scale) * vector()};
    const Instance instance = Instance::place(mixed().object, motion.placement()).value();
    const Vec3d p = somewhere(mixed());
    const Answer object = mixed().object.query(cast<float>(p), {Layer::kThree}),
                 world = instance.query(cast<float>(motion.moved(p)), {Layer::kThree});
    RC_ASSERT(
        every_target_agrees(instance, std::vector<Vec3f>{cast<float>(motion.moved(p))}, {Layer::kThree}));
    // What a float of the world may be off by, in the object; where so small a step changes the answer, the
    // two may differ.
    const double step_m = 4e-7 * (norm(motion.translation_m) / scale + 4);
    for (int i = 0; i < 6; ++i) {
      Vec3d q = p;
      q[i / 2] += (i % 2 == 0 ? 2 : -2) * step_m;
      const Answer beside = mixed().object.query(cast<float>(q), {Layer::kThree});
      if (beside.part != object.part || beside.inside != object.inside ||
          !(norm(beside.surface_m - object.surface_m) < 1e-3F))
        return branches.take("beside a jump");
    }
    branches.take("all");
    RC_ASSERT(world.part == object.part);
    RC_ASSERT(world.inside == object.inside);
    RC_ASSERT(world.layer == object.layer);
    RC_ASSERT(std::isnan(world.signed_distance_m) == std::isnan(object.signed_distance_m));
    if (std::isnan(object.signed_distance_m)) return branches.take("no distance");
    branches.take(motion.mirrored, "mirrored", "not mirrored");
    branches.take(object.inside, "inside", "outside");
    if (scale < 0.1) branches.take("scale < 0.1");
    if (scale > 10) branches.take("scale > 10");
    const auto d = static_cast<double>(object.signed_distance_m);
    RC_ASSERT(std::abs(static_cast<double>(world.signed_distance_m) / scale - d) < 1e-6 + step_m);
    RC_ASSERT(norm(cast<double>(world.surface_m) - motion.moved(cast<double>(object.surface_m))) / scale <
              kRest);
    // The facets of a fan or of neighbouring cells meet where the place is the same.
    if (norm(cast<double>(world.normal) - motion.turned(cast<double>(object.normal))) > 2 * kRest)
      branches.take("another facet");
  });
  branches.expect({"mirrored", "not mirrored", "inside", "outside", "scale < 0.1", "scale > 10"}, 100);
  branches.expect_at_most("beside a jump", branches.count("all") / 50);
  branches.expect_at_most("another facet", (branches.count("inside") + branches.count("outside")) / 50);
  RecordProperty("beside_a_jump", branches.count("beside a jump"));
  RecordProperty("another_facet", branches.count("another facet"));
}

}  // namespace
}  // namespace sqmap::runtime
