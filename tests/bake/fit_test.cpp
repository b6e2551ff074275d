// SPDX-License-Identifier: GPL-3.0-or-later
#include "sqmap/bake/fit.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace sqmap::bake {
namespace {

using Points = std::vector<Vec3d>;

double uniform(std::mt19937_64& rng, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(rng);
}

Vec3d random_direction(std::mt19937_64& rng) {
  std::normal_distribution<double> normal;
  return normalized(Vec3d{normal(rng), normal(rng), normal(rng)});
}

Pose random_pose(std::mt19937_64& rng) {
  std::normal_distribution<double> normal;
  return {{normal(rng), normal(rng), normal(rng), normal(rng)},
          {10 * normal(rng), 10 * normal(rng), 10 * normal(rng)}};
}

Points moved(const Points& points, const Pose& pose, double scale = 1) {
  const Rotation<double> turn = rotation(pose.orientation);
  Points result;
  for (const Vec3d& p : points) result.push_back(turn.apply(scale * p) + pose.translation_m);
  return result;
}

Vec3d to_part(const Fit& fit, const Vec3d& p_object) {
  return rotation(fit.object_from_part.orientation)
      .apply_inverse(p_object - fit.object_from_part.translation_m);
}

/// Points on the surface of a superquadric, along random rays of the ball that was stretched to its axes.
Points sampled(const Superquadric& sq, int count, std::mt19937_64& rng) {
  Points points;
  for (int i = 0; i < count; ++i) {
    const Vec3d d = random_direction(rng);
    const Vec3d ray{d.x * sq.semi_axes_m.x, d.y * sq.semi_axes_m.y, d.z * sq.semi_axes_m.z};
    points.push_back((1 / inside_outside_radial(sq, ray)) * ray);
  }
  return points;
}

Points blob(int count, std::mt19937_64& rng) {
  Points points;
  const Vec3d stretch{uniform(rng, 0.2, 1), uniform(rng, 0.2, 1), uniform(rng, 0.2, 1)};
  for (int i = 0; i < count; ++i) {
    const Vec3d p = std::cbrt(uniform(rng, 0, 1)) * random_direction(rng);
    points.push_back({p.x * stretch.x + 0.3 * p.z * p.z, p.y * stretch.y, p.z * stretch.z});
  }
  return points;
}

Superquadric random_superquadric(std::mt19937_64& rng) {
  const auto axis = [&] { return std::pow(20.0, uniform(rng, 0, 1)); };  // ratios up to 20:1
  return {{axis(), axis(), axis()}, uniform(rng, 0.2, 1.8), uniform(rng, 0.2, 1.8)};
}

FitOptions all_exponents() {
  FitOptions options;
  options.min_exponent = kMinExponent;
  options.max_exponent = kMaxExponent;
  return options;
}

void expect_bounded(const Fit& fit, const Points& points) {
  const SuperquadricOf<float> in_float{cast<float>(fit.shape.semi_axes_m), static_cast<float>(fit.shape.e1),
                                       static_cast<float>(fit.shape.e2), static_cast<float>(fit.shape.taper)};
  for (const Vec3d& p : points) {
    const Vec3d q = to_part(fit, p);
    ASSERT_LE(inside_outside_radial(fit.shape, q), 1.0);
    ASSERT_LE(inside_outside_radial(in_float, cast<float>(q)), 1.0F);
  }
}

double farthest(const Fit& fit, const Points& points) {
  double result = 0;
  for (const Vec3d& p : points) result = std::max(result, inside_outside_radial(fit.shape, to_part(fit, p)));
  return result;
}

void expect_sound(const Fit& fit, const FitOptions& options) {
  const Vec3d& a = fit.shape.semi_axes_m;
  const double longest = std::max({a.x, a.y, a.z});
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(std::isfinite(a[i]));
    ASSERT_GT(a[i], 0);
    ASSERT_GE(a[i], options.min_axis_ratio * longest * (1 - 1e-12));
    ASSERT_TRUE(std::isfinite(fit.object_from_part.translation_m[i]));
  }
  const Quaternion& q = fit.object_from_part.orientation;
  ASSERT_NEAR(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z, 1, 1e-12);
  for (const double e : {fit.shape.e1, fit.shape.e2}) {
    ASSERT_GE(e, options.min_exponent);
    ASSERT_LE(e, options.max_exponent);
  }
  ASSERT_TRUE(std::isfinite(fit.volume_m3) && fit.volume_m3 > 0);
  ASSERT_TRUE(std::isfinite(fit.mean_residual));
  ASSERT_LE(fit.hull_volume_m3, fit.volume_m3);
}

// The claim is on the surface itself, so that equal shapes with other parameters count as found.
TEST(FitSuperquadric, RecoversTheSuperquadricThatThePointsLieOn) {
  constexpr int kShapes = 60, kChecks = 2000;
  std::mt19937_64 rng(11);
  for (int i = 0; i < kShapes; ++i) {
    Superquadric truth = random_superquadric(rng);
    if (i % 10 == 0) truth.semi_axes_m.y = truth.semi_axes_m.x;  // no principal axes in this plane
    if (i % 20 == 0) truth.semi_axes_m.z = truth.semi_axes_m.x;
    const Pose pose = random_pose(rng);
    const Points points = moved(sampled(truth, 500 + 8 * i, rng), pose);
    const auto fit = fit_superquadric(points, all_exponents());
    ASSERT_TRUE(fit.ok());
    double deviation = 0;
    for (const Vec3d& p : moved(sampled(truth, kChecks, rng), pose))
      deviation = std::max(deviation,
                           std::abs(inside_outside_radial(fit.value().shape, to_part(fit.value(), p)) - 1));
    EXPECT_LT(deviation, 0.005) << "shape " << i;
  }
}

// As above, of tapered ones; the points alone must find the axis of the taper.
TEST(FitSuperquadric, RecoversTheTaperedSuperquadricThatThePointsLieOn) {
  constexpr int kShapes = 40, kChecks = 2000;
  std::mt19937_64 rng(31);
  int found = 0;
  for (int i = 0; i < kShapes; ++i) {
    Superquadric truth = random_superquadric(rng);
    truth.taper = uniform(rng, -0.85, 0.85) * max_taper(truth.e1);
    const Pose pose = random_pose(rng);
    const Points points = moved(sampled(truth, 500 + 8 * i, rng), pose);
    FitOptions options = all_exponents();
    options.taper = true;
    const auto fit = fit_superquadric(points, options);
    ASSERT_TRUE(fit.ok());
    expect_bounded(fit.value(), points);
    double deviation = 0;
    for (const Vec3d& p : moved(sampled(truth, kChecks, rng), pose))
      deviation = std::max(deviation,
                           std::abs(inside_outside_radial(fit.value().shape, to_part(fit.value(), p)) - 1));
    found += deviation < 0.005;
  }
  RecordProperty("found", found);
  EXPECT_GE(found, 36);
}

TEST(FitSuperquadric, TapersACloudThatNarrowsAndIsSoundForAnyCloud) {
  std::mt19937_64 rng(32);
  FitOptions options;
  options.taper = true;
  Points frustum;
  for (const double z : {-1.0, 0.0, 1.0})
    for (int k = 0; k < 64; ++k) {
      const double turn = 2 * std::numbers::pi * k / 64, radius = 0.6 - 0.4 * z;
      frustum.push_back({radius * std::cos(turn), radius * std::sin(turn), 2 * z});
    }
  const Points turned = moved(frustum, random_pose(rng));
  const Fit tapered = fit_superquadric(turned, options).value(), rigid = fit_superquadric(turned).value();
  expect_bounded(tapered, turned);
  EXPECT_GT(std::abs(tapered.shape.taper), 0.3);
  EXPECT_LT(tapered.volume_m3, 0.75 * rigid.volume_m3);
  EXPECT_EQ(rigid.shape.taper, 0);
  for (int i = 0; i < 20; ++i) {
    options.quick = i % 2 == 0;
    const Points points = moved(blob(4 + 30 * i, rng), random_pose(rng));
    const Fit fit = fit_superquadric(points, options).value();
    expect_sound(fit, options);
    expect_bounded(fit, points);
    EXPECT_LE(std::abs(fit.shape.taper), max_taper(fit.shape.e1));
  }
  // Needles, plates, a single triangle, four points, one point.
  for (const Points& points :
       {Points{{0, 0, 0}, {0, 0, 1}, {0, 0, 2}}, Points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}},
        Points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, Points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
        Points{{1, 2, 3}}}) {
    const Fit fit = fit_superquadric(points, options).value();
    expect_bounded(fit, points);
    EXPECT_LE(std::abs(fit.shape.taper), max_taper(fit.shape.e1));
  }
}

TEST(FitSuperquadric, BoundsEveryPointOfAnyCloudTightlyInDoubleAndFloat) {
  std::mt19937_64 rng(12);
  for (const bool quick : {false, true})
    for (int i = 0; i < 20; ++i) {
      FitOptions options;
      options.quick = quick;
      const Points points = moved(blob(4 + 30 * i, rng), random_pose(rng));
      const auto fit = fit_superquadric(points, options);
      ASSERT_TRUE(fit.ok());
      expect_sound(fit.value(), options);
      expect_bounded(fit.value(), points);
      EXPECT_GT(farthest(fit.value(), points), 1 - 2 * kBoundMargin) << "a point touches";
    }
}

// The ellipsoid is one of the superquadrics; the largest exponents include the octahedron, the smallest the
// box.
TEST(FitSuperquadric, MoreFreedomGivesASmallerBound) {
  std::mt19937_64 rng(13);
  FitOptions ellipsoid;
  ellipsoid.min_exponent = ellipsoid.max_exponent = 1;
  for (int i = 0; i < 10; ++i) {
    const Points points = blob(200, rng);
    const double round = fit_superquadric(points, ellipsoid).value().volume_m3;
    const double usual = fit_superquadric(points).value().volume_m3;
    const double widest = fit_superquadric(points, all_exponents()).value().volume_m3;
    EXPECT_LT(usual, round * 1.001);
    EXPECT_LT(widest, usual * 1.005);
  }
}

TEST(FitSuperquadric, BoundsACubeByNearlyTheCubeAndABallByTheBall) {
  Points cube;
  for (const double x : {-1.0, 1.0})
    for (const double y : {-1.0, 1.0})
      for (const double z : {-1.0, 1.0}) cube.push_back({x, y, z});
  std::mt19937_64 rng(14);
  const auto boxed = fit_superquadric(moved(cube, random_pose(rng)), all_exponents());
  EXPECT_NEAR(boxed.value().hull_volume_m3, 8, 1e-9);
  EXPECT_LT(boxed.value().volume_m3, 8 * 1.15);  // exponents stop at 0.1: corners stay a little round

  const Points ball = sampled({{2, 2, 2}, 1, 1}, 600, rng);
  const auto round = fit_superquadric(moved(ball, random_pose(rng)));
  EXPECT_NEAR(round.value().volume_m3, 4.0 / 3 * std::numbers::pi * 8, 1e-3);
}

TEST(FitSuperquadric, VolumeFollowsRigidMotionsAndScale) {
  std::mt19937_64 rng(15);
  for (int i = 0; i < 12; ++i) {
    const Points points = blob(250, rng);
    const double reference = fit_superquadric(points).value().volume_m3;
    for (const double scale : {1.0, 1e-6, 1e6}) {
      Pose pose = random_pose(rng);
      pose.translation_m = scale * pose.translation_m;
      const double volume = fit_superquadric(moved(points, pose, scale)).value().volume_m3;
      EXPECT_NEAR(volume / (scale * scale * scale), reference, 0.01 * reference) << "cloud " << i;
    }
  }
}

TEST(FitSuperquadric, PointsInsideTheHullChangeNothing) {
  std::mt19937_64 rng(16);
  Points points = blob(150, rng);
  const Fit before = fit_superquadric(points).value();
  const std::size_t count = points.size();
  for (std::size_t i = 1; i < count; ++i) points.push_back(0.45 * points[i] + 0.45 * points[i - 1]);
  const Fit after = fit_superquadric(points).value();
  EXPECT_EQ(before.shape, after.shape);
  EXPECT_EQ(before.object_from_part, after.object_from_part);
}

TEST(FitSuperquadric, GivesTheSameBitsAgainAndForAnyOrderOfThePoints) {
  std::mt19937_64 rng(17);
  Points points = blob(400, rng);
  const Fit before = fit_superquadric(points).value();
  std::shuffle(points.begin(), points.end(), rng);
  const Fit after = fit_superquadric(points).value();
  EXPECT_EQ(before.shape, after.shape);
  EXPECT_EQ(before.object_from_part, after.object_from_part);
  EXPECT_EQ(before.iterations, after.iterations);
}

TEST(FitSuperquadric, PutsZAlongTheLongAxisOfAnEllipsoid) {
  std::mt19937_64 rng(18);
  for (const Vec3d& axes : {Vec3d{5, 1, 2}, Vec3d{1, 5, 2}, Vec3d{1, 2, 5}}) {
    const Fit fit = fit_superquadric(moved(sampled({axes, 1, 1}, 400, rng), random_pose(rng))).value();
    EXPECT_NEAR(fit.shape.semi_axes_m.z, 5, 0.02);
  }
}

TEST(FitSuperquadric, QuickFitIsNearlyAsSmallAsTheFullOne) {
  std::mt19937_64 rng(19);
  FitOptions quick;
  quick.quick = true;
  double sum_quick = 0, sum_full = 0;
  int quick_iterations = 0, full_iterations = 0;
  for (int i = 0; i < 12; ++i) {
    const Points points = blob(300, rng);
    const Fit full = fit_superquadric(points).value(), fast = fit_superquadric(points, quick).value();
    sum_full += full.volume_m3 / full.hull_volume_m3;
    sum_quick += fast.volume_m3 / fast.hull_volume_m3;
    full_iterations += full.iterations;
    quick_iterations += fast.iterations;
  }
  EXPECT_LT(sum_quick, 1.1 * sum_full);
  EXPECT_LT(3 * quick_iterations, full_iterations);
}

struct DegenerateCase {
  std::string name;
  Points points;
};

std::vector<DegenerateCase> degenerate_cases() {
  std::mt19937_64 rng(20);
  std::vector<DegenerateCase> cases;
  const Points tetrahedron{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  cases.push_back({"one point", {{1, 2, 3}}});
  cases.push_back({"the origin", {{0, 0, 0}}});
  cases.push_back({"one far point", {{1e6, -1e6, 1e6}}});
  cases.push_back({"equal points", Points(50, Vec3d{0.1, 0.2, 0.3})});
  cases.push_back({"points that differ in the last bit", {{1, 1, 1}, {std::nextafter(1.0, 2.0), 1, 1}}});
  cases.push_back({"denormal coordinates", {{5e-324, 0, 0}, {0, 5e-324, 0}, {0, 0, 1e-310}}});
  cases.push_back({"two points", {{0, 0, 0}, {1, 2, 3}}});
  cases.push_back({"three points", {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}}});
  cases.push_back({"tetrahedron", tetrahedron});
  cases.push_back({"tetrahedron with repeated corners", {}});
  for (int i = 0; i < 40; ++i) cases.back().points.push_back(tetrahedron.at(static_cast<std::size_t>(i % 4)));
  Points line, plane, near_plane, needle, plate;
  for (int i = 0; i < 100; ++i) {
    const double u = uniform(rng, -1, 1), v = uniform(rng, -1, 1), w = uniform(rng, -1, 1);
    line.push_back(u * Vec3d{1, 2, -1});
    plane.push_back({u, v, 0});
    near_plane.push_back({u, v, 1e-14 * w});
    needle.push_back({u, 1e-5 * v, 1e-5 * w});
    plate.push_back({1e-5 * u, v, w});
  }
  cases.push_back({"collinear", line});
  cases.push_back({"coplanar", plane});
  cases.push_back({"coplanar, oblique", moved(plane, random_pose(rng))});
  cases.push_back({"nearly coplanar", near_plane});
  cases.push_back({"needle", moved(needle, random_pose(rng))});
  cases.push_back({"plate", moved(plate, random_pose(rng))});
  for (const double apart : {3.0, 1e6}) {
    const Points near_one = blob(50, rng), far_one = moved(blob(50, rng), {{}, {apart, 0.3 * apart, 0}});
    Points both = near_one;
    both.insert(both.end(), far_one.begin(), far_one.end());
    cases.push_back({"two clusters, " + std::to_string(apart) + " apart", both});
  }
  const Points cloud = blob(100, rng);
  cases.push_back({"micrometres", moved(cloud, random_pose(rng), 1e-6)});
  cases.push_back({"micrometres at the origin", moved(cloud, {}, 1e-6)});
  cases.push_back({"thousands of kilometres", moved(cloud, random_pose(rng), 1e6)});
  cases.push_back({"far away", moved(cloud, {{}, {1e6, 1e6, -1e6}})});
  cases.push_back({"small and far away", moved(cloud, {{}, {1e6, 1e6, -1e6}}, 1e-6)});
  cases.push_back({"at the largest coordinates", moved(cloud, {}, 1e14)});
  return cases;
}

TEST(FitSuperquadric, DegenerateSetsAreBoundedFiniteAndRepeatable) {
  for (const DegenerateCase& c : degenerate_cases())
    for (const bool quick : {false, true}) {
      SCOPED_TRACE(c.name + (quick ? ", quick" : ""));
      FitOptions options;
      options.quick = quick;
      const auto fit = fit_superquadric(c.points, options);
      ASSERT_TRUE(fit.ok());
      expect_sound(fit.value(), options);
      expect_bounded(fit.value(), c.points);
      const auto again = fit_superquadric(c.points, options);
      EXPECT_EQ(fit.value().shape, again.value().shape);
      EXPECT_EQ(fit.value().object_from_part, again.value().object_from_part);
    }
}

TEST(FitSuperquadric, BoundsWithOptionsAtTheEndsOfTheirRanges) {
  std::mt19937_64 rng(23);
  const Points points = blob(120, rng);
  std::vector<FitOptions> ends(5, all_exponents());
  ends[0].min_exponent = kMaxExponent;
  ends[1].max_exponent = kMinExponent;
  ends[2].max_iterations = 1;
  ends[3].min_axis_ratio = 1;
  ends[4].min_axis_ratio = 1e-6;
  for (const FitOptions& options : ends) {
    const auto fit = fit_superquadric(points, options);
    ASSERT_TRUE(fit.ok());
    expect_sound(fit.value(), options);
    expect_bounded(fit.value(), points);
  }
}

TEST(FitSuperquadric, FlatSetsGetTheThinnestShapeAllowed) {
  std::mt19937_64 rng(21);
  Points square;
  for (int i = 0; i < 100; ++i) square.push_back({uniform(rng, -1, 1), uniform(rng, -1, 1), 0});
  for (const double ratio : {1e-2, 1e-4}) {
    FitOptions options;
    options.min_axis_ratio = ratio;
    const Fit fit = fit_superquadric(moved(square, random_pose(rng)), options).value();
    const Vec3d& a = fit.shape.semi_axes_m;
    const double thinnest = std::min({a.x, a.y, a.z}), longest = std::max({a.x, a.y, a.z});
    EXPECT_LT(thinnest, 2 * ratio * longest);
    EXPECT_LT(fit.hull_volume_m3, 1e-12);
  }
}

TEST(FitSuperquadric, TwoFarClustersGetANeedleAlongTheLineBetweenThem) {
  std::mt19937_64 rng(23);
  const Vec3d along = normalized(Vec3d{3, -2, 1});
  for (const double apart_m : {20.0, 1e6}) {
    Points points = blob(60, rng);
    const Points others = moved(blob(60, rng), {{}, apart_m * along});
    points.insert(points.end(), others.begin(), others.end());
    const Fit fit = fit_superquadric(points).value();
    expect_bounded(fit, points);
    const Vec3d& a = fit.shape.semi_axes_m;
    EXPECT_GT(a.z, apart_m / 2) << apart_m;
    EXPECT_LT(std::max(a.x, a.y), 0.2 * a.z) << apart_m;
    const Vec3d axis = rotation(fit.object_from_part.orientation).apply({0, 0, 1});
    EXPECT_GT(std::abs(dot(axis, along)), 0.99) << apart_m;
    EXPECT_GT(fit.iterations, 0) << apart_m;
  }
}

TEST(FitSuperquadric, SaysWhyItStopped) {
  std::mt19937_64 rng(24);
  const Fit point = fit_superquadric(Points(3, Vec3d{1, 2, 3})).value();
  EXPECT_EQ(point.stop, FitStop::kPoint);
  EXPECT_EQ(point.iterations, 0);

  FitOptions one_step;
  one_step.max_iterations = 1;
  for (int i = 0; i < 5; ++i) {
    const Points points = blob(200, rng);
    const Fit free = fit_superquadric(points).value(), cut_short = fit_superquadric(points, one_step).value();
    EXPECT_EQ(free.stop, FitStop::kGain) << i;
    EXPECT_EQ(cut_short.stop, FitStop::kIterations) << i;
    EXPECT_GT(cut_short.iterations, 0) << i;
    EXPECT_GT(free.iterations, 2 * cut_short.iterations) << i;
  }
}

TEST(FitStop, NamesDiffer) {
  EXPECT_STREQ(fit_stop_name(FitStop::kPoint), "point");
  EXPECT_STREQ(fit_stop_name(FitStop::kGain), "gain");
  EXPECT_STREQ(fit_stop_name(FitStop::kNoDescent), "no-descent");
  EXPECT_STREQ(fit_stop_name(FitStop::kIterations), "iterations");
}

TEST(FitSuperquadric, RefusesNoPointsAndCoordinatesOutOfRangeByIndex) {
  EXPECT_EQ(fit_superquadric({}).error().status, Status::kInvalidMesh);
  const double inf = std::numeric_limits<double>::infinity();
  for (const double bad : {std::nan(""), inf, -inf, 2e15, 1e300}) {
    const Points points{{0, 0, 0}, {1, 0, 0}, {0, bad, 0}, {0, 0, 1}};
    const auto fit = fit_superquadric(points);
    ASSERT_FALSE(fit.ok());
    EXPECT_EQ(fit.error().status, Status::kInvalidMesh);
    EXPECT_NE(fit.error().finding.find("point 2 "), std::string::npos) << fit.error().finding;
  }
}

TEST(FitOptions, CheckNamesTheOptionThatIsOutOfRange) {
  EXPECT_TRUE(FitOptions{}.check().ok());
  EXPECT_TRUE(all_exponents().check().ok());
  const auto expect_refused = [](const char* name, auto change) {
    FitOptions options;
    change(options);
    const Outcome outcome = options.check();
    ASSERT_FALSE(outcome.ok()) << name;
    EXPECT_EQ(outcome.error().status, Status::kBadOption);
    EXPECT_NE(outcome.error().finding.find(name), std::string::npos) << outcome.error().finding;
    EXPECT_EQ(fit_superquadric(Points{{0, 0, 0}}, options).error().status, Status::kBadOption);
  };
  expect_refused("fit.min_exponent", [](FitOptions& o) { o.min_exponent = 0.09; });
  expect_refused("fit.min_exponent", [](FitOptions& o) { o.min_exponent = std::nan(""); });
  expect_refused("fit.min_exponent", [](FitOptions& o) { o.min_exponent = 1.2, o.max_exponent = 1.1; });
  expect_refused("fit.max_exponent", [](FitOptions& o) { o.max_exponent = 2.01; });
  expect_refused("fit.max_iterations", [](FitOptions& o) { o.max_iterations = 0; });
  expect_refused("fit.min_axis_ratio", [](FitOptions& o) { o.min_axis_ratio = 0; });
  expect_refused("fit.min_axis_ratio", [](FitOptions& o) { o.min_axis_ratio = 1.1; });
}

TEST(Volume, EqualsItsMonteCarloEstimate) {
  std::mt19937_64 rng(22);
  constexpr int kDraws = 100000;
  for (int i = 0; i < 8; ++i) {
    const Superquadric sq = random_superquadric(rng);
    int inside = 0;
    for (int k = 0; k < kDraws; ++k)
      inside +=
          inside_outside_radial(sq, {uniform(rng, 0, sq.semi_axes_m.x), uniform(rng, 0, sq.semi_axes_m.y),
                                     uniform(rng, 0, sq.semi_axes_m.z)}) < 1;
    const double octant = sq.semi_axes_m.x * sq.semi_axes_m.y * sq.semi_axes_m.z,
                 share = inside / double{kDraws};
    const double sigma = std::sqrt(share * (1 - share) / kDraws);
    EXPECT_NEAR(volume_m3(sq), 8 * octant * share, 4 * 8 * octant * sigma);
  }
}

TEST(Volume, OfATaperedShapeEqualsItsMonteCarloEstimate) {
  std::mt19937_64 rng(23);
  constexpr int kDraws = 100000;
  for (int i = 0; i < 8; ++i) {
    Superquadric sq = random_superquadric(rng);
    sq.taper = (i % 2 == 0 ? 0.9 : -0.9) * max_taper(sq.e1);
    const Vec3d half_m = half_extents_m(sq);
    int inside = 0;
    for (int k = 0; k < kDraws; ++k)
      inside += inside_outside_radial(sq, {uniform(rng, 0, half_m.x), uniform(rng, 0, half_m.y),
                                           uniform(rng, -half_m.z, half_m.z)}) < 1;
    const double quarter = half_m.x * half_m.y * 2 * half_m.z, share = inside / double{kDraws};
    const double sigma = std::sqrt(share * (1 - share) / kDraws);
    EXPECT_NEAR(volume_m3(sq), 4 * quarter * share, 4 * 4 * quarter * sigma);
    EXPECT_GT(volume_m3(sq) / volume_m3({sq.semi_axes_m, sq.e1, sq.e2}), 1);
  }
}

TEST(Volume, OfEllipsoidAndOctahedron) {
  EXPECT_NEAR(volume_m3({{1, 2, 3}, 1, 1}), 4.0 / 3 * std::numbers::pi * 6, 1e-12);
  EXPECT_NEAR(volume_m3({{1, 2, 3}, 2, 2}), 4.0 / 3 * 6, 1e-12);
}

#ifdef SQMAP_MESH_DIR
/// Vertices of an OFF file.
Points off_vertices(const std::string& path) {
  std::ifstream file(path);
  std::string magic;
  std::size_t vertex_count = 0, face_count = 0, edge_count = 0;
  file >> magic >> vertex_count >> face_count >> edge_count;
  Points points(vertex_count);
  for (Vec3d& p : points) file >> p.x >> p.y >> p.z;
  return file ? points : Points{};
}

/// Sixteen boxes with equally many vertices: median cuts across the longest extent.
void cut(Points points, int depth, std::vector<Points>& parts) {
  if (depth == 0) return parts.push_back(std::move(points));
  Vec3d low = points.front(), high = low;
  for (const Vec3d& p : points)
    for (int i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], p[i]);
      high[i] = std::max(high[i], p[i]);
    }
  const Vec3d size = high - low;
  const int axis = size.x >= std::max(size.y, size.z) ? 0 : size.y >= size.z ? 1 : 2;
  const auto middle = points.begin() + static_cast<std::ptrdiff_t>(points.size() / 2);
  std::nth_element(points.begin(), middle, points.end(),
                   [axis](const Vec3d& a, const Vec3d& b) { return a[axis] < b[axis]; });
  cut({points.begin(), middle}, depth - 1, parts);
  cut({middle, points.end()}, depth - 1, parts);
}

TEST(FitSuperquadric, BoundsPartsOfRealMeshesTighterThanEllipsoids) {
  FitOptions ellipsoid;
  ellipsoid.min_exponent = ellipsoid.max_exponent = 1;
  int fitted = 0;
  for (const char* name : {"elephant.off", "hand.off"}) {
    const Points vertices = off_vertices(std::string(SQMAP_MESH_DIR) + "/" + name);
    if (vertices.empty()) continue;
    std::vector<Points> parts;
    cut(vertices, 4, parts);
    double ratio = 0, ellipsoid_ratio = 0;
    for (const Points& points : parts) {
      const Fit fit = fit_superquadric(points).value();
      expect_sound(fit, {});
      expect_bounded(fit, points);
      ratio += fit.volume_m3 / fit.hull_volume_m3;
      ellipsoid_ratio += fit_superquadric(points, ellipsoid).value().volume_m3 / fit.hull_volume_m3;
      ++fitted;
    }
    EXPECT_LT(ratio, 0.95 * ellipsoid_ratio) << name;
  }
  if (fitted == 0) GTEST_SKIP() << "no meshes in " << SQMAP_MESH_DIR;
}
#endif

}  // namespace
}  // namespace sqmap::bake
