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

}  // namespace
}  // namespace sqmap::bake
