// SPDX-License-Identifier: Apache-2.0
// Claims over random placements, batches and paths; a failure is shrunk to a small case by RapidCheck.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <vector>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "sqmap/runtime/contacts.hpp"
#include "sqmap/runtime/instance.hpp"
#include "sqmap/runtime/sweep.hpp"

#include "support/analytic_asset.hpp"

namespace sqmap::runtime {
namespace {

// Read by RapidCheck before its first case; a value from outside wins, so that more cases can be asked for.
const bool kIsSeeded = setenv("RC_PARAMS", "seed=2007 max_success=300", 0) == 0;

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

/// A number of [-1, 1], all alike likely from the first case on; shrinks towards 0.
double share() { return *rc::gen::resize(rc::kNominalSize, rc::gen::inRange(-1000, 1001)) / 1000.0; }
Vec3d vector() {
  const double x = share(), y = share();
  return {x, y, share()};
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

RC_GTEST_PROP(InstanceProperty, AnswersTurnMoveScaleAndMirrorWithTheObject, ()) {
  RC_ASSERT(kIsSeeded);
  const Instance instance = placed(placement());
  const Vec3f p = cast<float>(kCentre + 0.9 * vector());
  RC_PRE(norm(cast<double>(p) - kCentre) > 0.3);  // at the centre every direction is nearest
  const QueryOptions options{Layer::kThree};
  const Answer world = instance.query(instance.to_world(p), options),
               object = ball().object.query(p, options);
  // On the rim of the superquadric the two may fall on different sides.
  RC_PRE(std::isnan(world.signed_distance_m) == std::isnan(object.signed_distance_m));
  if (std::isnan(object.signed_distance_m)) return;
  const double scale = instance.scale();
  const double step_m = float_step_m(instance);
  // Layer 3 stops when a step is below a thousandth of a cell.
  const double solver_m = 2e-4 * scale;
  RC_ASSERT(std::abs(world.signed_distance_m - scale * object.signed_distance_m) <= step_m + solver_m);
  RC_ASSERT(std::abs(norm(world.normal) - 1) < 1e-5F);
  const Vec3f turned = instance.to_world_direction(object.normal);
  // Facets of the map meet at up to a tenth of a radian.
  RC_ASSERT(norm(world.normal - turned) < 0.15F + static_cast<float>(step_m / scale));
}

RC_GTEST_PROP(InstanceProperty, GoingToTheObjectAndBackChangesNothing, ()) {
  const Instance instance = placed(placement());
  const Vec3f p = cast<float>(2.0 * vector());
  const Vec3f back = instance.to_object(instance.to_world(p));
  RC_ASSERT(norm(back - p) <= static_cast<float>(float_step_m(instance)) / instance.scale() + 1e-5F);
}

RC_GTEST_PROP(ContactProperty, BatchesFindWhatSinglePointsFind, ()) {
  const Instance instance = placed(placement());
  const auto size = *rc::gen::inRange<std::size_t>(0, 400);
  // A few kinds of points, so that contacts are rare in some batches and everywhere in others.
  const int inside_percent = *rc::gen::element(0, 1, 50, 100);
  std::vector<Vec3f> points;
  for (std::size_t i = 0; i < size; ++i) {
    const int dice = *rc::gen::inRange(0, 100);
    const Vec3d p =
        dice < inside_percent ? kCentre + 0.4 * vector() : kCentre + Vec3d{1, 0, 0} + 0.3 * vector();
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
}

RC_GTEST_PROP(SweepProperty, NothingIsInsideBeforeTheContactAndNothingAtAllOnAClearPath, ()) {
  const Placement from = placement();
  Placement to = from;
  const Vec3d turn = vector();
  const Quaternion& q = from.world_from_object.orientation;
  to.world_from_object.orientation = {q.w, q.x + turn.x, q.y + turn.y, q.z + turn.z};
  to.world_from_object.translation_m = from.world_from_object.translation_m + from.scale * vector();
  const Instance start = placed(from), end = placed(to);
  const Vec3f a = start.to_world(cast<float>(kCentre + 3.0 * vector())),
              b = end.to_world(cast<float>(kCentre + 1.2 * vector()));
  const SweepResult result = ball().sweeper.sweep(start, end, {a, b});
  RC_TAG(static_cast<int>(result.status));
  RC_ASSERT(result.status != SweepStatus::kInvalid);
  if (result.starts_in_contact) return;

  // Poses in between, by the axis and angle of the quaternion that leads from the first to the last.
  const Rotation<double> r0 = rotation(q), r1 = rotation(to.world_from_object.orientation);
  Rotation<double> step;
  for (int i = 0; i < 3; ++i) step.row[i] = r0.apply(r1.row[i]);
  const double cosine = (step.row[0].x + step.row[1].y + step.row[2].z - 1) / 2;
  const double angle = std::acos(std::clamp(cosine, -1.0, 1.0));
  RC_PRE(angle < 3.1);  // at half a turn the axis of this reference is lost
  const Vec3d axis = normalized(
      Vec3d{step.row[2].y - step.row[1].z, step.row[0].z - step.row[2].x, step.row[1].x - step.row[0].y});
  const double centre_gap_m = from.scale * (kRadius - 0.02);  // a little inside: errors of map and float
  for (int k = 0; k <= 400; ++k) {
    const double t = static_cast<double>(result.time) * k / 400;
    const double c = std::cos(t * angle), s = std::sin(t * angle);
    const Vec3d flipped{from.mirrored ? -kCentre.x : kCentre.x, kCentre.y, kCentre.z};
    const Vec3d v = r0.apply(flipped);
    const Vec3d turned = c * v + s * cross(axis, v) + (1 - c) * dot(axis, v) * axis;
    const Vec3d centre = (1 - t) * from.world_from_object.translation_m +
                         t * to.world_from_object.translation_m + from.scale * turned;
    const Vec3d p = (1 - t) * cast<double>(a) + t * cast<double>(b);
    RC_ASSERT(norm(p - centre) > centre_gap_m - 1e-4);
  }
}

RC_GTEST_PROP(SweepProperty, APathThatEndsBeforeTheContactIsClear, ()) {
  const Instance instance = placed(placement());
  const auto world = [&](const Vec3d& p) { return instance.to_world(cast<float>(p)); };
  const Vec3d a = kCentre + normalized(vector() + Vec3d{0, 0, 2}) * 3.0, b = kCentre + 0.4 * vector();
  const SweepOptions options{.tolerance_m = 2e-3F * instance.scale()};
  const SweepResult whole = ball().sweeper.sweep(instance, {world(a), world(b)}, options);
  RC_PRE(whole.status == SweepStatus::kContact);
  const Vec3d before = a + 0.95 * static_cast<double>(whole.time) * (b - a);
  RC_PRE(norm(before - kCentre) > kRadius + 0.01);  // a grazing path is near the ball for long
  const SweepResult part = ball().sweeper.sweep(instance, {world(a), world(before)}, options);
  RC_ASSERT(part.status == SweepStatus::kClear);
}

}  // namespace
}  // namespace sqmap::runtime
