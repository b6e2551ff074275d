// SPDX-License-Identifier: GPL-3.0-or-later
#include "map_builder.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "sqmap/runtime/object.hpp"

#include "map_budget.hpp"
#include "part_builder.hpp"
#include "solid.hpp"
#include "support/shapes.hpp"

namespace sqmap::bake {
namespace {

/// A mesh with its queries, kept together.
struct Scene {
  Mesh mesh;
  RayTracer rays;
  Oracle oracle;
  OpenPlaces open;
  explicit Scene(Mesh m) : mesh(std::move(m)), rays(mesh), oracle(mesh), open(mesh) {}
  MeshQueries queries() const { return {mesh, rays, oracle, open}; }
};

Part part_around(const Superquadric& shape) {
  Part part;
  part.shape = shape;
  part.sphere = {{}, bounding_radius_m(shape)};
  return part;
}

TEST(TraceMap, MeasuresTheGapBetweenConcentricSpheres) {
  const Scene scene(test::sphere(0.8, 5));
  const RayField field = trace_map({{1, 1, 1}, 1, 1}, {}, 17, 32, scene.queries());
  for (std::uint32_t k = 0; k < 17 * 32; ++k) {
    ASSERT_TRUE(field.has_hit(k));
    EXPECT_NEAR(field.first_depth_m(k), 0.2, 2e-3);
    EXPECT_EQ(field.start_inside[k], 0);
    EXPECT_NEAR(field.reach_m[k], 1, 0.02) << "the medial axis of a sphere is its centre";
  }
}

TEST(TraceMap, ReachEndsAtTheMedialAxisOfABox) {
  // A nearly box-shaped superquadric 2 x 2 x 1: under the middle of its top the medial axis is half the
  // height below.
  const Scene scene(test::sphere(0.3, 3));
  const RayField field = trace_map({{2, 2, 0.5}, 0.1, 0.1}, {}, 33, 64, scene.queries());
  EXPECT_NEAR(field.reach_m[std::size_t{32} * 64], 0.5, 0.01);
}

TEST(TraceMap, TexelsInsideTheMeshSaySo) {
  const Scene scene(test::sphere(1, 5));
  Pose pose;
  pose.translation_m = {0.9, 0, 0};  // half of this small superquadric lies in the ball
  const RayField field = trace_map({{0.3, 0.3, 0.3}, 1, 1}, pose, 17, 32, scene.queries());
  int inside = 0;
  const MapGrid grid({{0.3, 0.3, 0.3}, 1, 1}, 17, 32);
  for (std::uint32_t row = 0; row < 17; ++row) {
    for (std::uint32_t col = 0; col < 32; ++col) {
      const double r = norm(grid.point(row, col) + pose.translation_m);
      if (std::abs(r - 1) < 0.01) continue;
      EXPECT_EQ(field.start_inside[row * 32 + col] != 0, r < 1);
      inside += r < 1;
    }
  }
  EXPECT_GT(inside, 100);
}

TEST(Quantise, KeepsDepthsWithinHalfAStepAndLevelsNested) {
  const Scene scene(test::ellipsoid({0.5, 0.7, 0.9}, 5));
  const RayField field = trace_map({{1, 1, 1}, 0.8, 0.8}, {}, 65, 128, scene.queries());
  const DistanceMap map = quantise(field, {2, 2, 10});
  EXPECT_EQ(map.rows, 33U);
  EXPECT_EQ(map.cols, 64U);
  EXPECT_EQ((map.rows - 1) % (2U << (map.level_count - 1)), 0U);
  EXPECT_EQ(map.cols % (4U << (map.level_count - 1)), 0U);
  for (std::uint32_t row = 0; row < map.rows; ++row) {
    for (std::uint32_t col = 0; col < map.cols; ++col) {
      const std::uint32_t texel = 2 * row * 128 + 2 * col;
      ASSERT_TRUE(field.has_hit(texel));
      EXPECT_NEAR(map.depth_m(map.code[row * map.cols + col]), field.first_depth_m(texel),
                  0.501 * map.depth_step_m);
    }
  }
}

TEST(Quantise, CoincidingCrossingsKeepTheParity) {
  RayField field;
  field.rows = 3;
  field.cols = 4;
  field.start_inside.assign(12, 0);
  field.reach_m.assign(12, 1);
  field.first.push_back(0);
  for (std::uint32_t texel = 0; texel < 12; ++texel) {
    // A skin thinner than a step, then a wall; one texel spans the range of depths.
    const std::vector<double> depths =
        texel == 0 ? std::vector<double>{0.0, 1.0} : std::vector<double>{0.5, 0.5001, 0.8, 0.9};
    field.depth_m.insert(field.depth_m.end(), depths.begin(), depths.end());
    field.first.push_back(static_cast<std::uint32_t>(field.depth_m.size()));
  }
  const DistanceMap map = quantise(field, {1, 1, 6});
  EXPECT_NEAR(map.depth_m(map.code[5]), 0.8, map.depth_step_m) << "the skin is dropped, both of its sides";
  int later = 0;
  for (const auto& crossing : map.crossings) later += crossing.texel == 5;
  EXPECT_EQ(later, 1);
}

TEST(MeshQueries, LinesTellTheSameInsideAsWindingNumbers) {
  Mesh pierced = test::sphere(1, 4);  // one small hole, where 5 faces are missing
  pierced.faces.resize(pierced.faces.size() - 5);
  Mesh bowl = test::sphere(1, 3);
  std::erase_if(bowl.faces, [&](const auto& f) { return bowl.vertices_m[f[0]].z > 0.2; });
  for (const Mesh& mesh : {test::torus(1, 0.3, 64, 32), test::hollow_box({1, 1, 1}, 0.25), pierced, bowl}) {
    const Scene scene(mesh);
    const MeshQueries queries = scene.queries();
    std::mt19937 random(5);
    std::uniform_real_distribution<double> within(-1.4, 1.4);
    int inside = 0;
    for (int i = 0; i < 3000; ++i) {
      const Vec3d p{within(random), within(random), within(random)};
      EXPECT_EQ(queries.signed_distance(p) < 0, scene.oracle.inside(p));
      inside += scene.oracle.inside(p);
    }
    EXPECT_GT(inside, 100);
  }
}

constexpr std::uint64_t kNoLimit = std::uint64_t{1} << 40;

/// Each part's own superquadric and no other.
std::vector<std::vector<PlacedShape>> own_shapes(const std::vector<Part>& parts) {
  std::vector<std::vector<PlacedShape>> shapes;
  for (const Part& part : parts) shapes.push_back({{part.shape, part.object_from_part}});
  return shapes;
}

TEST(MapParts, SpendTexelsOnlyWhereTheTargetAsksForThem) {
  const Scene scene(test::box({0.4, 0.5, 0.6}));
  std::vector<Part> parts{part_around({{0.9, 1.0, 1.1}, 0.7, 0.7})};
  const MeshQueries queries = scene.queries();
  MapDrawer drawer(own_shapes(parts), {1.0}, queries);
  EXPECT_FALSE(drawer.draw(parts, {1e-2, kNoLimit}, 1, TexelCost::kAll));
  const auto coarse = parts[0].map.code.size();
  EXPECT_FALSE(drawer.draw(parts, {1e-3, kNoLimit}, 1, TexelCost::kAll));
  EXPECT_GT(parts[0].map.code.size(), 2 * coarse);
  EXPECT_GE(parts[0].map.bits, 8U);
}

TEST(MapParts, GiveTexelsToThePartWithTheLargerShareOfTheSurface) {
  const Scene scene(test::box({0.4, 0.5, 0.6}));
  const Part part = part_around({{0.9, 1.0, 1.1}, 0.7, 0.7});
  std::vector<Part> parts{part, part};
  const MeshQueries queries = scene.queries();
  MapDrawer(own_shapes(parts), {1.0, 20.0}, queries).draw(parts, {2e-3, kNoLimit}, 1, TexelCost::kAll);
  EXPECT_GT(parts[1].map.code.size(), 2 * parts[0].map.code.size());
}

TEST(MapParts, GiveTexelsToThePartWhoseRaysMissWhereThoseTakeNoMemory) {
  const Scene scene(test::box({0.4, 0.5, 0.6}));
  const Part whole = part_around({{0.9, 1.0, 1.1}, 0.7, 0.7});
  Part beside = whole;
  beside.object_from_part.translation_m.x = 1;  // most of its rays pass the box
  const MeshQueries queries = scene.queries();
  const auto share_of = [&](TexelCost cost) {
    std::vector<Part> parts{whole, beside};
    MapDrawer(own_shapes(parts), {1.0, 1.0}, queries).draw(parts, {2e-3, kNoLimit}, 1, cost);
    return double(parts[1].map.code.size()) / double(parts[0].map.code.size());
  };
  EXPECT_GT(share_of(TexelCost::kHeld), 1.2 * share_of(TexelCost::kAll));
}

TEST(MapParts, TakeWhatIsTracedAlreadyOfTheSameShapesOnly) {
  const Scene scene(test::box({0.4, 0.5, 0.6}));
  std::vector<Part> parts{part_around({{0.9, 1.0, 1.1}, 0.7, 0.7}), part_around({{0.8, 1.0, 1.1}, 0.7, 0.7})};
  const MeshQueries queries = scene.queries();
  MapDrawer first(own_shapes(parts), {1.0, 1.0}, queries);
  first.draw(parts, {2e-3, kNoLimit}, 1, TexelCost::kAll);
  const std::vector<Part> drawn = parts;
  std::vector<Part> moved = parts;
  moved[1].object_from_part.translation_m.x = 0.01;
  MapDrawer second(own_shapes(moved), {1.0, 1.0}, queries, first.traced());
  second.draw(moved, {2e-3, kNoLimit}, 1, TexelCost::kAll);
  EXPECT_EQ(moved[0].map, drawn[0].map);
  EXPECT_NE(moved[1].map, drawn[1].map);
  const auto is_known = [&](const auto& t) { return std::ranges::count(first.traced(), t) > 0; };
  const auto known = static_cast<std::size_t>(std::ranges::count_if(second.traced(), is_known));
  EXPECT_GT(known, 0U);
  EXPECT_LT(known, second.traced().size());
}

TEST(MapParts, KeepToTheByteBudgetAndSaySo) {
  const Scene scene(test::box({0.4, 0.5, 0.6}));
  std::vector<Part> parts{part_around({{0.9, 1.0, 1.1}, 0.7, 0.7})};
  const MeshQueries queries = scene.queries();
  EXPECT_TRUE(MapDrawer(own_shapes(parts), {1.0}, queries).draw(parts, {1e-4, 2000}, 1, TexelCost::kAll));
  EXPECT_LE(parts[0].map.code.size() * parts[0].map.bits / 8, 3000U);
}

TEST(VertexSamples, CatchASpikeBetweenTexels) {
  // A thin pyramid on a ball, narrower than a cell: the rays around it miss its tip.
  Mesh mesh = test::sphere(0.6, 4);
  const Vec3d tip = 0.85 * normalized(Vec3d{1, 0.3, 0.2});
  std::uint32_t nearest = 0;
  for (std::uint32_t i = 0; i < mesh.vertices_m.size(); ++i) {
    if (norm(mesh.vertices_m[i] - tip) < norm(mesh.vertices_m[nearest] - tip)) nearest = i;
  }
  mesh.vertices_m[nearest] = (0.85 / 0.6) * mesh.vertices_m[nearest];
  const Vec3d spike_m = mesh.vertices_m[nearest];
  const Scene scene(std::move(mesh));
  Part part = part_around({{1, 1, 1}, 1, 1});
  draft_map(part, scene.queries(), 8);
  const auto told = [&](const Vec3d& p_m, runtime::Layer layer) {
    Asset asset;
    asset.r_max_m = 2;
    asset.sphere = {{}, 1.1};
    asset.parts = {part};
    auto object = runtime::Object::build(asset);
    EXPECT_TRUE(object.ok()) << (object ? "" : object.error().finding);
    return object.value().query(cast<float>(p_m), {layer, 0});
  };
  const auto distance_m = [&] { return std::abs(told(spike_m, runtime::Layer::kThree).signed_distance_m); };
  const Vec3d below_tip_m = 0.9 * spike_m;
  const float without = distance_m();
  EXPECT_FALSE(told(below_tip_m, runtime::Layer::kThree).inside);
  add_vertex_samples(part, scene.queries(), 1e-3);
  EXPECT_FALSE(part.map.vertex_samples.empty());
  EXPECT_GT(without, 0.05F);
  EXPECT_LT(distance_m(), 0.01F);
  // They tell sides, too; layer 2 does not read them.
  EXPECT_TRUE(told(below_tip_m, runtime::Layer::kThree).inside);
  EXPECT_FALSE(told(below_tip_m, runtime::Layer::kTwo).inside);
}

TEST(Solid, SplitsAreClosedAndTheirVolumesAdd) {
  const Mesh mesh = test::torus(1, 0.3, 48, 24);
  auto [set, whole] = SolidSet::whole(mesh);
  const double volume = set.volume_m3(whole);
  EXPECT_NEAR(volume, 2 * 9.8696 * 0.09, 0.03);
  const auto& vertices = set.vertices_m;
  auto [left, right] = set.split(
      whole, [&, &solid = whole](std::size_t k) { return vertices[solid.triangles[k][0]].x < 0.1; });
  EXPECT_NEAR(set.volume_m3(left) + set.volume_m3(right), volume, 1e-12);
  EXPECT_GT(set.volume_m3(left), 0.3 * volume);
  EXPECT_GT(set.volume_m3(right), 0.3 * volume);
  // Cut again, across the first cut's caps: still closed, so the volume does not depend on the origin.
  auto [upper, lower] =
      set.split(left, [&, &solid = left](std::size_t k) { return vertices[solid.triangles[k][0]].z > 0.05; });
  const double sum = set.volume_m3(upper) + set.volume_m3(lower);
  EXPECT_NEAR(sum, set.volume_m3(left), 1e-12);
  SolidSet moved = set;
  for (Vec3d& v : moved.vertices_m) v = v + Vec3d{10, -20, 30};
  EXPECT_NEAR(moved.volume_m3(upper), set.volume_m3(upper), 1e-9);
}

TEST(Solid, InnerPointsLieInTheHullOfSomePart) {
  // What the runtime's guarantee rests on: winding numbers of the closed parts add up to that of the mesh.
  const Scene scene(test::torus(1, 0.3, 48, 24));
  auto [set, whole] = SolidSet::whole(scene.mesh);
  const auto& v = set.vertices_m;
  auto [a, rest] =
      set.split(whole, [&, &solid = whole](std::size_t k) { return v[solid.triangles[k][0]].x < -0.2; });
  auto [b, c] = set.split(rest, [&, &solid = rest](std::size_t k) { return v[solid.triangles[k][0]].y < 0; });
  std::vector<Oracle> parts;
  for (const Solid* solid : {&a, &b, &c}) {
    Mesh mesh;
    mesh.vertices_m = set.vertices_m;
    mesh.faces = solid->triangles;
    mesh.source_face.assign(mesh.faces.size(), 0);
    parts.emplace_back(mesh);
  }
  int inside = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3d p{1.4 * std::sin(1.0 * i), 1.4 * std::sin(1.7 * i + 1), 0.35 * std::sin(2.3 * i + 2)};
    double sum = 0;
    for (const Oracle& part : parts) sum += part.winding_number(p);
    EXPECT_NEAR(sum, scene.oracle.winding_number(p), 0.05);
    inside += scene.oracle.inside(p);
  }
  EXPECT_GT(inside, 200);
}

}  // namespace
}  // namespace sqmap::bake
