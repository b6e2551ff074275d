// SPDX-License-Identifier: GPL-3.0-or-later
#include "sqmap/bake/oracle.hpp"

#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>
#include <random>
#include <thread>

#include <gtest/gtest.h>

#include "mesh_boxes.hpp"
#include "support/shapes.hpp"

#ifndef SQMAP_MESH_DIR
#define SQMAP_MESH_DIR ""
#endif

namespace sqmap::bake {
namespace {

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double in(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
  }
  Vec3d point(double half) { return {in(-half, half), in(-half, half), in(-half, half)}; }
  Vec3d direction() {
    for (;;) {
      const Vec3d p = point(1);
      if (norm(p) > 0.1 && norm(p) < 1) return normalized(p);
    }
  }
  std::size_t below(std::size_t count) { return engine_() % count; }

 private:
  std::mt19937_64 engine_;
};

/// Signed distance of an axis-aligned box, negative inside.
double box_distance_m(const Vec3d& p, const Vec3d& half) {
  const Vec3d q{std::abs(p.x) - half.x, std::abs(p.y) - half.y, std::abs(p.z) - half.z};
  const Vec3d out{std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0)};
  return norm(out) + std::min(std::max({q.x, q.y, q.z}), 0.0);
}

/// Sum of solid angles over 4 pi, from the spherical excess of each triangle by its dihedral angles.
double winding_by_dihedral_angles(const Mesh& mesh, const Vec3d& p) {
  double sum = 0;
  for (const auto& face : mesh.faces) {
    const Vec3d a = normalized(mesh.vertices_m[face[0]] - p), b = normalized(mesh.vertices_m[face[1]] - p),
                c = normalized(mesh.vertices_m[face[2]] - p);
    const auto angle = [](const Vec3d& at, const Vec3d& to, const Vec3d& other) {
      const Vec3d u = cross(at, to), v = cross(at, other);
      return std::atan2(norm(cross(u, v)), dot(u, v));
    };
    const double excess = angle(a, b, c) + angle(b, c, a) + angle(c, a, b) - std::numbers::pi;
    sum += dot(a, cross(b, c)) < 0 ? -excess : excess;
  }
  return sum / (4 * std::numbers::pi);
}

TEST(Oracle, SignedDistanceIsThatOfTheBox) {
  const Vec3d half{1, 2, 3};
  const Oracle oracle(test::box(half));
  Random random(1);
  int inside = 0;
  for (int i = 0; i < 5000; ++i) {
    const Vec3d p = random.point(4);
    const double expected_m = box_distance_m(p, half);
    EXPECT_NEAR(oracle.signed_distance(p), expected_m, 1e-13);
    inside += expected_m < 0;
  }
  EXPECT_GT(inside, 200);
  EXPECT_LT(inside, 4800);
}

TEST(Oracle, NearestLiesOnItsFaceAtTheDistance) {
  const Mesh mesh = test::torus(2, 0.5, 32, 16);
  const Oracle oracle(mesh);
  Random random(2);
  for (int i = 0; i < 500; ++i) {
    const Vec3d p = random.point(3);
    const Oracle::Answer answer = oracle.nearest(p);
    EXPECT_NEAR(norm(p - answer.nearest_m), answer.distance_m, 1e-14);
    const auto& [a, b, c] = mesh.faces[answer.face];
    const Vec3d &pa = mesh.vertices_m[a], &pb = mesh.vertices_m[b], &pc = mesh.vertices_m[c];
    const auto area = [](const Vec3d& x, const Vec3d& y, const Vec3d& z) {
      return norm(cross(y - x, z - x));
    };
    // A point of the triangle cuts it into three parts that together have its area; one off it makes them
    // larger.
    EXPECT_NEAR(
        area(answer.nearest_m, pb, pc) + area(pa, answer.nearest_m, pc) + area(pa, pb, answer.nearest_m),
        area(pa, pb, pc), 1e-12);
    for (int k = 0; k < 200; ++k) {  // no sampled point of the surface is nearer
      const auto& face = mesh.faces[random.below(mesh.faces.size())];
      const double u = random.in(0, 1), v = random.in(0, 1 - u);
      const Vec3d q = mesh.vertices_m[face[0]] + u * (mesh.vertices_m[face[1]] - mesh.vertices_m[face[0]]) +
                      v * (mesh.vertices_m[face[2]] - mesh.vertices_m[face[0]]);
      EXPECT_GE(norm(p - q), answer.distance_m - 1e-12);
    }
  }
}

TEST(Oracle, InsideKnowsHolesAndCavities) {
  const Oracle torus(test::torus(2, 0.5, 64, 32));
  EXPECT_FALSE(torus.inside({0, 0, 0}));
  EXPECT_TRUE(torus.inside({2, 0, 0}));
  EXPECT_TRUE(torus.inside({0, -2.4, 0.1}));
  EXPECT_FALSE(torus.inside({0, -2.6, 0}));
  EXPECT_NEAR(torus.winding_number({2, 0, 0}), 1, 0.01);

  const Oracle hollow(test::hollow_box({1, 1, 1}, 0.25));
  EXPECT_FALSE(hollow.inside({0, 0, 0}));
  EXPECT_TRUE(hollow.inside({0.9, 0, 0}));
  EXPECT_FALSE(hollow.inside({1.1, 0, 0}));
  EXPECT_NEAR(hollow.winding_number({0, 0, 0}), 0, 0.01);
}

// The solid angle of a disc of radius r from height h on its axis is 2 pi (1 - h / sqrt(h^2 + r^2)).
TEST(Oracle, WindingNumberOfAnOpenDiscIsItsSolidAngle) {
  Mesh disc;
  const std::uint32_t segments = 2000;
  for (std::uint32_t i = 0; i < segments; ++i) {
    const double angle_rad = 2 * std::numbers::pi * i / segments;
    disc.vertices_m.push_back({std::cos(angle_rad), std::sin(angle_rad), 0});
    disc.faces.push_back({segments, i, (i + 1) % segments});
  }
  disc.vertices_m.push_back({0, 0, 0});
  const Oracle oracle(disc);
  for (const double h : {0.01, 0.3, 1.0, 3.0, 30.0}) {
    const double share = 0.5 * (1 - h / std::sqrt(h * h + 1));
    EXPECT_NEAR(oracle.winding_number({0, 0, -h}), share, 0.002) << h;
    EXPECT_NEAR(oracle.winding_number({0, 0, h}), -share, 0.002) << h;
  }
}

TEST(Oracle, WindingNumberErrorIsBelowOneHundredth) {
  const Mesh spring = test::spring(1, 0.15, 0.5, 4, 48, 16);
  Mesh holed = test::sphere(1.5, 4);
  holed.faces.resize(holed.faces.size() * 3 / 4);
  Mesh slivers = test::cylinder(0.4, 2, 500);  // less a fourth
  std::erase_if(slivers.faces, [](const auto& face) { return face[0] % 4 == 0; });
  Random random(3);
  for (const Mesh& mesh : {spring, holed, slivers}) {
    const Oracle oracle(mesh);
    double worst = 0;
    for (int i = 0; i < 600; ++i) {
      const Vec3d p = random.point(2.2);
      worst = std::max(worst, std::abs(oracle.winding_number(p) - winding_by_dihedral_angles(mesh, p)));
    }
    EXPECT_LT(worst, 0.01);
  }
}

TEST(Oracle, RoundedWindingNumberIsTheNearestIntegerOfTheSum) {
  const Mesh torus = test::torus(2, 0.5, 48, 24);
  Mesh half = torus;  // open
  half.faces.resize(half.faces.size() / 2);
  const Mesh overlapping =
      test::joined({torus, test::box({1, 1, 1}, {2, 0, 0}), test::sphere(0.8, 3, {2, 0, 0})});
  for (const Mesh& mesh : {torus, half, overlapping}) {
    const Oracle oracle(mesh);
    Random random(15);
    std::size_t wrong = 0, not_zero = 0;
    for (int i = 0; i < 3000; ++i) {
      const Vec3d p{random.in(-3, 3), random.in(-3, 3), random.in(-0.6, 0.6)};
      const double winding = winding_by_dihedral_angles(mesh, p);
      if (std::abs(winding - std::floor(winding) - 0.5) < 0.01) continue;
      wrong += oracle.rounded_winding_number(p) != std::lround(winding);
      not_zero += std::lround(winding) != 0;
    }
    EXPECT_EQ(wrong, 0U);
    EXPECT_GT(not_zero, 150U);
  }
}

TEST(Oracle, KnowingABoundOfTheDistanceChangesNoAnswer) {
  const Oracle oracle(test::torus(2, 0.5, 32, 16));
  Random random(14);
  for (int i = 0; i < 1000; ++i) {
    const Vec3d p = random.point(3);
    const Oracle::Answer free = oracle.nearest(p);
    for (const double more : {1.0, 1 + 1e-12, 1.5}) {
      const Oracle::Answer bounded = oracle.nearest(p, more * free.distance_m);
      EXPECT_EQ(bounded.distance_m, free.distance_m);
      EXPECT_EQ(bounded.face, free.face);
    }
  }
}

TEST(Oracle, NearestIsExactHoweverFarThePoint) {
  const Oracle oracle(test::box({1, 2, 3}));
  for (const double far_m : {2.0, 1e2, 5e3, 1e4, 1e9, 1e15}) {
    EXPECT_NEAR(oracle.nearest({far_m, 0.3, 0.1}).distance_m, far_m - 1, 2e-15 * far_m) << far_m;
    const Oracle::Answer corner = oracle.nearest({far_m, far_m + 1, far_m + 2});
    EXPECT_NEAR(corner.distance_m / ((far_m - 1) * std::sqrt(3.0)), 1, 1e-14) << far_m;
    EXPECT_NEAR(norm(corner.nearest_m - Vec3d{1, 2, 3}), 0, 1e-14) << far_m;
  }
}

TEST(Oracle, AnswersScaleWithTheMeshAndItsPlace) {
  const Mesh mesh = test::l_shape(1, 0.3);
  const Oracle base(mesh);
  Random random(4);
  for (const double scale : {1e-9, 1e9}) {
    const Vec3d shift = scale * Vec3d{1000, -2000, 500};
    const Oracle oracle(test::transformed(mesh, {{}, shift}, scale));
    for (int i = 0; i < 300; ++i) {
      const Vec3d p = random.point(1.5);
      const double expected_m = base.signed_distance(p);
      if (std::abs(expected_m) < 1e-6) continue;  // the sign is the rounding's
      EXPECT_NEAR(oracle.signed_distance(scale * p + shift) / scale, expected_m, 1e-9);
    }
  }
}

TEST(Oracle, HasNoAnswerForPointsThatAreNotFinite) {
  const Oracle oracle(test::box({1, 1, 1}));
  for (const double x : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_TRUE(std::isnan(oracle.signed_distance({x, 0, 0})));
    EXPECT_FALSE(oracle.inside({0, x, 0}));
  }
  EXPECT_NEAR(oracle.signed_distance({1e12, 0, 0}), 1e12, 1);
  EXPECT_TRUE(std::isnan(Oracle(Mesh{}).signed_distance({0, 0, 0})));
}

TEST(Oracle, ThreadsGetTheSameAnswers) {
  const Mesh mesh = test::torus(2, 0.5, 48, 24);
  const Oracle oracle(mesh);
  const RayTracer tracer(mesh);
  const auto run = [&](std::vector<double>& out) {
    Random random(5);
    std::vector<RayTracer::Hit> hits;
    for (int i = 0; i < 2000; ++i) {
      const Vec3d p = random.point(3);
      out.push_back(oracle.signed_distance(p));
      tracer.trace(p, random.direction(), hits);
      for (const RayTracer::Hit& hit : hits) out.push_back(hit.t_m);
    }
  };
  std::vector<double> one, other, third;
  std::thread thread([&] { run(one); });
  run(other);
  thread.join();
  run(third);
  EXPECT_EQ(one, other);
  EXPECT_EQ(one, third);
}

/// Leaving less entering hits of a ray: the winding number where it starts.
int leaving(const std::vector<RayTracer::Hit>& hits) {
  int count = 0;
  for (const RayTracer::Hit& hit : hits) count += hit.entering ? -1 : 1;
  return count;
}

void expect_alternating(const std::vector<RayTracer::Hit>& hits, std::size_t count) {
  ASSERT_EQ(hits.size(), count);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    EXPECT_EQ(hits[i].entering, i % 2 == 0);
    EXPECT_GE(hits[i].t_m, hits[i > 0 ? i - 1 : 0].t_m);
  }
}

TEST(RayTracer, CrossesATorusFourTimes) {
  const RayTracer tracer(test::torus(2, 0.5, 512, 256));
  std::vector<RayTracer::Hit> hits;
  tracer.trace({-5, 0.001, 0.002}, {1, 0, 0}, hits);
  expect_alternating(hits, 4);
  const double expected_m[] = {2.5, 3.5, 6.5, 7.5};
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(hits[i].t_m, expected_m[i], 1e-3);
  tracer.trace({0.001, 0.002, 5}, {0, 0, -1}, hits);
  EXPECT_TRUE(hits.empty());
}

TEST(RayTracer, ALineIsTheRayAndTheRayBackwards) {
  const RayTracer tracer(test::torus(2, 0.5, 64, 32));
  std::vector<RayTracer::Hit> line, ahead, behind;
  const Vec3d origin{0.1, 0.2, 0.05}, direction = normalized(Vec3d{0.8, -0.5, 0.03});
  tracer.trace_line(origin, direction, line);
  tracer.trace(origin, direction, ahead);
  tracer.trace(origin, -direction, behind);
  ASSERT_EQ(ahead.size(), 2U);
  ASSERT_EQ(behind.size(), 2U);
  ASSERT_EQ(line.size(), 4U);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_NEAR(line[1 - k].t_m, -behind[k].t_m, 1e-12);
    EXPECT_NE(line[1 - k].entering, behind[k].entering);
    EXPECT_NEAR(line[2 + k].t_m, ahead[k].t_m, 1e-12);
    EXPECT_EQ(line[2 + k].entering, ahead[k].entering);
  }
}

void expect_together_as_alone(const Mesh& mesh, const std::vector<RayTracer::Ray>& lines) {
  const RayTracer tracer(mesh);
  std::vector<std::vector<RayTracer::Hit>> together(lines.size(), std::vector<RayTracer::Hit>(3));
  tracer.trace_lines(lines, together);
  std::vector<RayTracer::Hit> alone;
  std::size_t count = 0;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    tracer.trace_line(lines[k].origin_m, lines[k].direction, alone);
    ASSERT_EQ(together[k].size(), alone.size()) << k;
    for (std::size_t i = 0; i < alone.size(); ++i) {
      EXPECT_EQ(together[k][i].t_m, alone[i].t_m);
      EXPECT_EQ(together[k][i].face, alone[i].face);
      EXPECT_EQ(together[k][i].entering, alone[i].entering);
    }
    count += alone.size();
  }
  EXPECT_GT(count, lines.size() / 2);
}

TEST(RayTracer, LinesTogetherMeetWhatTheyMeetAlone) {
  std::vector<RayTracer::Ray> parallel, around, any;
  Random random(12);
  for (int k = 0; k < 200; ++k) {
    parallel.push_back({{-1.01 + 0.0131 * k, -0.9 + 0.008 * k, 1.1}, {0, 0, -1}});
    any.push_back({random.point(0.5), random.direction()});
    // The normals of a rounded box: along an axis for most of the way round.
    const double angle = 2 * std::numbers::pi * k / 200;
    const Vec3d out = normalized(Vec3d{std::pow(std::cos(angle), 39), std::pow(std::sin(angle), 39), 0});
    around.push_back({1.01 / std::max(std::abs(out.x), std::abs(out.y)) * out + Vec3d{0, 0, 0.1}, -out});
  }
  any[20].direction = {0, 0, 0};  // none
  for (const auto& lines : {parallel, around, any}) {
    expect_together_as_alone(test::box({1, 1, 1}), lines);
    expect_together_as_alone(test::torus(0.7, 0.3, 64, 32), lines);
  }
}

// Embree cuts packets where vectors are narrow. The last packet is not full.
TEST(MeshBoxes, RaysMeetTheSameWithNarrowVectors) {
  const Mesh mesh = test::torus(0.7, 0.3, 64, 32);
  std::vector<RayTracer::Ray> lines;
  Random random(13);
  for (int k = 0; k < 37; ++k) lines.push_back({random.point(0.5), random.direction()});
  lines[20].direction = {0, 0, 0};  // none
  std::vector<std::vector<RayTracer::Hit>> expected(lines.size());
  const RayTracer tracer(mesh);
  std::size_t count = 0;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    tracer.trace_line(lines[k].origin_m, lines[k].direction, expected[k]);
    count += expected[k].size();
  }
  EXPECT_GT(count, lines.size());
  for (const char* widest : {"sse4.2", "avx2"}) {
    std::vector<std::vector<RayTracer::Hit>> hits(lines.size());
    MeshBoxes(mesh, widest).trace(lines, true, hits);
    for (std::size_t k = 0; k < lines.size(); ++k) {
      ASSERT_EQ(hits[k].size(), expected[k].size()) << widest << ' ' << k;
      for (std::size_t i = 0; i < hits[k].size(); ++i) EXPECT_EQ(hits[k][i].t_m, expected[k][i].t_m);
    }
  }
}

TEST(RayTracer, CrossesAHollowBoxFourTimes) {
  const RayTracer tracer(test::hollow_box({1, 1, 1}, 0.25));
  std::vector<RayTracer::Hit> hits;
  for (const Vec3d& aim :
       {Vec3d{0.1, 0.2, 0}, Vec3d{0, 0, 0}, Vec3d{0.3, 0.3, 0}}) {  // off and on the diagonals
    tracer.trace(aim - Vec3d{0, 0, 3}, {0, 0, 1}, hits);
    expect_alternating(hits, 4);
    const double expected_m[] = {2, 2.25, 3.75, 4};
    for (std::size_t i = 0; i < 4; ++i) EXPECT_DOUBLE_EQ(hits[i].t_m, expected_m[i]);
  }
}

// Through corners, middles of edges and diagonals of a box, from all around: a convex body has one way in and
// one out.
TEST(RayTracer, CornersAndEdgesCountOnce) {
  const RayTracer box(test::box({1, 1, 1})), ball(test::sphere(1, 2));
  const Mesh sphere = test::sphere(1, 2);
  std::vector<RayTracer::Hit> hits;
  for (int i = 1; i < 27; ++i) {
    const int row = i / 3 % 3, layer = i / 9;
    const Vec3d aim{double(i % 3 - 1), double(row - 1), double(layer - 1)};
    if (norm(aim) == 0) continue;
    box.trace(3.0 * aim, -normalized(aim), hits);
    expect_alternating(hits, 2);
    box.trace({0, 0, 0}, normalized(aim), hits);
    ASSERT_EQ(hits.size(), 1U);
    EXPECT_NEAR(hits[0].t_m, norm(aim), 1e-15);
  }
  for (const auto& face : sphere.faces)
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3d corner = sphere.vertices_m[face[k]];
      const Vec3d middle = 0.5 * (corner + sphere.vertices_m[face[(k + 1) % 3]]);
      for (const Vec3d& aim : {corner, middle}) {
        ball.trace({0, 0, 0}, normalized(aim), hits);
        ASSERT_EQ(hits.size(), 1U);
        EXPECT_NEAR(hits[0].t_m, norm(aim), 1e-14);
        ball.trace(4.0 * aim, -normalized(aim), hits);
        expect_alternating(hits, 2);
      }
    }
}

TEST(RayTracer, GrazingAnEdgeIsNoCrossing) {
  const RayTracer tracer(test::box({1, 1, 1}));
  std::vector<RayTracer::Hit> hits;
  const double r = std::sqrt(0.5);
  tracer.trace({0, 3, -1}, {r, -r, 0}, hits);  // passes x + y = 3
  EXPECT_TRUE(hits.empty());
  tracer.trace({0, 2, 0.3}, {r, -r, 0}, hits);  // touches the edge x = y = 1
  EXPECT_TRUE(hits.empty());
  tracer.trace({-2, 1, 0}, {1, 0, 0}, hits);  // slides along a face
  EXPECT_EQ(hits.size() % 2, 0U);
  tracer.trace({1, 1, -3}, {0, 0, 1}, hits);  // slides along an edge
  EXPECT_EQ(hits.size() % 2, 0U);
}

// Rays at vertices of a shape with silhouettes everywhere: the signed count is the winding number at the
// start, which the oracle finds from solid angles. Float tests miss all faces round the vertex for about 1 %
// of such rays.
void expect_counts_to_agree(const Mesh& mesh, int rays, std::uint64_t seed) {
  const Oracle oracle(mesh);
  const RayTracer tracer(mesh);
  Random random(seed);
  Vec3d low = mesh.vertices_m[0], high = low;
  for (const Vec3d& p : mesh.vertices_m)
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], p[axis]);
      high[axis] = std::max(high[axis], p[axis]);
    }
  std::vector<RayTracer::Hit> hits;
  int inside = 0, wrong = 0;
  for (int i = 0; i < rays; ++i) {
    const Vec3d p{random.in(low.x, high.x), random.in(low.y, high.y), random.in(low.z, high.z)};
    const Vec3d target = mesh.vertices_m[random.below(mesh.vertices_m.size())];
    const int winding = static_cast<int>(std::lround(oracle.winding_number(p)));
    tracer.trace(p, normalized(target - p), hits);
    wrong += leaving(hits) != winding;
    tracer.trace(p, random.direction(), hits);
    wrong += leaving(hits) != winding;
    inside += winding != 0;
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(inside, rays / 50);
  EXPECT_LT(inside, rays - rays / 50);
}

TEST(RayTracer, CountsAgreeWithTheWindingNumber) {
  expect_counts_to_agree(test::spring(1, 0.25, 0.7, 3, 48, 16), 4000, 6);
  expect_counts_to_agree(test::torus(2, 0.7, 48, 24), 4000, 7);
  expect_counts_to_agree(test::translated(test::two_spheres(1, 0.6, 32), {1e6, -1e6, 3e6}), 1000, 8);
  expect_counts_to_agree(test::transformed(test::l_shape(1, 0.3), {}, 1e-9), 1000, 9);
}

TEST(RayTracer, CountsAgreeWithTheWindingNumberOnRealMeshes) {
  const std::filesystem::path folder = SQMAP_MESH_DIR;
  if (folder.empty()) GTEST_SKIP() << "set SQMAP_MESH_DIR to the data/meshes folder of libcgal-demo";
  for (const char* name : {"elephant.off", "camel.off", "dino.off"}) {
    const Result<SourceMesh> source = read_mesh(folder / name);
    ASSERT_TRUE(source.ok()) << source.error().finding;
    const Result<PreparedMesh> prepared = check_and_repair(source.value());
    ASSERT_TRUE(prepared.ok()) << prepared.error().finding;
    expect_counts_to_agree(prepared.value().mesh, 3000, 10);
  }
}

TEST(RayTracer, DistancesAreExactNearAndFar) {
  const RayTracer tracer(test::box({1, 1, 1}));
  std::vector<RayTracer::Hit> hits;
  for (const double far_m : {1.0, 2.0, 1e3, 1e6, 1e9}) {
    tracer.trace({-far_m, 0.3, 0.1}, {1, 0, 0}, hits);
    ASSERT_EQ(hits.size(), 2U) << far_m;
    EXPECT_NEAR(hits[0].t_m, far_m - 1, 1e-15 * far_m);
    EXPECT_NEAR(hits[1].t_m, far_m + 1, 1e-15 * far_m);
  }
  tracer.trace({1, 0.3, 0.1}, {1, 0, 0}, hits);  // starts on the surface
  ASSERT_EQ(hits.size(), 1U);
  EXPECT_EQ(hits[0].t_m, 0);
  EXPECT_FALSE(hits[0].entering);
}

TEST(RayTracer, SeesAThinSheetTwice) {
  const RayTracer tracer(test::thin_sheet(1, 1e-9));
  std::vector<RayTracer::Hit> hits;
  tracer.trace({0.1, 0.2, 1}, {0, 0, -1}, hits);
  expect_alternating(hits, 2);
  EXPECT_NEAR(hits[1].t_m - hits[0].t_m, 1e-9, 1e-15);
}

TEST(RayTracer, HasNoHitsForRaysThatAreNone) {
  const RayTracer tracer(test::box({1, 1, 1}));
  std::vector<RayTracer::Hit> hits(3);
  const double nan = std::nan("");
  tracer.trace({0, 0, 0}, {0, 0, 0}, hits);
  EXPECT_TRUE(hits.empty());
  tracer.trace({0, 0, 0}, {nan, 0, 1}, hits);
  EXPECT_TRUE(hits.empty());
  tracer.trace({nan, 0, 0}, {0, 0, 1}, hits);
  EXPECT_TRUE(hits.empty());
  RayTracer(Mesh{}).trace({0, 0, 0}, {0, 0, 1}, hits);
  EXPECT_TRUE(hits.empty());
}

}  // namespace
}  // namespace sqmap::bake
