// SPDX-License-Identifier: GPL-3.0-or-later
#include "surface_bounds.hpp"

#include <cmath>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "sqmap/asset/validate.hpp"
#include "sqmap/bake/bake.hpp"
#include "sqmap/runtime/object.hpp"

#include "support/certainty_points.hpp"
#include "support/shapes.hpp"

namespace sqmap::bake {
namespace {

using runtime::Certainty;

/// A mesh within one superquadric, with bounds and no other map than the smallest there is.
struct Bounded {
  Mesh mesh;
  RayTracer rays;
  Oracle oracle;
  OpenPlaces open;
  Asset asset;

  Bounded(Mesh closed, const Superquadric& shape, std::uint32_t cells, const Pose& pose = {})
      : mesh(std::move(closed)), rays(mesh), oracle(mesh), open(mesh) {
    Part part;
    part.shape = shape;
    part.object_from_part = pose;
    part.sphere = {pose.translation_m, bounding_radius_m(shape)};
    part.map.rows = 3;
    part.map.cols = 4;
    part.map.level_count = 1;
    part.map.bits = 4;
    part.map.code.assign(12, part.map.miss_code());
    asset.r_max_m = 2 * part.sphere.radius_m;
    asset.sphere = part.sphere;
    part.bounds = bound_surface(part, asset.sphere, {mesh, rays, oracle, open}, cells);
    asset.parts = {part};
    asset.provenance.up_axis = "z";
  }
  runtime::Object object() const {
    EXPECT_TRUE(validate(asset, CheckLevel::kFull).empty());
    auto built = runtime::Object::build(asset);
    EXPECT_TRUE(built.ok()) << (built ? "" : built.error().finding);
    return std::move(built).value();
  }
};

/// A box on which thin needles stand, `count` a side, each with a square foot.
Mesh comb(int count, double needle_m) {
  std::initializer_list<Mesh> base{test::translated(test::box({1, 1, 0.2}), {0, 0, -0.6})};
  Mesh all = test::joined(base);
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j) {
      const auto at = [&](int k) { return 1.6 * (k + 0.5) / count - 0.8; };
      all = test::joined({all, test::translated(test::box({needle_m, needle_m, 0.5}), {at(i), at(j), 0.05})});
    }
  }
  return all;
}

/// A ball with one vertex drawn out to a spike of `reach_m`, narrower than any cell.
Mesh spiked_ball(double radius_m, double reach_m, Vec3d& tip_m) {
  Mesh mesh = test::sphere(radius_m, 4);
  const Vec3d wanted = radius_m * normalized(Vec3d{1, 0.31, 0.23});
  std::size_t nearest = 0;
  for (std::size_t i = 0; i < mesh.vertices_m.size(); ++i) {
    if (norm(mesh.vertices_m[i] - wanted) < norm(mesh.vertices_m[nearest] - wanted)) nearest = i;
  }
  tip_m = mesh.vertices_m[nearest] = (reach_m / radius_m) * mesh.vertices_m[nearest];
  return mesh;
}

struct AdverseShape {
  std::string name;
  Mesh mesh;
  Superquadric shape;
  double least_share;   ///< of the points in its box that must be sure
  bool is_thick{true};  ///< enough for something to be surely inside
};

std::vector<AdverseShape> adverse_shapes() {
  Vec3d tip_m;
  return {
      {"spike", spiked_ball(0.6, 0.9, tip_m), {{1, 1, 1}, 1, 1}, 0.85},
      {"sheet", test::box({0.9, 0.9, 0.0005}), {{1, 1, 1}, 0.5, 0.5}, 0.75, false},
      {"touching boxes",
       test::joined({test::translated(test::box({0.4, 0.4, 0.4}), {-0.4, 0, 0}),
                     test::translated(test::box({0.4, 0.4, 0.4}), {0.4, 0, 0})}),
       {{1, 0.6, 0.6}, 0.3, 0.3},
       0.6},
      {"comb of needles", comb(6, 0.01), {{1.4, 1.4, 1}, 0.2, 0.2}, 0.4},
      {"torus", test::torus(0.7, 0.2, 64, 32), {{1, 1, 0.3}, 0.6, 1}, 0.7},
      {"ball beyond the superquadric", test::sphere(1, 5), {{0.7, 1.2, 0.9}, 0.4, 1.7}, 0.6},
      {"ball beyond the tapered superquadric", test::sphere(1, 5), {{0.7, 1.0, 0.9}, 0.4, 1.2, -0.6}, 0.6},
      {"spike in a tapered superquadric", spiked_ball(0.5, 0.75, tip_m), {{0.9, 0.9, 1}, 0.5, 1, 0.3}, 0.8},
  };
}

class AdverseBounds : public testing::TestWithParam<std::size_t> {};

// Two points in three lie within 1 % of the surface or beside a vertex, where a bound that is too narrow
// shows.
TEST_P(AdverseBounds, NoSureAnswerIsWrong) {
  const AdverseShape shape = adverse_shapes()[GetParam()];
  SCOPED_TRACE(shape.name);
  const Pose pose{{0.8, 0.2, -0.4, 0.4}, {0.3, -0.2, 0.1}};
  const Bounded bounded(test::transformed(shape.mesh, pose), shape.shape, 12, pose);
  const runtime::Object object = bounded.object();
  // What leaves the superquadric is another part's to tell.
  const auto inner = [&](std::vector<Vec3f> points) {
    std::erase_if(points, [&](const Vec3f& p) {
      const Vec3d q = rotation(pose.orientation).apply_inverse(cast<double>(p) - pose.translation_m);
      return !(inside_outside_radial(shape.shape, q) < 1);
    });
    return points;
  };
  const double r_max_m = bounded.asset.r_max_m;
  const auto adverse = inner(test::adverse_points(bounded.mesh, r_max_m, 60000, 1));
  const auto all = inner(test::points_in_box(bounded.mesh, 60000, 2));
  const test::CertaintyCount near = test::count_certainty(object, bounded.oracle, adverse);
  const test::CertaintyCount even = test::count_certainty(object, bounded.oracle, all);
  ASSERT_GT(near.points, 10000U);
  EXPECT_EQ(near.wrong, 0U) << "by up to " << near.worst_m << " m";
  EXPECT_EQ(even.wrong, 0U) << "by up to " << even.worst_m << " m";
  EXPECT_GT(even.sure_share(), shape.least_share) << "unsure of everything is no answer";
  EXPECT_GT(even.outside + near.outside, 100U);
  EXPECT_EQ(even.inside + near.inside > 10, shape.is_thick);
}

INSTANTIATE_TEST_SUITE_P(SurfaceBounds, AdverseBounds,
                         testing::Range(std::size_t{0}, adverse_shapes().size()));

// The inside of a spike is never called outside, however it lies among the cells.
TEST(SurfaceBounds, KnowASpikeNarrowerThanACell) {
  Vec3d tip_m;
  const Bounded bounded(spiked_ball(0.6, 0.9, tip_m), {{1, 1, 1}, 1, 1}, 8);
  const runtime::Object object = bounded.object();
  int inside = 0;
  for (int k = 0; k <= 1000; ++k) {
    const Vec3f p = cast<float>((0.62 + 0.279 * k / 1000) / 0.9 * tip_m);
    ASSERT_TRUE(bounded.oracle.inside(cast<double>(p)));
    ASSERT_NE(object.certainty(p), Certainty::kOutside) << k;
    ++inside;
  }
  EXPECT_EQ(inside, 1001);
  EXPECT_EQ(object.certainty({0, 0, 0.1F}), Certainty::kInside);
  EXPECT_EQ(object.certainty({0, 0, 0.8F}), Certainty::kOutside);
  EXPECT_EQ(object.certainty(cast<float>(tip_m)), Certainty::kUnsure);
}

// Within a ball of known radius the sides are known without an oracle: no formula of the cells is used.
TEST(SurfaceBounds, LeaveAThinShellOfABallUnsure) {
  const Bounded bounded(test::sphere(0.7, 5), {{1, 1, 1}, 0.7, 0.7}, 16);
  const runtime::Object object = bounded.object();
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  double least_m = 1, most_m = 0;
  for (int i = 0; i < 100000; ++i) {
    const Vec3f p = cast<float>(Vec3d{unit(random), unit(random), unit(random)});
    const double radius_m = norm(cast<double>(p));
    const Certainty told = object.certainty(p);
    if (radius_m < 0.69) {
      EXPECT_NE(told, Certainty::kOutside);
    } else if (radius_m > 0.7001) {
      EXPECT_NE(told, Certainty::kInside);
    }
    if (told == Certainty::kUnsure) {
      least_m = std::min(least_m, radius_m);
      most_m = std::max(most_m, radius_m);
    }
  }
  EXPECT_GT(least_m, 0.68);
  EXPECT_LT(most_m, 0.72);
}

TEST(SurfaceBounds, FollowTheMeshThroughScaleAndDistance) {
  const Bounded unit(test::torus(0.7, 0.2, 48, 24), {{1, 1, 0.3}, 0.6, 1}, 10);
  for (const double scale : {1e-6, 1e6}) {
    const Bounded scaled(test::transformed(test::torus(0.7, 0.2, 48, 24), {}, scale),
                         {{scale, scale, 0.3 * scale}, 0.6, 1}, 10);
    std::size_t same = 0;
    for (std::size_t k = 0; k < unit.asset.parts[0].bounds.cell.size(); ++k)
      same += unit.asset.parts[0].bounds.cell[k] == scaled.asset.parts[0].bounds.cell[k];
    EXPECT_GT(same, unit.asset.parts[0].bounds.cell.size() * 95 / 100);
    EXPECT_NEAR(scaled.asset.parts[0].bounds.tolerance_m, scale * unit.asset.parts[0].bounds.tolerance_m,
                1e-9 * scale);
  }
}

BakeOptions conservative_options() {
  BakeOptions options;
  options.sample_count = 500;
  options.conservative = true;
  return options;
}

TEST(ConservativeBake, NeedsAClosedMesh) {
  Mesh open = test::sphere(1, 3);
  open.faces.pop_back();
  open.source_face.pop_back();
  BakeOptions options = conservative_options();
  options.repair.policy = Repair::kSafe;
  auto refused = bake(test::as_source(open), options);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().status, Status::kInvalidMesh);
  EXPECT_NE(refused.error().finding.find("3 open edges"), std::string::npos) << refused.error().finding;
  options.repair.policy = Repair::kAll;
  EXPECT_TRUE(bake(test::as_source(open), options).ok());
}

TEST(ConservativeBake, ChangesNothingButTheBounds) {
  const Mesh mesh = test::torus(1, 0.3, 48, 24);
  BakeOptions options = conservative_options();
  auto with = bake(test::as_source(mesh), options);
  options.conservative = false;
  auto without = bake(test::as_source(mesh), options);
  ASSERT_TRUE(with.ok() && without.ok());
  EXPECT_EQ(without.value().asset.provenance.options_json.find("conservative"), std::string::npos);
  EXPECT_NE(with.value().asset.provenance.options_json.find("\"conservative\":true"), std::string::npos);
  ASSERT_EQ(with.value().asset.parts.size(), without.value().asset.parts.size());
  for (Part& part : with.value().asset.parts) {
    EXPECT_GT(part.bounds.cells, 0U);
    part.bounds = {};
  }
  EXPECT_EQ(with.value().asset.parts, without.value().asset.parts);
}

#ifdef SQMAP_MESH_DIR
// The acceptance test in the small; scripts/check_certainty asks millions of points of each sample.
TEST(ConservativeBake, IsNeverWrongOfTheElephant) {
  auto source = read_mesh(SQMAP_MESH_DIR "/elephant.off");
  ASSERT_TRUE(source.ok()) << source.error().finding;
  auto result = bake(source.value(), conservative_options());
  ASSERT_TRUE(result.ok()) << result.error().finding;
  const Asset& asset = result.value().asset;
  auto object = runtime::Object::build(asset);
  ASSERT_TRUE(object.ok());
  const Mesh mesh = std::move(check_and_repair(source.value()).value().mesh);
  const Oracle oracle(mesh);
  const auto count = [&](const std::vector<Vec3f>& points) {
    const test::CertaintyCount found = test::count_certainty(object.value(), oracle, points);
    EXPECT_EQ(found.wrong, 0U) << "by up to " << found.worst_m << " m";
    EXPECT_EQ(found.contradicted, 0U);
    return found;
  };
  EXPECT_GT(count(test::points_in_box(mesh, 200000, 11)).sure_share(), 0.98);
  EXPECT_GT(count(test::points_in_shell(mesh, 0.03 * asset.r_max_m, 300000, 12)).sure_share(), 0.93);
  count(test::adverse_points(mesh, asset.r_max_m, 500000, 13));
}
#endif

}  // namespace
}  // namespace sqmap::bake
