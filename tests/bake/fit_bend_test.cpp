// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit_bend.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "sqmap/asset/map_grid.hpp"
#include "sqmap/asset/validate.hpp"
#include "sqmap/bake/bake.hpp"
#include "sqmap/runtime/object.hpp"

#include "fit_model.hpp"
#include "part_lines.hpp"
#include "support/shapes.hpp"

namespace sqmap::bake {
namespace {

double uniform(std::mt19937_64& rng, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(rng);
}

/// The surface of a superquadric, bent or not, in triangles.
Mesh surface_of(const Superquadric& shape, const Pose& pose, std::uint32_t rows, std::uint32_t cols) {
  const MapGrid grid(shape, rows, cols);
  const Rotation<double> turn = rotation(pose.orientation);
  Mesh mesh;
  const auto add = [&](std::uint32_t row, std::uint32_t col) {
    mesh.vertices_m.push_back(turn.apply(grid.point(row, col)) + pose.translation_m);
  };
  add(0, 0);
  for (std::uint32_t row = 1; row + 1 < rows; ++row)
    for (std::uint32_t col = 0; col < cols; ++col) add(row, col);
  add(rows - 1, 0);
  const auto node = [&](std::uint32_t row, std::uint32_t col) {
    return row == 0 ? 0 : row + 1 == rows ? (rows - 2) * cols + 1 : (row - 1) * cols + col % cols + 1;
  };
  for (std::uint32_t row = 0; row + 1 < rows; ++row) {
    for (std::uint32_t col = 0; col < cols; ++col) {
      const std::uint32_t a = node(row, col), b = node(row, col + 1), c = node(row + 1, col + 1),
                          d = node(row + 1, col);
      if (row > 0) mesh.faces.push_back({a, b, c});
      if (row + 2 < rows) mesh.faces.push_back({a, c, d});
    }
  }
  mesh.source_face.resize(mesh.faces.size());
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) mesh.source_face[f] = f;
  return mesh;
}

Superquadric arc(double turn_rad, double direction) {
  Superquadric shape{{0.22, 0.16, 1}, 0.6, 0.9};
  shape.bend = {turn_rad * std::cos(direction), turn_rad * std::sin(direction)};
  return shape;
}
const Pose kPose{{0.5, -0.5, 0.5, 0.5}, {0.3, -2, 1}};

double largest_sampled(const Superquadric& shape, const Pose& pose, const Mesh& mesh, int per_face) {
  const Rotation<double> turn = rotation(pose.orientation);
  std::mt19937_64 rng(3);
  double largest = 0;
  for (const auto& [a, b, c] : mesh.faces) {
    for (int i = 0; i < per_face; ++i) {
      double u = i < 3 ? i == 1 : uniform(rng, 0, 1), v = i < 3 ? i == 2 : uniform(rng, 0, 1);
      if (u + v > 1) u = 1 - u, v = 1 - v;
      const Vec3d p = (1 - u - v) * mesh.vertices_m[a] + u * mesh.vertices_m[b] + v * mesh.vertices_m[c];
      largest = std::max(largest, inside_outside_radial(shape, turn.apply_inverse(p - pose.translation_m)));
    }
  }
  return largest;
}

TEST(BendModel, GradientIsThatOfDifferences) {
  std::mt19937_64 rng(1);
  for (int i = 0; i < 300; ++i) {
    fit::Vector x = fit::Vector::Zero();
    for (int k = 0; k < 6; ++k) x[k] = uniform(rng, -0.3, 0.3);
    for (int k = 6; k < 9; ++k) x[k] = uniform(rng, -0.5, 0);
    x[fit::kE1] = uniform(rng, 0.4, 1.4);
    x[fit::kE2] = uniform(rng, 0.4, 1.4);
    x[fit::kTaper] = i % 2 == 0 ? 0 : uniform(rng, -0.8, 0.8);
    const double size = i % 3 == 0 ? 1e-3 : 0.8;  // of the series, and not
    x[fit::kBend] = uniform(rng, -size, size);
    x[fit::kBend + 1] = uniform(rng, -size, size);
    const Vec3d p{uniform(rng, -1, 1), uniform(rng, -1, 1), uniform(rng, -1, 1)};
    const Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
    const fit::Vector gradient = fit::LogBetaModel(x, axes).value_and_gradient(p).gradient;
    for (int k = 0; k < fit::kParameterCount; ++k) {
      constexpr double kStep = 1e-6;
      fit::Vector above = x, below = x;
      above[k] += kStep;
      below[k] -= kStep;
      const double slope =
          (fit::LogBetaModel(above, axes).value(p) - fit::LogBetaModel(below, axes).value(p)) / (2 * kStep);
      EXPECT_NEAR(gradient[k], slope, 2e-4 * (1 + std::abs(slope))) << "parameter " << k;
    }
  }
}

// Triangles so large that their images in the straight frame bulge far beyond their corners.
TEST(LargestBeta, HoldsForEveryPointOfTheTrianglesAndHardlyMore) {
  std::mt19937_64 rng(2);
  int bulges = 0;
  for (int i = 0; i < 40; ++i) {
    const Superquadric shape = arc(uniform(rng, 0.2, 1.9), uniform(rng, -3, 3));
    const Superquadric inner{0.9 * shape.semi_axes_m, shape.e1, shape.e2, 0, shape.bend};
    const Mesh mesh = surface_of(inner, kPose, 9, 12);
    const double bound = largest_beta(shape, kPose, mesh.vertices_m, mesh.faces);
    const double corners = largest_sampled(shape, kPose, mesh, 3);
    const double sampled = largest_sampled(shape, kPose, mesh, 3000);
    EXPECT_GE(bound, sampled);
    EXPECT_LE(bound, sampled * 1.005);
    bulges += bound > 1.01 * corners;
  }
  EXPECT_GT(bulges, 5);
}

TEST(LargestBeta, IsNotFooledByATriangleAcrossTheMiddle) {
  // Its corners lie at both ends of the arc, its inside in the gap between them.
  const Superquadric shape = arc(1.9, 0);
  const Vec3d top = bent(shape.bend, Vec3d{0, 0, 0.95}), bottom = bent(shape.bend, Vec3d{0, 0, -0.95}),
              side = bent(shape.bend, Vec3d{0, 0.05, 0.95});
  const std::vector<Vec3d> points{top, bottom, side};
  for (const Vec3d& p : points) EXPECT_LT(inside_outside_radial(shape, p), 1);
  const std::vector<std::array<std::uint32_t, 3>> triangle{{0, 1, 2}};
  EXPECT_GT(largest_beta(shape, {}, points, triangle), 1.1);
}

TEST(FitBent, FindsTheArcThatTheSurfaceIs) {
  for (const double turn : {0.5, 1.0, 1.5}) {
    const Superquadric truth = arc(turn, 0.6 + turn);
    const Mesh mesh = surface_of(truth, kPose, 49, 48);
    const auto straight_fit = fit_superquadric(mesh.vertices_m);
    ASSERT_TRUE(straight_fit.ok());
    const auto bent_fit = fit_bent(mesh.vertices_m, mesh.faces, straight_fit.value(), {});
    ASSERT_TRUE(bent_fit.has_value()) << turn;
    EXPECT_LT(bent_fit->volume_m3, 1.06 * volume_m3(truth));
    EXPECT_LT(bent_fit->volume_m3, straight_fit.value().volume_m3);
    EXPECT_NEAR(bent_fit->shape.bend.curvature(), truth.bend.curvature(), 0.1 * truth.bend.curvature());
    EXPECT_LT(largest_sampled(bent_fit->shape, bent_fit->object_from_part, mesh, 50), 1);
    EXPECT_GT(largest_sampled(bent_fit->shape, bent_fit->object_from_part, mesh, 50), 0.99);
  }
}

TEST(FitBent, LeavesWhatIsStraightAlone) {
  for (const Mesh& mesh : {test::box({1, 0.4, 0.3}), surface_of(straight(arc(1, 0)), kPose, 33, 32)}) {
    const auto straight_fit = fit_superquadric(mesh.vertices_m);
    EXPECT_FALSE(fit_bent(mesh.vertices_m, mesh.faces, straight_fit.value(), {}).has_value());
  }
}

// Where a part's line, straight in its straight frame, crosses the mesh, there the surface is.
TEST(PartLines, OfABentPartCrossTheSurface) {
  const Superquadric shape = arc(1.2, 0.4);
  const Superquadric inner{{0.15, 0.12, 0.9}, 1, 1, 0, shape.bend};
  const Mesh mesh = surface_of(inner, kPose, 25, 24);
  const Oracle oracle(mesh);
  const RayTracer rays(mesh);
  const OpenPlaces open(mesh);
  const MeshQueries queries{mesh, rays, oracle, open};
  const PartLines lines(shape, kPose, queries);
  const MapGrid grid(straight(shape), 33, 32);
  const Rotation<double> turn = rotation(kPose.orientation);
  int hits_count = 0;
  for (std::uint32_t row = 0; row < 33; ++row) {
    std::vector<RayTracer::Ray> rows;
    for (std::uint32_t col = 0; col < 32; ++col)
      rows.push_back({grid.point(row, col), -grid.normal(row, col)});
    PartLines::Traced traced;
    lines.trace(rows, traced);
    for (std::uint32_t col = 0; col < 32; ++col) {
      EXPECT_EQ(traced.winding[col], 0);
      for (const RayTracer::Hit& hit : traced.hits[col]) {
        if (hit.t_m < 0 || hit.t_m > 0.2) continue;
        ++hits_count;
        const Vec3d q = rows[col].origin_m + hit.t_m * rows[col].direction;
        const Vec3d p = turn.apply(bent(shape.bend, q)) + kPose.translation_m;
        EXPECT_LT(oracle.nearest(p).distance_m, 3e-4);
      }
    }
  }
  EXPECT_GT(hits_count, 900);
}

TEST(Bake, BendsWhereThatSavesMemory) {
  const Mesh mesh = surface_of(arc(1.3, 0.5), kPose, 65, 48);
  BakeOptions rigid, bent;
  rigid.sample_count = bent.sample_count = 4000;
  bent.fit.bend = true;
  const auto a = bake(test::as_source(mesh), rigid), b = bake(test::as_source(mesh), bent);
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_TRUE(validate(b.value().asset, CheckLevel::kFull).empty());
  int bends = 0;
  for (const Part& part : a.value().asset.parts) EXPECT_TRUE(part.shape.bend.is_none());
  for (const Part& part : b.value().asset.parts) bends += !part.shape.bend.is_none();
  EXPECT_GT(bends, 0);
  const auto object_a = runtime::Object::build(a.value().asset),
             object_b = runtime::Object::build(b.value().asset);
  EXPECT_LT(object_b.value().resident_bytes(), 0.9 * object_a.value().resident_bytes());
  for (const ErrorRow& row : b.value().asset.errors) {
    if (row.layer != 3 || row.level != 0) continue;
    EXPECT_LT(row.eq35_percent, 0.05);
    EXPECT_LT(row.depth_mean_percent, 0.055);
    EXPECT_LT(row.misclassified_3_percent, 0.7);
  }
  // The union holds the surface.
  std::mt19937_64 rng(4);
  for (int i = 0; i < 20000; ++i) {
    const auto& [f, g, h] = mesh.faces[rng() % mesh.faces.size()];
    double u = uniform(rng, 0, 1), v = uniform(rng, 0, 1);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    const Vec3d p = (1 - u - v) * mesh.vertices_m[f] + u * mesh.vertices_m[g] + v * mesh.vertices_m[h];
    EXPECT_TRUE(std::ranges::any_of(b.value().asset.parts, [&](const Part& part) {
      const Vec3d local =
          rotation(part.object_from_part.orientation).apply_inverse(p - part.object_from_part.translation_m);
      return inside_outside_radial(part.shape, local) <= 1;
    }));
  }
}

TEST(Bake, RefusesBendsBesideBounds) {
  BakeOptions options;
  options.fit.bend = options.conservative = true;
  const auto result = bake(test::as_source(test::box({1, 1, 1})), options);
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().status, Status::kBadOption);
}

}  // namespace
}  // namespace sqmap::bake
