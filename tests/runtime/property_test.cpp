// SPDX-License-Identifier: Apache-2.0
// Claims over random placements, batches and paths; a failure is shrunk to a small case by RapidCheck. Each
// says which branches its cases took, and fails where one was hardly taken.
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "sqmap/runtime/contacts.hpp"
#include "sqmap/runtime/instance.hpp"
#include "sqmap/runtime/sweep.hpp"

#include "support/analytic_asset.hpp"
#include "support/branches.hpp"
#include "support/targets.hpp"

namespace sqmap::runtime {
namespace {

const bool kIsSeeded = test::seed_rapidcheck("seed=2007 max_success=300");

using test::Branches;
using test::check;
using test::share;
using test::vector;

constexpr double kRadius = 0.8;
const Vec3d kCentre{0.1, -0.05, 0.2};  // of the ball in test::ball_in_ellipsoid

struct Ball {
  Asset asset = test::ball_in_ellipsoid(kRadius, 33, 64);
  Object object = std::move(Object::build(asset)).value();
  Sweeper sweeper = std::move(Sweeper::build(asset)).value();
};
const Ball& ball() {
  static const Ball kBall;
  return kBall;
}

Placement placement() {
  Placement placement;
  const Vec3d axis = vector();
  placement.world_from_object = {{1, 3 * axis.x, 3 * axis.y, 3 * axis.z}, 100.0 * vector()};
  placement.scale = std::pow(10.0, 3 * share());
  placement.mirrored = *rc::gen::arbitrary<bool>();
  return placement;
}

Instance placed(const Placement& placement) { return Instance::place(ball().object, placement).value(); }

// Floats of the world are so far apart: what a point on its way there and back may be off by.
double float_step_m(const Instance& instance) {
  const Vec3d& t_m = instance.translation_m();
  return 4e-7 *
         (std::abs(t_m.x) + std::abs(t_m.y) + std::abs(t_m.z) + 4 * static_cast<double>(instance.scale()));
}

/// Of a placement; every property that places the ball gates on these.
void take_placement(Branches& branches, const Placement& placement) {
  branches.take(placement.mirrored, "mirrored", "not mirrored");
  if (placement.scale < 0.1) branches.take("scale < 0.1");
  if (placement.scale > 10) branches.take("scale > 10");
}
const std::vector<std::string> kPlacements{"mirrored", "not mirrored", "scale < 0.1", "scale > 10"};

TEST(InstanceProperty, AnswersTurnMoveScaleAndMirrorWithTheObject) {
  Branches branches;
  check([&] {
    const Placement where = placement();
    const Instance instance = placed(where);
    const Vec3f p = cast<float>(kCentre + 0.9 * vector());
    RC_PRE(norm(cast<double>(p) - kCentre) > 0.3);  // at the centre every direction is nearest
    // On the rim of the superquadric the two may fall on different sides.
    const double beta = inside_outside_radial(ball().asset.parts[0].shape, cast<double>(p));
    const double scale = static_cast<double>(instance.scale()), step_m = float_step_m(instance);
    RC_PRE(std::abs(beta - 1) > 1e-5 + 2 * step_m / scale);
    take_placement(branches, where);
    const QueryOptions options{Layer::kThree};
    const Answer world = instance.query(instance.to_world(p), options),
                 object = ball().object.query(p, options);
    RC_ASSERT(test::every_target_agrees(instance, std::vector<Vec3f>{instance.to_world(p)}, options));
    RC_ASSERT((world.part == kNowhere) == (beta > 1));
    RC_ASSERT((object.part == kNowhere) == (beta > 1));
    RC_ASSERT(std::isnan(world.signed_distance_m) == (beta > 1));
    RC_ASSERT(std::isnan(object.signed_distance_m) == (beta > 1));
    if (beta > 1) {
      branches.take("outside of the superquadric");
      return;
    }
    branches.take(object.inside, "inside", "outside");
    // Layer 3 stops when a step is below a thirtieth of a cell.
    const double solver_m = 2e-4 * scale;
    RC_ASSERT(std::abs(world.signed_distance_m - scale * object.signed_distance_m) <= step_m + solver_m);
    RC_ASSERT(std::abs(norm(world.normal) - 1) < 1e-5F);
    const Vec3f turned = instance.to_world_direction(object.normal);
    // Facets of the map meet at up to a tenth of a radian.
    RC_ASSERT(norm(world.normal - turned) < 0.15F + static_cast<float>(step_m / scale));
  });
  branches.expect(kPlacements, 50);
  branches.expect({"inside", "outside", "outside of the superquadric"}, 30);
}

TEST(InstanceProperty, GoingToTheObjectAndBackChangesNothing) {
  Branches branches;
  check([&] {
    const Placement where = placement();
    const Instance instance = placed(where);
    take_placement(branches, where);
    const Vec3f p = cast<float>(2.0 * vector());
    const Vec3f back = instance.to_object(instance.to_world(p));
    RC_ASSERT(norm(back - p) <= static_cast<float>(float_step_m(instance)) / instance.scale() + 1e-5F);
  });
  branches.expect(kPlacements, 50);
}

TEST(ContactProperty, BatchesFindWhatSinglePointsFind) {
  Branches branches;
  check([&] {
    const Placement where = placement();
    const Instance instance = placed(where);
    take_placement(branches, where);
    const auto size = *rc::gen::resize(rc::kNominalSize, rc::gen::inRange<std::size_t>(0, 400));
    // A few kinds of points, so that contacts are rare in some batches and everywhere in others.
    const int inside_percent = *rc::gen::element(0, 1, 50, 100);
    std::vector<Vec3f> points;
    bool has_nan = false;
    for (std::size_t i = 0; i < size; ++i) {
      const int dice = *rc::gen::resize(rc::kNominalSize, rc::gen::inRange(0, 100));
      const Vec3d p =
          dice < inside_percent ? kCentre + 0.4 * vector() : kCentre + Vec3d{1.12, 0, 0} + 0.3 * vector();
      has_nan = has_nan || dice == 99;
      points.push_back(dice == 99 ? Vec3f{std::numeric_limits<float>::quiet_NaN(), 0, 0}
                                  : instance.to_world(cast<float>(p)));
    }
    std::vector<Contact> expected;
    for (std::size_t i = 0; i < size; ++i) {
      const auto contact = contact_of(static_cast<std::uint32_t>(i), points[i], instance.query(points[i]));
      if (contact) expected.push_back(*contact);
    }
    const auto room = *rc::gen::inRange<std::size_t>(0, size + 1);
    std::vector<Contact> found(room);
    const ContactCount count = all_contacts(instance, points, found);
    if (has_nan) branches.take("a point that is no number");
    branches.take(expected.empty()                  ? "no contact"
                  : 10 * expected.size() < size     ? "few contacts"
                  : 10 * expected.size() > 9 * size ? "nearly all are contacts"
                                                    : "some contacts");
    branches.take(room < expected.size(), "room for a part of them", "room for all");
    RC_ASSERT(count.found == expected.size());
    RC_ASSERT(count.written == std::min(room, expected.size()));
    for (std::size_t k = 0; k < count.written; ++k) {
      RC_ASSERT(found[k].point == expected[k].point);
      RC_ASSERT(found[k].depth_m == expected[k].depth_m);
      RC_ASSERT(found[k].normal == expected[k].normal);
    }
    RC_ASSERT(any_contact(instance, points) == !expected.empty());
    const auto first = first_contact(instance, points), deepest = deepest_contact(instance, points);
    RC_ASSERT(first.has_value() == !expected.empty());
    RC_ASSERT(deepest.has_value() == !expected.empty());
    if (expected.empty()) return;
    RC_ASSERT(first->point == expected.front().point);
    const auto shallower = [](const Contact& a, const Contact& b) { return a.depth_m < b.depth_m; };
    RC_ASSERT(deepest->point == std::max_element(expected.begin(), expected.end(), shallower)->point);
  });
  branches.expect(kPlacements, 50);
  branches.expect({"no contact", "few contacts", "some contacts", "nearly all are contacts",
                   "room for a part of them", "room for all", "a point that is no number"},
                  20);
}

/// Where the ball's centre is at a time of a motion from one placement to another, by the axis and angle of
/// the quaternion that leads from the first to the last.
class CentrePath {
 public:
  CentrePath(const Placement& from, const Placement& to) : from_(from), to_(to) {
    r0_ = rotation(from.world_from_object.orientation);
    const Rotation<double> r1 = rotation(to.world_from_object.orientation);
    Rotation<double> step;
    for (int i = 0; i < 3; ++i) step.row[i] = r0_.apply(r1.row[i]);
    angle_ = std::acos(std::clamp((step.row[0].x + step.row[1].y + step.row[2].z - 1) / 2, -1.0, 1.0));
    axis_ = normalized(
        Vec3d{step.row[2].y - step.row[1].z, step.row[0].z - step.row[2].x, step.row[1].x - step.row[0].y});
  }
  double angle() const { return angle_; }
  Vec3d at(double t) const {
    const double c = std::cos(t * angle_), s = std::sin(t * angle_);
    const Vec3d flipped{from_.mirrored ? -kCentre.x : kCentre.x, kCentre.y, kCentre.z};
    const Vec3d v = r0_.apply(flipped);
    const Vec3d turned = c * v + s * cross(axis_, v) + (1 - c) * dot(axis_, v) * axis_;
    return (1 - t) * from_.world_from_object.translation_m + t * to_.world_from_object.translation_m +
           from_.scale * turned;
  }

 private:
  Placement from_, to_;
  Rotation<double> r0_;
  double angle_;
  Vec3d axis_;
};

TEST(SweepProperty, NothingIsInsideBeforeTheContactAndNothingAtAllOnAClearPath) {
  Branches branches;
  check([&] {
    const Placement from = placement();
    Placement to = from;
    const Vec3d turn = vector();
    const Quaternion& q = from.world_from_object.orientation;
    to.world_from_object.orientation = {q.w, q.x + turn.x, q.y + turn.y, q.z + turn.z};
    to.world_from_object.translation_m = from.world_from_object.translation_m + from.scale * vector();
    const Instance start = placed(from), end = placed(to);
    const double reach = *rc::gen::element(3.0, 3.0, 3.0, 0.6);
    const Vec3f a = start.to_world(cast<float>(kCentre + reach * vector())),
                b = end.to_world(cast<float>(kCentre + 1.2 * vector()));
    SweepOptions options;
    options.max_steps = *rc::gen::element(256U, 256U, 256U, 3U);
    const SweepResult result = ball().sweeper.sweep(start, end, {a, b}, options);
    const CentrePath centre(from, to);
    RC_PRE(centre.angle() < 3.1);  // at half a turn the axis of this reference is lost
    take_placement(branches, from);
    RC_ASSERT(result.status != SweepStatus::kInvalid);
    branches.take(result.starts_in_contact                    ? "starts in contact"
                  : result.status == SweepStatus::kContact    ? "contact"
                  : result.status == SweepStatus::kUnresolved ? "out of steps"
                                                              : "clear");
    RC_ASSERT(result.status != SweepStatus::kUnresolved || result.steps <= options.max_steps);
    const auto gap_m = [&](double t) {
      return norm((1 - t) * cast<double>(a) + t * cast<double>(b) - centre.at(t));
    };
    const double error_m = 0.02 * from.scale + 1e-4;  // of map, float and the tolerance of a contact
    const double radius_m = kRadius * from.scale;
    if (result.status == SweepStatus::kContact) {
      RC_ASSERT(gap_m(static_cast<double>(result.time)) < radius_m + error_m);
    }
    if (result.starts_in_contact) {
      RC_ASSERT(result.time == 0);
      return;
    }
    for (int k = 0; k <= 400; ++k)
      RC_ASSERT(gap_m(static_cast<double>(result.time) * k / 400) > radius_m - error_m);
  });
  branches.expect(kPlacements, 50);
  branches.expect({"contact", "clear", "out of steps", "starts in contact"}, 10);
}

TEST(SweepProperty, APathThatEndsBeforeTheContactIsClear) {
  Branches branches;
  check([&] {
    const Placement where = placement();
    const Instance instance = placed(where);
    const auto world = [&](const Vec3d& p) { return instance.to_world(cast<float>(p)); };
    const Vec3d a = kCentre + normalized(vector() + Vec3d{0, 0, 2}) * 3.0, b = kCentre + 0.4 * vector();
    const SweepOptions options{.tolerance_m = 2e-3F * instance.scale()};
    const SweepResult whole = ball().sweeper.sweep(instance, {world(a), world(b)}, options);
    RC_ASSERT(whole.status == SweepStatus::kContact);  // the path ends inside
    const Vec3d before = a + 0.95 * static_cast<double>(whole.time) * (b - a);
    RC_PRE(norm(before - kCentre) > kRadius + 0.01);  // a grazing path is near the ball for long
    take_placement(branches, where);
    const SweepResult part = ball().sweeper.sweep(instance, {world(a), world(before)}, options);
    RC_ASSERT(part.status == SweepStatus::kClear);
  });
  branches.expect(kPlacements, 50);
}

}  // namespace
}  // namespace sqmap::runtime
