// SPDX-License-Identifier: GPL-3.0-or-later
//
// What is baked does not depend on how large a mesh is, where it lies and how it is turned.
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "sqmap/asset/validate.hpp"
#include "sqmap/bake/bake.hpp"

#include "support/shapes.hpp"

namespace sqmap::bake {
namespace {

BakeOptions quick_options() {
  BakeOptions options;
  options.sample_count = 10000;
  options.max_parts = 8;
  options.max_error_percent = 0.1;
  return options;
}

const ErrorRow& finest(const Asset& asset, std::uint32_t layer) {
  for (const ErrorRow& row : asset.errors)
    if (row.level == 0 && row.layer == layer) return row;
  ADD_FAILURE() << "no row for layer " << layer;
  return asset.errors.front();
}

/// A ring without a symmetry, so that no choice is between equals.
Mesh uneven_ring() {
  return test::mapped(test::torus(1, 0.3, 48, 24), [](const Vec3d& v) {
    return Vec3d{1.3 * v.x + 0.1 * v.y * v.y, v.y + 0.2 * v.z * v.x, v.z - 0.15 * v.x * v.x};
  });
}

Asset baked(const Mesh& mesh) {
  auto result = bake(test::as_source(mesh), quick_options());
  EXPECT_TRUE(result.ok()) << (result ? "" : result.error().finding);
  return result ? std::move(result).value().asset : Asset{};
}

/// Every vertex lies in some part's superquadric, asked in double.
void expect_contained(const Asset& asset, const Mesh& mesh) {
  for (const Vec3d& v : mesh.vertices_m) {
    double least = std::numeric_limits<double>::infinity();
    for (const Part& part : asset.parts) {
      const Vec3d p =
          rotation(part.object_from_part.orientation).apply_inverse(v - part.object_from_part.translation_m);
      least = std::min(least, inside_outside_radial(part.shape, p));
    }
    ASSERT_LE(least, 1);
  }
}

struct Way {
  const char* name;
  double scale;
  Pose pose;
  bool is_mirrored;
  double most_apart;  ///< factor by which errors may differ
};
// Measured: 1.05 where the mesh is only scaled. Turned and mirrored meshes are cut at other places by parts
// that are as good: 1.19 for eq. 35, 1.37 for distances.
const Way kWays[] = {
    {"Micrometres", 1e-6, {}, false, 1.1},
    {"ThousandsOfKilometres", 1e6, {}, false, 1.1},
    {"Turned", 1, {{0.5, 0.1, -0.7, 0.5}, {}}, false, 1.5},
    {"Mirrored", 1, {}, true, 1.5},
    {"TurnedMirroredSmallAndAThousandSizesAway", 1e-3, {{0.5, 0.5, 0.5, 0.5}, {0.6, -0.64, 0.48}}, true, 1.5},
};

class Placed : public testing::TestWithParam<Way> {
 protected:
  static const Asset& as_modelled() {
    static const Asset kAsset = baked(uneven_ring());
    return kAsset;
  }
  static Mesh placed(const Way& way, Mesh mesh) {
    Pose pose = way.pose;
    Quaternion& q = pose.orientation;
    const double length = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
    q = {q.w / length, q.x / length, q.y / length, q.z / length};
    if (way.is_mirrored)
      mesh = test::flipped(test::mapped(std::move(mesh), [](const Vec3d& v) {
        return Vec3d{-v.x, v.y, v.z};
      }));
    return test::transformed(std::move(mesh), pose, way.scale);
  }
};

TEST_P(Placed, MeshesGetTheSamePartsAndErrors) {
  const Way& way = GetParam();
  const Asset& expected = as_modelled();
  const Mesh mesh = placed(way, uneven_ring());
  const Asset asset = baked(mesh);
  EXPECT_TRUE(validate(asset, CheckLevel::kFull).empty());
  expect_contained(asset, mesh);

  ASSERT_GT(expected.parts.size(), 3U);
  ASSERT_EQ(asset.parts.size(), expected.parts.size());
  const double volume_m3 = std::pow(way.scale, 3) * expected.mesh.volume_m3;
  EXPECT_NEAR(asset.mesh.volume_m3, volume_m3, 1e-9 * volume_m3);
  EXPECT_NEAR(asset.r_max_m, way.scale * expected.r_max_m, 1e-9 * way.scale);
  for (const std::uint32_t layer : {2U, 3U}) {
    const ErrorRow &here = finest(asset, layer), &there = finest(expected, layer);
    SCOPED_TRACE("layer " + std::to_string(layer));
    EXPECT_LT(here.eq35_percent, way.most_apart * there.eq35_percent);
    EXPECT_GT(way.most_apart * here.eq35_percent, there.eq35_percent);
    EXPECT_LT(here.depth_mean_percent, way.most_apart * there.depth_mean_percent);
    EXPECT_GT(way.most_apart * here.depth_mean_percent, there.depth_mean_percent);
  }
}

INSTANTIATE_TEST_SUITE_P(Bake, Placed, testing::ValuesIn(kWays),
                         [](const auto& way) { return std::string(way.param.name); });

// The runtime takes coordinates in float, which has steps of 6 % of an object that lies a million of its
// sizes from the origin. Nothing finer can be told there, but the parts still bound the mesh.
TEST(FarMesh, IsContainedAMillionSizesFromTheOrigin) {
  const Mesh mesh = test::translated(uneven_ring(), {0.6e6, -0.64e6, 0.48e6});
  const Asset asset = baked(mesh);
  EXPECT_TRUE(validate(asset, CheckLevel::kFull).empty());
  expect_contained(asset, mesh);
  EXPECT_NEAR(asset.r_max_m, 3.38, 1e-6);
  EXPECT_NEAR(asset.mesh.volume_m3, test::signed_volume_m3(uneven_ring()), 1e-6);
  EXPECT_LT(finest(asset, 3).depth_mean_percent, 0.5);  // of R_max; measured 0.26, at the origin 0.038
}

TEST(MeshSize, IsRefusedWhereFloatsCannotSquareItOrAreSpent) {
  const auto told = [](double scale) {
    return bake(test::as_source(test::transformed(test::sphere(0.5, 3), {}, scale)), quick_options());
  };
  for (const double scale : {1e-320, 1e-200, 1e-42, 1e-30, 0.9e-15}) {
    const auto refused = told(scale);
    ASSERT_FALSE(refused.ok()) << scale;
    EXPECT_EQ(refused.error().status, Status::kInvalidMesh) << scale;
    EXPECT_TRUE(scale < 1e-100 || refused.error().finding.find("at least 1e-15 m") != std::string::npos)
        << refused.error().finding;
  }
  for (const double scale : {1e16, 1e30, 1e200}) {
    const auto refused = told(scale);
    ASSERT_FALSE(refused.ok()) << scale;
    EXPECT_EQ(refused.error().status, Status::kInvalidMesh) << scale;
  }
  for (const double scale : {1.0, 1e-14, 1e14}) {
    const auto result = told(scale);
    ASSERT_TRUE(result.ok()) << scale << ": " << result.error().finding;
    EXPECT_LT(finest(result.value().asset, 3).depth_mean_percent, 0.1) << scale;  // the target
  }
}

// Turned like this, the smallest superquadric around the cone is a box on its corner, whose normals miss much
// of the cone: layer 3 erred by 0.27 % of R_max, for a target of 0.1 that was said to be met.
TEST(FullFit, StandsBackWhereItMissesATargetThatTheQuickOneMeets) {
  const Quaternion turn{0.5, 0.1, -0.7, 0.5};  // of length 1
  auto result = bake(test::as_source(test::transformed(test::cone(0.5, 1, 64), {turn, {}})), quick_options());
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result.value().stopped_by, "target");
  EXPECT_LT(finest(result.value().asset, 3).depth_mean_percent, 0.12);
}

}  // namespace
}  // namespace sqmap::bake
