// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <limits>
#include <numeric>
#include <set>
#include <utility>

#include <gtest/gtest.h>

#include "sqmap/bake/mesh.hpp"

#include "support/shapes.hpp"

namespace sqmap::bake {
namespace {

using test::as_source;
using test::signed_volume_m3;

PreparedMesh repaired(const Mesh& mesh, const RepairOptions& options = {}) {
  Result<PreparedMesh> prepared = check_and_repair(as_source(mesh), options);
  EXPECT_TRUE(prepared.ok()) << prepared.error().finding;
  return prepared.ok() ? std::move(prepared).value() : PreparedMesh{};
}

/// Each corner of each face a vertex of its own, as STL files have it.
Mesh soup(const Mesh& mesh) {
  Mesh apart;
  for (const auto& face : mesh.faces) {
    const auto first = static_cast<std::uint32_t>(apart.vertices_m.size());
    for (const std::uint32_t v : face) apart.vertices_m.push_back(mesh.vertices_m[v]);
    apart.faces.push_back({first, first + 1, first + 2});
  }
  apart.source_face = mesh.source_face;
  return apart;
}

Mesh without_faces(Mesh mesh, const std::set<std::uint32_t>& dropped) {
  Mesh rest;
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f)
    if (!dropped.contains(f)) rest.faces.push_back(mesh.faces[f]);
  rest.vertices_m = std::move(mesh.vertices_m);
  test::number_faces(rest);
  return rest;
}

/// Every directed edge once, and its opposite too: a closed, consistent, manifold surface.
bool is_closed_and_consistent(const Mesh& mesh) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const auto& face : mesh.faces)
    for (std::size_t k = 0; k < 3; ++k)
      if (!edges.emplace(face[k], face[(k + 1) % 3]).second) return false;
  return std::ranges::all_of(edges, [&](const auto& edge) {
    return edges.contains({edge.second, edge.first});
  });
}

TEST(Repair, LeavesAGoodMeshAsItIs) {
  const Mesh mesh = test::torus(2, 0.5, 24, 12);
  const PreparedMesh prepared = repaired(mesh);
  EXPECT_EQ(prepared.mesh.vertices_m, mesh.vertices_m);
  EXPECT_EQ(prepared.mesh.faces, mesh.faces);
  EXPECT_EQ(prepared.mesh.source_face, mesh.source_face);
  EXPECT_EQ(prepared.component, std::vector<std::uint32_t>(mesh.faces.size(), 0));
  MeshRecord expected;
  expected.source_vertices = expected.vertices = 288;
  expected.source_faces = expected.faces = 576;
  expected.components = 1;
  expected.is_closed = true;
  expected.volume_m3 = prepared.record.volume_m3;
  EXPECT_EQ(prepared.record, expected);
  EXPECT_NEAR(prepared.record.volume_m3, signed_volume_m3(mesh), 1e-12);
}

TEST(Repair, WeldsASoupBackToItsMesh) {
  const Mesh sphere = test::sphere(3, 3, {100, -50, 7});
  const PreparedMesh prepared = repaired(soup(sphere));
  EXPECT_EQ(prepared.record.vertices, 642U);
  EXPECT_EQ(prepared.record.welded_vertices, 3 * 1280U - 642U);
  EXPECT_TRUE(is_closed_and_consistent(prepared.mesh));
  EXPECT_NEAR(prepared.record.volume_m3, signed_volume_m3(test::sphere(3, 3)), 1e-9);
}

TEST(Repair, WeldsWithinTheToleranceAndNotBeyond) {
  Mesh mesh = soup(test::box({1, 1, 1}));
  std::mt19937_64 random(7);
  for (Vec3d& p : mesh.vertices_m)
    for (int axis = 0; axis < 3; ++axis)
      p[axis] += 1e-6 * (static_cast<double>(random() >> 11) * 0x1p-53 - 0.5);
  EXPECT_EQ(repaired(mesh, {.weld_tolerance = 1e-5}).record.vertices, 8U);
  EXPECT_EQ(repaired(mesh, {.weld_tolerance = 1e-8}).record.welded_vertices, 0U);
  EXPECT_EQ(repaired(soup(test::box({1, 1, 1})), {.weld_tolerance = 0}).record.vertices, 8U);
}

// Brute force: every kept vertex is farther than the tolerance from all earlier kept ones; what was welded is
// not.
TEST(Repair, WeldAgreesWithComparingAllPairs) {
  Mesh mesh;
  std::mt19937_64 random(11);
  for (int i = 0; i < 900; ++i) {
    Vec3d p;
    for (int axis = 0; axis < 3; ++axis) p[axis] = static_cast<double>(random() % 1000) / 1000;
    mesh.vertices_m.push_back(p);
  }
  for (std::uint32_t v = 0; v < 900; v += 3) mesh.faces.push_back({v, v + 1, v + 2});
  test::number_faces(mesh);
  Vec3d low{1, 1, 1}, high;
  for (const Vec3d& p : mesh.vertices_m)
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], p[axis]);
      high[axis] = std::max(high[axis], p[axis]);
    }
  const double tolerance = 0.03, tolerance_m = tolerance * norm(high - low);
  std::vector<Vec3d> kept;
  for (const Vec3d& p : mesh.vertices_m)
    if (std::ranges::none_of(kept, [&](const Vec3d& q) { return norm(p - q) <= tolerance_m; }))
      kept.push_back(p);
  const std::uint32_t welded = repaired(mesh, {.weld_tolerance = tolerance}).record.welded_vertices;
  EXPECT_GT(welded, 20U);
  EXPECT_EQ(welded, 900 - kept.size());
}

TEST(Repair, TurnsFlippedFacesBack) {
  for (const std::uint32_t count : {1U, 17U, 600U, 1279U, 1280U}) {
    Mesh mesh = test::sphere(1, 3);
    for (std::uint32_t f = 0; f < count; ++f) std::swap(mesh.faces[f][0], mesh.faces[f][1]);
    const PreparedMesh prepared = repaired(mesh);
    EXPECT_EQ(prepared.record.flipped_faces, count);
    EXPECT_TRUE(is_closed_and_consistent(prepared.mesh));
    EXPECT_NEAR(prepared.record.volume_m3, signed_volume_m3(test::sphere(1, 3)), 1e-12);
  }
}

TEST(Repair, KeepsCavitiesAndTurnsNestsAsAWhole) {
  const Mesh hollow = test::hollow_box({1, 1, 1}, 0.25);
  const double volume_m3 = 8 - 1.5 * 1.5 * 1.5;
  EXPECT_EQ(repaired(hollow).record.flipped_faces, 0U);
  EXPECT_NEAR(repaired(hollow).record.volume_m3, volume_m3, 1e-12);
  EXPECT_EQ(repaired(hollow).record.components, 2U);
  EXPECT_EQ(repaired(test::flipped(hollow)).record.flipped_faces, 24U);
  EXPECT_NEAR(repaired(test::flipped(hollow)).record.volume_m3, volume_m3, 1e-12);
}

TEST(Repair, TurnsASolidWithinACavityOutwards) {
  const Mesh core = test::sphere(0.3, 2);
  const Mesh good = test::joined({test::hollow_box({1, 1, 1}, 0.25), core, test::sphere(1, 2, {5, 0, 0})});
  const Mesh bad = test::joined(
      {test::hollow_box({1, 1, 1}, 0.25), test::flipped(core), test::flipped(test::sphere(1, 2, {5, 0, 0}))});
  EXPECT_EQ(repaired(good).record.flipped_faces, 0U);
  EXPECT_EQ(repaired(bad).record.flipped_faces, 2 * 320U);
  EXPECT_NEAR(repaired(bad).record.volume_m3, repaired(good).record.volume_m3, 1e-12);
}

TEST(Repair, DropsCopiesOfFacesInEitherDirection) {
  Mesh mesh = test::sphere(1, 2);
  for (std::uint32_t f = 0; f < 10; ++f) {
    auto copy = mesh.faces[std::size_t{7} * f];
    std::rotate(copy.begin(), copy.begin() + 1, copy.end());
    if (f % 2 == 0) std::swap(copy[0], copy[1]);
    mesh.faces.push_back(copy);
  }
  test::number_faces(mesh);
  const PreparedMesh prepared = repaired(mesh);
  EXPECT_EQ(prepared.record.duplicate_faces, 10U);
  EXPECT_TRUE(is_closed_and_consistent(prepared.mesh));
  EXPECT_EQ(*std::ranges::max_element(prepared.mesh.source_face), 319U);
}

TEST(Repair, DoubleSidedModelBecomesASolid) {
  const Mesh sphere = test::sphere(1, 2);
  const PreparedMesh prepared = repaired(test::joined({sphere, test::flipped(sphere)}));
  EXPECT_EQ(prepared.record.duplicate_faces, 320U);
  EXPECT_TRUE(prepared.record.is_closed);
  EXPECT_NEAR(prepared.record.volume_m3, signed_volume_m3(sphere), 1e-12);
}

TEST(Repair, SolidsThatTouchOnAWallBecomeOne) {
  const PreparedMesh prepared =
      repaired(test::joined({test::box({1, 1, 1}), test::box({1, 1, 1}, {2, 0, 0})}));
  EXPECT_EQ(prepared.record.duplicate_faces, 4U);  // two triangles of the wall, from either side
  EXPECT_EQ(prepared.record.components, 1U);
  EXPECT_TRUE(is_closed_and_consistent(prepared.mesh));
  EXPECT_NEAR(prepared.record.volume_m3, 16, 1e-12);
}

TEST(Repair, DoubleSidedFinKeepsOneSide) {
  Mesh mesh = test::box({1, 1, 1});
  const auto tip = static_cast<std::uint32_t>(mesh.vertices_m.size());
  mesh.vertices_m.push_back({3, 3, 3});
  mesh.faces.push_back({mesh.faces[0][0], mesh.faces[0][1], tip});
  mesh.faces.push_back({mesh.faces[0][1], mesh.faces[0][0], tip});
  test::number_faces(mesh);
  EXPECT_EQ(repaired(mesh).record.duplicate_faces, 1U);
  EXPECT_EQ(repaired(mesh).record.faces, 13U);
}

TEST(Repair, FillsHolesAndRestoresTheVolume) {
  const Mesh sphere = test::sphere(1, 4);
  const Mesh holed = without_faces(sphere, {0, 100, 101, 102, 2000, 3000, 3001});
  const PreparedMesh prepared = repaired(holed);
  EXPECT_GT(prepared.record.filled_holes, 2U);
  EXPECT_TRUE(is_closed_and_consistent(prepared.mesh));
  EXPECT_NEAR(prepared.record.volume_m3, signed_volume_m3(sphere), 2e-3);
  const auto new_faces = std::ranges::count(prepared.mesh.source_face, kNewFace);
  EXPECT_EQ(static_cast<std::size_t>(new_faces), prepared.mesh.faces.size() - holed.faces.size());

  const PreparedMesh open = repaired(holed, {.policy = Repair::kSafe});
  EXPECT_EQ(open.record.filled_holes, 0U);
  EXPECT_EQ(open.mesh.faces.size(), holed.faces.size());
  EXPECT_GT(open.record.boundary_edges, 8U);
  EXPECT_FALSE(open.record.is_closed);
}

// A box without its lid, cut fine so that many corners of the loop are collinear: the least area is the flat
// lid.
TEST(Repair, FillOfAFlatHoleIsFlat) {
  Mesh mesh = test::box({1, 2, 3});
  for (int i = 0; i < 3; ++i) mesh = test::subdivided(mesh);
  std::set<std::uint32_t> lid;
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f)
    if (std::ranges::all_of(mesh.faces[f], [&](std::uint32_t v) { return mesh.vertices_m[v].z == 3; }))
      lid.insert(f);
  ASSERT_EQ(lid.size(), 128U);
  const PreparedMesh prepared = repaired(without_faces(mesh, lid));
  EXPECT_EQ(prepared.record.filled_holes, 1U);
  EXPECT_TRUE(is_closed_and_consistent(prepared.mesh));
  EXPECT_NEAR(prepared.record.volume_m3, 48, 1e-12);
  EXPECT_EQ(prepared.record.degenerate_faces, 0U);
}

TEST(Repair, HolesAboveTheLimitStayOpenAndLongOnesGetAFan) {
  Mesh mesh = test::cylinder(1, 2, 400);
  std::set<std::uint32_t> top;
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f)
    if (std::ranges::all_of(mesh.faces[f], [&](std::uint32_t v) { return mesh.vertices_m[v].z == 2; }))
      top.insert(f);
  const Mesh cup = without_faces(mesh, top);
  EXPECT_EQ(repaired(cup).record.boundary_edges, 400U);
  const PreparedMesh closed = repaired(cup, {.max_hole_edges = 400});
  EXPECT_TRUE(is_closed_and_consistent(closed.mesh));
  EXPECT_NEAR(closed.record.volume_m3, signed_volume_m3(mesh), 1e-12);
}

TEST(Repair, SheetsKeepTheirRim) {
  const PreparedMesh sheet = repaired(test::open_sheet(1, 5));
  EXPECT_EQ(sheet.record.filled_holes, 0U);
  EXPECT_EQ(sheet.record.boundary_edges, 20U);
  Mesh triangle;
  triangle.vertices_m = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  triangle.faces = {{0, 1, 2}};
  triangle.source_face = {0};
  EXPECT_EQ(repaired(triangle).record.faces, 1U);
  EXPECT_EQ(repaired(triangle).record.boundary_edges, 3U);
}

TEST(Repair, LoopsThatMeetAtAVertexAreFilledEach) {
  const Mesh sphere = test::sphere(1, 3);
  // Two faces that share a vertex and no edge.
  std::uint32_t other = 0;
  for (std::uint32_t f = 1; f < sphere.faces.size(); ++f) {
    int shared = 0;
    for (const std::uint32_t v : sphere.faces[f])
      shared += static_cast<int>(std::ranges::count(sphere.faces[0], v));
    if (shared == 1) other = f;
  }
  ASSERT_NE(other, 0U);
  const PreparedMesh prepared = repaired(without_faces(sphere, {0, other}));
  EXPECT_EQ(prepared.record.filled_holes, 2U);
  EXPECT_TRUE(is_closed_and_consistent(prepared.mesh));
  EXPECT_NEAR(prepared.record.volume_m3, signed_volume_m3(sphere), 1e-12);
}

// A T-junction: one side of an edge has a vertex on it, the other has not.
TEST(Repair, TJunctionsAreClosed) {
  Mesh mesh = test::box({1, 1, 1});
  const auto [a, b, c] = mesh.faces[0];
  const auto middle = static_cast<std::uint32_t>(mesh.vertices_m.size());
  mesh.vertices_m.push_back(0.5 * (mesh.vertices_m[a] + mesh.vertices_m[b]));
  mesh.faces[0] = {a, middle, c};
  mesh.faces.push_back({middle, b, c});
  test::number_faces(mesh);
  const PreparedMesh prepared = repaired(mesh);
  EXPECT_TRUE(is_closed_and_consistent(prepared.mesh));
  EXPECT_EQ(prepared.record.faces, 14U);
  EXPECT_NEAR(prepared.record.volume_m3, 8, 1e-12);
  EXPECT_EQ(std::ranges::count(prepared.mesh.source_face, kNewFace), 0);
}

TEST(Repair, FlatTrianglesGoWithoutOpeningTheMesh) {
  Mesh mesh = test::box({1, 1, 1});
  // The faces on both sides of an edge a b get a vertex on it that they do not use: a flat triangle fills the
  // slit.
  const auto [a, b, c] = mesh.faces[0];
  const auto middle = static_cast<std::uint32_t>(mesh.vertices_m.size());
  mesh.vertices_m.push_back(0.25 * mesh.vertices_m[a] + 0.75 * mesh.vertices_m[b]);
  mesh.faces[0] = {a, middle, c};
  mesh.faces.push_back({middle, b, c});
  mesh.faces.push_back({a, b, middle});
  mesh.faces.push_back({a, a, b});
  test::number_faces(mesh);
  for (const Repair policy : {Repair::kSafe, Repair::kAll}) {
    const PreparedMesh prepared = repaired(mesh, {.policy = policy});
    EXPECT_EQ(prepared.record.degenerate_faces, 2U);
    EXPECT_TRUE(is_closed_and_consistent(prepared.mesh));
    EXPECT_NEAR(prepared.record.volume_m3, 8, 1e-12);
  }
  const PreparedMesh bare = repaired(mesh, {.policy = Repair::kNone});
  EXPECT_EQ(bare.record.degenerate_faces, 2U);
  EXPECT_EQ(bare.record.boundary_edges, 3U);
}

// The edge that would replace the long side of the flat triangle is there already, on the other side of a
// pillow.
TEST(Repair, RemovingFlatTrianglesDoublesNoEdge) {
  Mesh pillow;
  pillow.vertices_m = {{0, 0, 0}, {2, 0, 0}, {1, 1, 0}, {1, 0, 0}};
  pillow.faces = {{0, 1, 3}, {1, 0, 2}, {0, 3, 2}, {3, 1, 2}};
  const PreparedMesh prepared = repaired(test::joined({pillow, test::sphere(1, 1, {9, 0, 0})}));
  EXPECT_EQ(prepared.record.degenerate_faces, 1U);
  EXPECT_EQ(prepared.record.non_manifold_edges, 0U);
}

TEST(Repair, NonManifoldEdgesAreKeptAndCounted) {
  Mesh mesh = test::box({1, 1, 1});
  const auto tip = static_cast<std::uint32_t>(mesh.vertices_m.size());
  mesh.vertices_m.push_back({3, 3, 3});
  mesh.faces.push_back({mesh.faces[0][0], mesh.faces[0][1], tip});
  test::number_faces(mesh);
  const PreparedMesh prepared = repaired(mesh);
  EXPECT_EQ(prepared.record.faces, 13U);
  EXPECT_EQ(prepared.record.non_manifold_edges, 1U);
  EXPECT_EQ(prepared.record.boundary_edges, 2U);
  EXPECT_EQ(prepared.record.components, 2U);
  EXPECT_FALSE(prepared.record.is_closed);
}

TEST(Repair, ResultDoesNotDependOnSizeOrPlace) {
  Mesh mesh = test::joined({test::hollow_box({1, 1, 1}, 0.25), test::sphere(0.4, 2)});
  mesh = without_faces(soup(mesh), {30, 31, 100});
  for (std::uint32_t f = 0; f < 50; f += 3) std::swap(mesh.faces[f][0], mesh.faces[f][1]);
  const PreparedMesh base = repaired(mesh);
  for (const double scale : {1e-12, 1e-3, 1e3, 1e12}) {
    const PreparedMesh other = repaired(test::transformed(mesh, {{}, {5 * scale, -9 * scale, scale}}, scale));
    EXPECT_EQ(other.mesh.faces, base.mesh.faces);
    EXPECT_EQ(other.record.flipped_faces, base.record.flipped_faces);
    EXPECT_NEAR(other.record.volume_m3 / (scale * scale * scale), base.record.volume_m3, 1e-9);
  }
}

TEST(Repair, ShuffledInputGivesTheSameSurface) {
  const Mesh mesh = without_faces(test::spring(1, 0.2, 0.7, 2, 24, 8), {5, 6, 77, 200});
  const PreparedMesh base = repaired(mesh), other = repaired(test::shuffled(mesh, 5));
  EXPECT_EQ(base.record.filled_holes, other.record.filled_holes);
  EXPECT_EQ(base.record.faces, other.record.faces);
  EXPECT_NEAR(base.record.volume_m3, other.record.volume_m3, 1e-12);
}

TEST(Repair, RefusesMeshesWithoutArea) {
  Mesh line;
  line.vertices_m = {{0, 0, 0}, {0.1, 0.1, 0.1}, {0.3, 0.3, 0.3}, {1, 1, 1}};
  line.faces = {{0, 1, 2}, {1, 2, 3}};
  test::number_faces(line);
  Mesh point;
  point.vertices_m = {{1, 2, 3}, {1, 2, 3}, {1, 2, 3}};
  point.faces = {{0, 1, 2}};
  test::number_faces(point);
  for (const Mesh& mesh : {line, point, Mesh{}}) {
    const Result<PreparedMesh> prepared = check_and_repair(as_source(mesh));
    ASSERT_FALSE(prepared.ok());
    EXPECT_EQ(prepared.error().status, Status::kInvalidMesh);
    EXPECT_NE(prepared.error().finding.find("no face with an area"), std::string::npos);
  }
}

TEST(Repair, RefusesWhatOnlyABrokenCallerGives) {
  Mesh mesh = test::box({1, 1, 1});
  mesh.vertices_m[3].y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(check_and_repair(as_source(mesh)).ok());
  mesh = test::box({1, 1, 1});
  mesh.faces[3][1] = 8;
  const Result<PreparedMesh> prepared = check_and_repair(as_source(mesh));
  ASSERT_FALSE(prepared.ok());
  EXPECT_NE(prepared.error().finding.find("triangle 3"), std::string::npos);
  EXPECT_FALSE(check_and_repair(as_source(test::box({1, 1, 1})), {.weld_tolerance = std::nan("")}).ok());
}

}  // namespace
}  // namespace sqmap::bake
