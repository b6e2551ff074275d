// SPDX-License-Identifier: GPL-3.0-or-later
#include "geodesics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "sqmap/bake/decompose.hpp"

#include "components.hpp"
#include "curvature.hpp"
#include "cuts.hpp"
#include "min_cut.hpp"
#include "support/shapes.hpp"
#include "surface.hpp"
#include "working_mesh.hpp"

namespace sqmap::bake {
namespace {

using std::numbers::pi;

PreparedMesh prepared(Mesh mesh) {
  Components connected(mesh.vertices_m.size());
  for (const auto& [a, b, c] : mesh.faces) {
    connected.join(a, b);
    connected.join(b, c);
  }
  std::map<std::uint32_t, std::uint32_t> number;
  PreparedMesh result;
  for (const auto& face : mesh.faces)
    result.component.push_back(
        number.try_emplace(connected.find(face[0]), static_cast<std::uint32_t>(number.size())).first->second);
  result.mesh = std::move(mesh);
  return result;
}

Triangles triangles(const Mesh& mesh) { return {mesh.vertices_m, mesh.faces}; }

Vec3d centroid(const Mesh& mesh, std::size_t face) {
  const auto& [a, b, c] = mesh.faces[face];
  return (1.0 / 3) * (mesh.vertices_m[a] + mesh.vertices_m[b] + mesh.vertices_m[c]);
}

double area(const Mesh& mesh, std::size_t face) {
  const auto& [a, b, c] = mesh.faces[face];
  return 0.5 * norm(cross(mesh.vertices_m[b] - mesh.vertices_m[a], mesh.vertices_m[c] - mesh.vertices_m[a]));
}

// The mean geodesic distance between points of a sphere is a quarter of its circumference, from every point.
TEST(Protrusion, OfASphereIsAQuarterTurnEverywhere) {
  const double radius_m = 2, expected = (pi / 2 * radius_m) / std::sqrt(4 * pi * radius_m * radius_m);
  for (const double p : protrusion(prepared(test::sphere(radius_m, 3)), 100))
    EXPECT_NEAR(p, expected, 0.03 * expected);
}

TEST(Protrusion, FromSampledSourcesIsThatFromAll) {
  // Uneven triangles: the sources must be weighted by area, not counted.
  const PreparedMesh mesh = prepared(test::mapped(test::ellipsoid({1, 1, 1}, 3), [](const Vec3d& p) {
    return Vec3d{p.x, 0.6 * p.y, p.z > 0 ? 4 * p.z * p.z : p.z};
  }));
  const std::vector<double> all = protrusion(mesh, 1'000'000), sampled = protrusion(mesh, 100);
  double error = 0, sum = 0;
  for (std::size_t f = 0; f < all.size(); ++f) {
    error += (sampled[f] - all[f]) * (sampled[f] - all[f]);
    sum += all[f] * all[f];
  }
  EXPECT_LT(std::sqrt(error / sum), 0.01);
}

TEST(Protrusion, IsLargestAtTheEndsOfACapsule) {
  const Mesh mesh = test::capsule(0.5, 3, 32);
  const std::vector<double> p = protrusion(prepared(mesh), 60);
  const auto most = static_cast<std::size_t>(std::max_element(p.begin(), p.end()) - p.begin());
  const auto least = static_cast<std::size_t>(std::min_element(p.begin(), p.end()) - p.begin());
  EXPECT_GT(std::abs(centroid(mesh, most).z), 3.3);
  EXPECT_LT(std::abs(centroid(mesh, least).z), 1.6);  // faces of the tube are as long as it
}

TEST(GaussianCurvature, OfASphereIsTheInverseSquaredRadius) {
  for (const double radius_m : {1e-3, 1.0, 50.0})
    for (const double k : gaussian_curvature(prepared(test::sphere(radius_m, 4))))
      EXPECT_NEAR(k * radius_m * radius_m, 1, 0.03);
}

TEST(GaussianCurvature, OfATorusIsNegativeInsideOnly) {
  const double major_m = 1, minor_m = 0.3;
  const Mesh mesh = test::torus(major_m, minor_m, 120, 48);
  const std::vector<double> k = gaussian_curvature(prepared(mesh));
  int inside = 0, outside = 0;
  for (std::size_t f = 0; f < k.size(); ++f) {
    const Vec3d p = centroid(mesh, f);
    const double rho = std::hypot(p.x, p.y);
    const double expected = (rho - major_m) / (minor_m * minor_m * rho);  // cos v / (r (R + r cos v))
    if (rho < major_m - 0.1 * minor_m) {
      EXPECT_LT(k[f], 0);
      ++inside;
    } else if (rho > major_m + 0.1 * minor_m) {
      EXPECT_GT(k[f], 0);
      ++outside;
    }
    EXPECT_NEAR(k[f], expected, 0.5);
  }
  EXPECT_GT(inside, 1000);
  EXPECT_GT(outside, 1000);
}

TEST(GaussianCurvature, DoesNotDependOnTheTessellation) {
  const Mesh mesh = test::sphere(1, 4),
             fine = test::subdivided(mesh);  // same surface, flat faces cut in four
  const std::vector<double> coarse_k = gaussian_curvature(prepared(mesh)),
                            fine_k = gaussian_curvature(prepared(fine));
  double coarse_sum = 0, fine_sum = 0;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) coarse_sum += coarse_k[f] * area(mesh, f);
  for (std::size_t f = 0; f < fine.faces.size(); ++f) fine_sum += fine_k[f] * area(fine, f);
  EXPECT_NEAR(coarse_sum, 4 * pi, 0.02 * 4 * pi);  // Gauss and Bonnet
  EXPECT_NEAR(fine_sum, 4 * pi, 0.02 * 4 * pi);
}

TEST(BendTensor, IsNeverConcaveOnAConvexBody) {
  const Surface surface = make_surface(triangles(test::subdivided(test::subdivided(test::box({1, 2, 3})))));
  const Curvature bend = curvature(surface, 0.05);
  double most = 0;
  for (const double across : bend_across_links(surface, bend)) {
    EXPECT_GE(across, -1e-9);
    most = std::max(most, across);
  }
  EXPECT_GT(most, 1);  // across the edges of the box it is convex
}

TEST(BendTensor, MeasuresTheWaistOfATorus) {
  const double major_m = 1, minor_m = 0.25;
  const Surface surface = make_surface(triangles(test::torus(major_m, minor_m, 120, 48)));
  const Curvature bend = curvature(surface, 0.01);
  for (std::size_t v = 0; v < surface.points.size(); ++v) {
    const Vec3d p = surface.scale_m * surface.points[v];
    const double rho = std::hypot(p.x, p.y);
    if (rho > major_m - 0.99 * minor_m) continue;
    const Vec3d around_axis{-p.y / rho, p.x / rho, 0};
    EXPECT_NEAR(bend.bend[v].across({0, 0, 1}) / surface.scale_m, -1 / (major_m - minor_m), 0.1);
    EXPECT_NEAR(bend.bend[v].across(around_axis) / surface.scale_m, 1 / minor_m, 0.1);
  }
}

TEST(FastMarching, IsStraightOnAPlane) {
  const Surface surface = make_surface(triangles(test::open_sheet(2, 32)));
  const std::uint32_t corner = 0;
  const std::vector<float> distance = fast_marching(surface, {&corner, 1});
  for (std::size_t v = 0; v < distance.size(); ++v)
    EXPECT_NEAR(distance[v], norm(surface.points[v] - surface.points[corner]), 1e-3);
}

TEST(Geodesics, FollowGreatCircles) {
  const Surface surface = make_surface(triangles(test::sphere(1, 4)));
  const std::uint32_t start = 5;
  const std::vector<float> heat = distances_from_each(surface, {&start, 1})[0];
  const std::vector<float> march = fast_marching(surface, {&start, 1});
  const double radius = norm(surface.points[start]);
  for (std::size_t v = 0; v < surface.points.size(); ++v) {
    const double exact =
        radius *
        std::acos(std::clamp(dot(surface.points[v], surface.points[start]) / (radius * radius), -1.0, 1.0));
    EXPECT_NEAR(heat[v], exact, 0.02);
    EXPECT_NEAR(march[v], exact, 0.02);
  }
}

TEST(Geodesics, CrossEdgesOfThreeFaces) {
  Mesh mesh = test::open_sheet(2, 8);
  const Mesh page = test::mapped(test::open_sheet(2, 8), [](const Vec3d& p) {
    return Vec3d{0, p.y, p.x + 1};
  });
  const auto offset = static_cast<std::uint32_t>(mesh.vertices_m.size());
  const auto weld =
      [&](std::uint32_t v) -> std::uint32_t {  // the page's first column is the sheet's middle one
    return v % 9 == 0 ? v + 4 : offset + v;
  };
  mesh.vertices_m.insert(mesh.vertices_m.end(), page.vertices_m.begin(), page.vertices_m.end());
  for (const auto& [a, b, c] : page.faces) mesh.faces.push_back({weld(a), weld(b), weld(c)});
  std::vector<std::uint32_t> all(mesh.faces.size());
  for (std::uint32_t f = 0; f < all.size(); ++f) all[f] = f;
  const Surface surface = make_surface(extract(mesh.vertices_m, mesh.faces, all));
  const std::uint32_t start = 0;
  const std::vector<float> distance = distances_from_each(surface, {&start, 1})[0];
  for (const float d : distance) EXPECT_TRUE(std::isfinite(d) && d < 3);
}

TEST(FarthestPointSources, ShareTheWholeArea) {
  const Surface surface = make_surface(triangles(test::ellipsoid({1, 2, 3}, 3)));
  const std::vector<Source> sources = farthest_point_sources(surface, 50);
  ASSERT_EQ(sources.size(), 50U);
  double sum = 0;
  for (const Source& source : sources) {
    EXPECT_GT(source.area, 0.2 / 50);
    EXPECT_LT(source.area, 5.0 / 50);
    sum += source.area;
  }
  EXPECT_NEAR(sum, 1, 1e-9);
}

// Against all 2^(n-2) cuts of random graphs.
TEST(MinimumCut, IsTheCheapestOfAllCuts) {
  std::mt19937_64 random(1);
  for (int draw = 0; draw < 200; ++draw) {
    const std::uint32_t count = 4 + random() % 6;
    std::vector<FlowEdge> edges;
    for (std::uint32_t a = 0; a < count; ++a)
      for (std::uint32_t b = a + 1; b < count; ++b)
        if (random() % 2 == 0) edges.push_back({a, b, static_cast<std::int64_t>(random() % 20)});
    const auto cost = [&](const auto& on_source_side) {
      std::int64_t sum = 0;
      for (const FlowEdge& edge : edges)
        if (on_source_side(edge.a) != on_source_side(edge.b)) sum += edge.capacity;
      return sum;
    };
    std::int64_t cheapest = std::numeric_limits<std::int64_t>::max();
    for (std::uint32_t set = 0; set < (1U << count); ++set)
      if ((set & 1U) != 0 && ((set >> 1) & 1U) == 0)
        cheapest = std::min(cheapest, cost([&](std::uint32_t v) { return ((set >> v) & 1U) != 0; }));
    const std::vector<std::uint8_t> side = minimum_cut(count, edges, 0, 1);
    EXPECT_TRUE(side[0] && !side[1]);
    EXPECT_EQ(cost([&](std::uint32_t v) { return side[v] != 0; }), cheapest);
  }
}

TEST(WorkingMesh, HasEvenEdgesAndTheSameTopology) {
  const Mesh inputs[] = {test::sphere(1, 5), test::torus(1, 0.4, 12, 6), test::box({1, 1, 3})};
  for (const Mesh& input : inputs) {
    const WorkingMesh working = make_working_mesh(triangles(input), 0.1, 0.25);
    const auto euler = [](std::size_t points, std::size_t faces) {
      return static_cast<long>(points) - static_cast<long>(faces) / 2;  // closed: 3 F = 2 E
    };
    EXPECT_EQ(euler(working.triangles.points.size(), working.triangles.faces.size()),
              euler(input.vertices_m.size(), input.faces.size()));
    const Surface surface = make_surface(working.triangles);
    EXPECT_TRUE(surface.is_closed);
    double longest = 0;
    std::size_t short_edges = 0;
    for (const Link& link : surface.links) {
      longest = std::max(longest, link.length * surface.scale_m);
      short_edges += link.length * surface.scale_m < 0.1;
    }
    EXPECT_LT(longest, 0.35);  // a collapse lengthens its neighbours a little
    EXPECT_LT(short_edges, surface.links.size() / 20);
    ASSERT_EQ(working.faces_of_input.size(), input.faces.size());
    for (std::size_t f = 0; f < input.faces.size(); ++f) {
      ASSERT_FALSE(working.faces_of_input[f].empty());
      for (const std::uint32_t g : working.faces_of_input[f]) ASSERT_LT(g, working.triangles.faces.size());
    }
  }
}

// Edges are neither too long nor too short here: what changes are vertices that carry no shape.
WorkingMesh without_plain_vertices(const Mesh& mesh) { return make_working_mesh(triangles(mesh), 1e-9, 1e3); }

TEST(WorkingMesh, ForgetsThatFacesWereCut) {
  Mesh inputs[] = {test::sphere(1, 3), test::torus(1, 0.4, 24, 12), test::spring(1, 0.2, 0.8, 2, 48, 16),
                   test::sphere(1, 3)};
  Mesh& cap = inputs[3];
  std::erase_if(cap.faces, [&](const auto& face) { return cap.vertices_m[face[0]].z < 0.3; });
  test::number_faces(cap);
  for (Mesh& input : inputs) {
    for (Vec3d& p : input.vertices_m)  // so that no two faces lie in one plane
      p = p + 0.03 * Vec3d{std::sin(9 * p.y), std::sin(7 * p.z), std::sin(11 * p.x)};
    const WorkingMesh whole = without_plain_vertices(input);
    EXPECT_EQ(whole.triangles.faces.size(), input.faces.size());
    Mesh cut = test::subdivided(input);
    const WorkingMesh found = without_plain_vertices(cut);
    EXPECT_EQ(found.triangles.faces, whole.triangles.faces);
    EXPECT_EQ(found.triangles.points, whole.triangles.points);
    for (std::size_t f = 0; f < cut.faces.size(); ++f)
      ASSERT_EQ(found.faces_of_input[f], whole.faces_of_input[cut.source_face[f]]);

    // Rounded, the same but for the order of vertices that are as far from the middle.
    for (Vec3d& p : cut.vertices_m) p = cast<double>(cast<float>(p));
    const WorkingMesh rounded = without_plain_vertices(cut);
    EXPECT_EQ(rounded.triangles.faces.size(), input.faces.size());
    for (std::size_t f = 0; f < cut.faces.size(); ++f) {
      ASSERT_EQ(rounded.faces_of_input[f].size(), 1U);
      const auto& face = rounded.triangles.faces[rounded.faces_of_input[f][0]];
      const auto& parent = input.faces[cut.source_face[f]];
      Vec3d off;
      for (int i = 0; i < 3; ++i) off = off + rounded.triangles.points[face[i]] - input.vertices_m[parent[i]];
      ASSERT_LT(norm(off), 1e-5);
    }
  }
}

TEST(WorkingMesh, IsAsFlatAsTheSurface) {
  Mesh box = test::box({1, 1, 3});
  for (int time = 0; time < 4; ++time) box = test::subdivided(box);
  const WorkingMesh working = without_plain_vertices(box);
  EXPECT_EQ(working.triangles.faces.size(), 12U);
  const Surface surface = make_surface(working.triangles);
  EXPECT_NEAR(surface.scale_m * surface.scale_m, 2 * (4 + 12 + 12), 1e-9);
  for (std::size_t f = 0; f < box.faces.size(); ++f) {
    ASSERT_EQ(working.faces_of_input[f].size(), 1U);
    const auto& [a, b, c] = box.faces[f];
    const Vec3d n =
        normalized(cross(box.vertices_m[b] - box.vertices_m[a], box.vertices_m[c] - box.vertices_m[a]));
    EXPECT_GT(dot(n, surface.normal[working.faces_of_input[f][0]]), 0.999);
  }
}

double area_m2(const Triangles& mesh) {
  double sum = 0;
  for (const auto& [a, b, c] : mesh.faces)
    sum += 0.5 * norm(cross(mesh.points[b] - mesh.points[a], mesh.points[c] - mesh.points[a]));
  return sum;
}

TEST(WorkingMesh, LeavesSliversTetrahedraAndFlatFoldsWhole) {
  const Triangles needle{{{0, 0, 0}, {1, 0, 0}, {0.5, 1e-5, 0}}, {{0, 1, 2}}};
  const Triangles kite{{{0, 0, 0}, {1, 0, 0}, {0.5, 1e-5, 0}, {0.5, -1e-5, 0}}, {{0, 1, 2}, {1, 0, 3}}};
  const Triangles flat_tetrahedron{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.3, 0.3, 1e-6}},
                                   {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}};
  // A square of two sheets in one plane, each a fan around a vertex of its own.
  Triangles fold{{{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}, {0.2, 0.2, 0}, {0, 0, 0}}, {}};
  for (std::uint32_t i = 0; i < 4; ++i) {
    fold.faces.push_back({i, (i + 1) % 4, 4});
    fold.faces.push_back({(i + 1) % 4, i, 5});
  }
  for (const Triangles& input : {needle, kite, flat_tetrahedron, fold}) {
    const WorkingMesh working = make_working_mesh(input, 1e-9, 1e3);
    EXPECT_NEAR(area_m2(working.triangles), area_m2(input), 2e-3 * area_m2(input));
    ASSERT_EQ(working.faces_of_input.size(), input.faces.size());
    for (const auto& list : working.faces_of_input) EXPECT_FALSE(list.empty());
  }
}

TEST(WorkingMesh, TellsASmallFeatureFromTheFlatAroundIt) {
  Mesh box = test::box({1, 1, 1});
  for (int time = 0; time < 5; ++time) box = test::subdivided(box);
  for (Vec3d& p : box.vertices_m)
    if (p.z > 0.99 && std::hypot(p.x - 0.3, p.y - 0.2) < 0.1) p.z += 0.1;
  const WorkingMesh working = make_working_mesh(triangles(box), 1e-9, 0.3);
  EXPECT_LT(working.triangles.faces.size(), box.faces.size() / 3);
  const Surface surface = make_surface(working.triangles);
  for (std::size_t f = 0; f < box.faces.size(); ++f) {
    const auto& [a, b, c] = box.faces[f];
    const Vec3d n =
        normalized(cross(box.vertices_m[b] - box.vertices_m[a], box.vertices_m[c] - box.vertices_m[a]));
    for (const std::uint32_t g : working.faces_of_input[f]) EXPECT_GT(dot(n, surface.normal[g]), 0.999);
  }
}

}  // namespace
}  // namespace sqmap::bake
