// SPDX-License-Identifier: GPL-3.0-or-later
#include "long_edges.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include <gtest/gtest.h>

#include "support/shapes.hpp"

namespace sqmap::bake {
namespace {

Triangles triangles_of(const Mesh& mesh) { return {mesh.vertices_m, mesh.faces}; }

double area(const Triangles& mesh, std::size_t face) {
  const auto& [a, b, c] = mesh.faces[face];
  return 0.5 * norm(cross(mesh.points[b] - mesh.points[a], mesh.points[c] - mesh.points[a]));
}

TEST(LongEdges, AreHalvedUntilNoneIsLonger) {
  const FineTriangles fine = split_long_edges(triangles_of(test::box({0.5, 1, 2})), 0.3, 100000);
  for (const auto& face : fine.triangles.faces) {
    for (int k = 0; k < 3; ++k) {
      EXPECT_LE(norm(fine.triangles.points[face[k]] - fine.triangles.points[face[(k + 1) % 3]]), 0.3);
    }
  }
}

TEST(LongEdges, LeaveNoCrackAndTheSameSurface) {
  const Triangles cone = triangles_of(test::cone(0.5, 1.0, 12));
  const FineTriangles fine = split_long_edges(cone, 0.2, 100000);
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> balance;
  for (const auto& face : fine.triangles.faces) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = face[k], b = face[(k + 1) % 3];
      balance[std::minmax(a, b)] += a < b ? 1 : -1;
    }
  }
  for (const auto& [edge, sum] : balance) EXPECT_EQ(sum, 0);

  std::vector<double> covered(cone.faces.size());
  for (std::size_t f = 0; f < fine.triangles.faces.size(); ++f)
    covered[fine.source_face[f]] += area(fine.triangles, f);
  for (std::size_t f = 0; f < cone.faces.size(); ++f) EXPECT_NEAR(covered[f], area(cone, f), 1e-12);
}

TEST(LongEdges, StopAtTheFaceLimit) {
  // A pass at most quadruples the faces and none starts beyond the limit.
  const FineTriangles fine = split_long_edges(triangles_of(test::box({1, 1, 1})), 1e-3, 1000);
  EXPECT_GT(fine.triangles.faces.size(), 12U);
  EXPECT_LE(fine.triangles.faces.size(), 4000U);
}

// What is long in one direction alone would be cut into ever thinner slivers for ever, were it cut itself.
TEST(LongEdges, EndWhereOnlyOneDirectionCounts) {
  const auto is_long = [](const Vec3d& a, const Vec3d& b) {
    return std::abs(a.x - b.x) > 0.02 ||
           (std::min(a.z, b.z) < 0 && norm(b - a) > 0.3 && std::max(a.z, b.z) > 0);
  };
  const FineTriangles fine = split_edges(triangles_of(test::cone(0.5, 1.0, 12)), is_long, 200000);
  EXPECT_LT(fine.triangles.faces.size(), 200000U);
  EXPECT_GT(fine.triangles.faces.size(), 500U);
  for (const auto& face : fine.triangles.faces)
    for (int k = 0; k < 3; ++k)
      EXPECT_FALSE(is_long(fine.triangles.points[face[k]], fine.triangles.points[face[(k + 1) % 3]]));
}

}  // namespace
}  // namespace sqmap::bake
