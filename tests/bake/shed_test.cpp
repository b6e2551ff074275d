// SPDX-License-Identifier: GPL-3.0-or-later
#include "shed.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "support/shapes.hpp"

namespace sqmap::bake {
namespace {

bool holds(const Part& part, const Vec3d& p_m) {
  const Vec3d p =
      rotation(part.object_from_part.orientation).apply_inverse(p_m - part.object_from_part.translation_m);
  return inside_outside_radial(part.shape, p) <= 1;
}

/// A mesh in two pieces with their superquadrics.
struct Pair {
  template <class IsSecond>
  Pair(const Mesh& of, const IsSecond& is_second) : mesh(of) {
    Decomposition segments;
    segments.reasons.resize(2);
    for (const auto& [a, b, c] : mesh.faces) {
      const Vec3d middle = (1.0 / 3) * (mesh.vertices_m[a] + mesh.vertices_m[b] + mesh.vertices_m[c]);
      segments.label.push_back(is_second(middle) ? 1 : 0);
    }
    auto [solids, whole] = SolidSet::whole(mesh);
    set = std::move(solids);
    for (Cell& cell : close_segments(set, whole, segments)) {
      FitOptions quick;
      quick.quick = true;
      Piece piece;
      piece.part = fit_part(set, cell.solid, quick).value().part;
      piece.cell = std::move(cell);
      pieces.push_back(std::move(piece));
    }
  }
  double volumes_m3() const { return volume_m3(pieces[0].part.shape) + volume_m3(pieces[1].part.shape); }

  Mesh mesh;
  SolidSet set;
  std::vector<Piece> pieces;
};

constexpr double kRadius_m = 1, kApart_m = 0.8;

/// Two balls that overlap, cut aslant beside the crease between them: either cell has some of the other ball,
/// which lies deep in the other one's superquadric.
Pair balls_cut_aslant() {
  return {test::two_spheres(kRadius_m, kApart_m, 48),
          [](const Vec3d& p) { return p.z > (p.x > 0 ? -0.3 : 0.3); }};
}

TEST(Shed, OnePartHoldsForAnother) {
  Pair balls = balls_cut_aslant();
  const Pair natural = balls;
  shed_covered(balls.set, balls.pieces, {});
  EXPECT_LT(balls.volumes_m3(), 0.95 * natural.volumes_m3());

  // Each triangle of the mesh has one holder, which holds it whole; solids add up to the mesh.
  std::vector<int> holders(balls.mesh.faces.size(), 0);
  double held_m3 = 0, cells_m3 = 0;
  for (const Piece& piece : balls.pieces) {
    held_m3 += balls.set.volume_m3(piece.held);
    cells_m3 += balls.set.volume_m3(piece.cell.solid);
    for (std::size_t k = 0; k < piece.held.triangles.size(); ++k) {
      for (const std::uint32_t v : piece.held.triangles[k])
        EXPECT_TRUE(holds(piece.part, balls.set.vertices_m[v]));
      if (piece.held.face[k] != kNewFace) ++holders[piece.held.face[k]];
    }
  }
  for (const int count : holders) EXPECT_EQ(count, 1);
  EXPECT_NEAR(held_m3, cells_m3, 1e-9);

  // Cells, which labels come from, are what they were.
  for (std::size_t k = 0; k < 2; ++k)
    EXPECT_EQ(balls.pieces[k].cell.solid.face, natural.pieces[k].cell.solid.face);
}

TEST(Shed, EveryPointInsideTheMeshStaysInOnePart) {
  Pair balls = balls_cut_aslant();
  shed_covered(balls.set, balls.pieces, {});
  std::mt19937_64 rng(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  int inside = 0;
  for (int i = 0; i < 50000; ++i) {
    const Vec3d p{unit(rng), unit(rng), 2 * unit(rng)};
    if (norm(Vec3d{p.x, p.y, std::abs(p.z) - kApart_m}) > 0.99 * kRadius_m) continue;
    ++inside;
    EXPECT_TRUE(holds(balls.pieces[0].part, p) || holds(balls.pieces[1].part, p));
  }
  EXPECT_GT(inside, 10000);
}

TEST(Shed, LeavesAloneWhatDoesNotTouch) {
  Pair balls(test::joined({test::sphere(1, 3), test::sphere(1, 3, {5, 0, 0})}),
             [](const Vec3d& p) { return p.x > 2.5; });
  const Pair before = balls;
  shed_covered(balls.set, balls.pieces, {});
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(balls.pieces[k].part, before.pieces[k].part);
    EXPECT_EQ(balls.pieces[k].held.triangles, before.pieces[k].cell.solid.triangles);
  }
}

}  // namespace
}  // namespace sqmap::bake
