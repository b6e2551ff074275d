// SPDX-License-Identifier: GPL-3.0-or-later
#include "partition.hpp"

#include <algorithm>

#include <gtest/gtest.h>

#include "support/shapes.hpp"

namespace sqmap::bake {
namespace {

TEST(CloseSegments, CapsStayWithWhatTheyClose) {
  // A long ellipsoid: one end, a middle in two halves, the other end. Two borders meet at each end of the
  // seam.
  const Mesh mesh = test::ellipsoid({1, 1, 3}, 4);
  Decomposition segments;
  segments.reasons.resize(4);
  for (const auto& [a, b, c] : mesh.faces) {
    const Vec3d middle = (1.0 / 3) * (mesh.vertices_m[a] + mesh.vertices_m[b] + mesh.vertices_m[c]);
    const bool is_end = middle.z < -1 || middle.z > 1.5;
    segments.label.push_back(is_end ? (middle.z < 0 ? 0 : 3) : (middle.x < 0 ? 1 : 2));
  }
  auto [set, whole] = SolidSet::whole(mesh);
  const std::vector<Cell> cells = close_segments(set, whole, segments);
  ASSERT_EQ(cells.size(), 4U);
  double volume_m3 = 0, low = 9, high = -9;
  for (const Cell& cell : cells) volume_m3 += set.volume_m3(cell.solid);
  for (const auto& t : cells[0].solid.triangles)
    for (const std::uint32_t v : t) high = std::max(high, set.vertices_m[v].z);
  for (const auto& t : cells[3].solid.triangles)
    for (const std::uint32_t v : t) low = std::min(low, set.vertices_m[v].z);
  EXPECT_LT(high, -0.8);
  // Its caps reach to the middle of the half beside it, not to where the two halves and the other end meet.
  EXPECT_GT(low, 0);
  EXPECT_NEAR(volume_m3, set.volume_m3(whole), 1e-9);
}

TEST(Solid, PlanesCutTheCapsOfEarlierCuts) {
  const Mesh mesh = test::ellipsoid({1, 1, 3}, 4);
  auto [set, whole] = SolidSet::whole(mesh);
  const auto [half, rest] = set.split(whole, HalfSpace{{1, 0, 0}, 0.1});
  // Its cap is one fan from end to end.
  const auto [low, high] = set.split(half, HalfSpace{{0, 0, 1}, -1});
  EXPECT_GT(set.volume_m3(low), 0.1);
  EXPECT_NEAR(set.volume_m3(low) + set.volume_m3(high), set.volume_m3(half), 1e-12);
  for (const Vec3d& p : set.points(low)) EXPECT_LT(p.z, -0.8);
  for (const Vec3d& p : set.points(high)) EXPECT_GT(p.z, -1.2);
  // Closed: the volume does not depend on the origin.
  SolidSet moved = set;
  for (Vec3d& v : moved.vertices_m) v = v + Vec3d{10, -20, 30};
  for (const Solid* solid : {&low, &high}) EXPECT_NEAR(moved.volume_m3(*solid), set.volume_m3(*solid), 1e-9);
}

}  // namespace
}  // namespace sqmap::bake
