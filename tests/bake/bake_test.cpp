// SPDX-License-Identifier: GPL-3.0-or-later
#include "sqmap/bake/bake.hpp"

#include <cmath>
#include <filesystem>
#include <numeric>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "sqmap/asset/validate.hpp"
#include "sqmap/bake/oracle.hpp"
#include "sqmap/runtime/object.hpp"

#include "support/shapes.hpp"

namespace sqmap::bake {
namespace {

BakeOptions quick_options() {
  BakeOptions options;
  options.sample_count = 3000;
  options.max_parts = 8;
  options.max_error_percent = 0.1;
  return options;
}

struct NamedShape {
  const char* name;
  Mesh mesh;
  double volume_m3;
};

std::vector<NamedShape> analytic_shapes() {
  constexpr double kPi = 3.14159265358979;
  return {
      {"sphere", test::sphere(0.7, 4), 4.0 / 3 * kPi * 0.343},
      {"ellipsoid", test::ellipsoid({0.3, 0.6, 0.9}, 4), 4.0 / 3 * kPi * 0.162},
      {"box", test::box({0.4, 0.5, 0.6}), 0.96},
      {"cylinder", test::cylinder(0.4, 0.6, 64), kPi * 0.16 * 1.2},
      {"cone", test::cone(0.5, 1.0, 64), kPi * 0.25 / 3},
      {"torus", test::torus(1, 0.3, 64, 32), 2 * kPi * kPi * 0.09},
  };
}

const ErrorRow& finest(const Asset& asset, std::uint32_t layer) {
  for (const ErrorRow& row : asset.errors) {
    if (row.level == 0 && row.layer == layer) return row;
  }
  ADD_FAILURE() << "no row for layer " << layer;
  return asset.errors.front();
}

class AnalyticShape : public testing::TestWithParam<int> {};

TEST_P(AnalyticShape, IsBoundedAndItsDistancesAreTrue) {
  const NamedShape shape = analytic_shapes()[GetParam()];
  SCOPED_TRACE(shape.name);
  auto result = bake(test::as_source(shape.mesh), quick_options());
  ASSERT_TRUE(result.ok()) << result.error().finding;
  const Asset& asset = result.value().asset;
  EXPECT_TRUE(validate(asset, CheckLevel::kFull).empty());
  EXPECT_NEAR(asset.mesh.volume_m3, shape.volume_m3, 0.02 * shape.volume_m3);

  // Every vertex of a face lies in the superquadric of the face's part.
  for (std::size_t f = 0; f < shape.mesh.faces.size(); ++f) {
    const std::uint16_t label = asset.face_labels[f];
    ASSERT_LT(label, asset.parts.size());
    const Part& part = asset.parts[label];
    for (const std::uint32_t v : shape.mesh.faces[f]) {
      const Vec3d p = rotation(part.object_from_part.orientation)
                          .apply_inverse(shape.mesh.vertices_m[v] - part.object_from_part.translation_m);
      EXPECT_LE(inside_outside_radial(part.shape, p), 1);
    }
  }

  // Parts share the mesh out among them, whatever their superquadrics hold for each other.
  double held_m3 = 0;
  for (const Part& part : asset.parts) held_m3 += part.volume_m3;
  EXPECT_NEAR(held_m3, asset.mesh.volume_m3, 1e-9 * shape.volume_m3);

  // The baker's own figures, and the same again with points and an oracle of the test's.
  EXPECT_LE(finest(asset, 3).eq35_percent, 0.1);
  EXPECT_LE(finest(asset, 3).depth_mean_percent, 0.12);
  auto object = runtime::Object::build(asset);
  ASSERT_TRUE(object.ok());
  const Oracle oracle(shape.mesh);
  std::mt19937_64 rng(3);
  std::uniform_real_distribution<double> unit(-1.1, 1.1);
  Vec3d half;
  for (const Vec3d& v : shape.mesh.vertices_m) {
    for (int axis = 0; axis < 3; ++axis) half[axis] = std::max(half[axis], std::abs(v[axis]));
  }
  int inside = 0, wrong = 0, far_wrong = 0;
  for (int i = 0; i < 3000; ++i) {
    const Vec3f p = cast<float>(Vec3d{half.x * unit(rng), half.y * unit(rng), half.z * unit(rng)});
    const double truth_m = oracle.signed_distance(cast<double>(p));
    const bool told = object.value().query(p, {runtime::Layer::kThree, 0}).inside;
    inside += truth_m < 0;
    wrong += told != (truth_m < 0);
    far_wrong += told != (truth_m < 0) && std::abs(truth_m) > 0.02 * asset.r_max_m;
  }
  EXPECT_GT(inside, 50);
  EXPECT_LE(wrong, 30);
  EXPECT_EQ(far_wrong, 0);
}

INSTANTIATE_TEST_SUITE_P(Bake, AnalyticShape, testing::Range(0, 6),
                         [](const auto& shape) { return std::string(analytic_shapes()[shape.param].name); });

TEST(Bake, ConvexSuperquadricsStayOnePart) {
  for (const int index : {0, 1}) {
    const NamedShape shape = analytic_shapes()[index];
    auto result = bake(test::as_source(shape.mesh), quick_options());
    ASSERT_TRUE(result.ok());
    EXPECT_EQ(result.value().asset.parts.size(), 1U) << shape.name;
    EXPECT_EQ(result.value().stopped_by, "target");
  }
}

TEST(Bake, TwoOverlappingSpheresOfFigure4) {
  const Mesh mesh = test::two_spheres(0.6, 0.4, 48);
  auto result = bake(test::as_source(mesh), quick_options());
  ASSERT_TRUE(result.ok()) << result.error().finding;
  EXPECT_LE(finest(result.value().asset, 3).depth_mean_percent, 0.13);
  EXPECT_LE(finest(result.value().asset, 3).misclassified_3_percent, 1.2);
}

TEST(Bake, IsTheSameTwice) {
  const NamedShape shape = analytic_shapes()[5];
  auto first = bake(test::as_source(shape.mesh), quick_options());
  auto second = bake(test::as_source(shape.mesh), quick_options());
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_EQ(first.value().asset.parts, second.value().asset.parts);
  EXPECT_EQ(first.value().asset.face_labels, second.value().asset.face_labels);
}

TEST(Bake, DoesNotDependOnTheOrderOfVerticesAndFaces) {
  // An uneven body: the order must not even decide between equals.
  Mesh mesh = test::torus(1, 0.3, 48, 24);
  for (Vec3d& v : mesh.vertices_m)
    v = {1.3 * v.x + 0.1 * v.y * v.y, v.y + 0.2 * v.z * v.x, v.z - 0.15 * v.x * v.x};
  auto expected = bake(test::as_source(mesh), quick_options());
  auto reordered = bake(test::as_source(test::shuffled(mesh, 11)), quick_options());
  ASSERT_TRUE(expected.ok() && reordered.ok());
  EXPECT_EQ(expected.value().asset.parts, reordered.value().asset.parts);
  EXPECT_EQ(expected.value().asset.face_labels, reordered.value().asset.face_labels);
  EXPECT_EQ(finest(expected.value().asset, 3).depth_mean_percent,
            finest(reordered.value().asset, 3).depth_mean_percent);
}

TEST(Bake, ScalesWithTheMesh) {
  for (const double scale : {1e-3, 1e3}) {
    Mesh mesh = test::torus(1, 0.3, 48, 24);
    auto unit = bake(test::as_source(mesh), quick_options());
    for (Vec3d& v : mesh.vertices_m) v = scale * v;
    auto scaled = bake(test::as_source(mesh), quick_options());
    ASSERT_TRUE(unit.ok() && scaled.ok());
    EXPECT_NEAR(scaled.value().asset.r_max_m, scale * unit.value().asset.r_max_m, 1e-9 * scale);
    EXPECT_LE(finest(scaled.value().asset, 3).depth_mean_percent, 0.12);
  }
}

TEST(Bake, StopsWhenAsked) {
  Progress progress;
  int asked = 0;
  progress.cancelled = [&] { return ++asked > 1; };
  auto result = bake(test::as_source(test::torus(1, 0.3, 48, 24)), quick_options(), progress);
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().status, Status::kCancelled);
}

TEST(Bake, TapersWhereThatSavesMemoryAndNowhereElse) {
  BakeOptions rigid = quick_options(), tapered = quick_options();
  tapered.fit.taper = true;
  for (const int index : {0, 1, 2, 4}) {
    const NamedShape shape = analytic_shapes()[index];
    SCOPED_TRACE(shape.name);
    const auto a = bake(test::as_source(shape.mesh), rigid), b = bake(test::as_source(shape.mesh), tapered);
    ASSERT_TRUE(a.ok() && b.ok());
    EXPECT_TRUE(validate(b.value().asset, CheckLevel::kFull).empty());
    int tapers = 0;
    for (const Part& part : b.value().asset.parts) tapers += part.shape.taper != 0;
    for (const Part& part : a.value().asset.parts) EXPECT_EQ(part.shape.taper, 0);
    const auto bytes = [](const Asset& asset) {
      return runtime::Object::build(asset).value().resident_bytes();
    };
    const bool is_cone = index == 4;
    EXPECT_EQ(tapers > 0, is_cone);
    if (is_cone) {
      EXPECT_LT(bytes(b.value().asset), 0.9 * bytes(a.value().asset));
    } else {
      EXPECT_EQ(b.value().asset.parts, a.value().asset.parts);
    }
    EXPECT_LE(finest(b.value().asset, 3).eq35_percent, 0.1);
  }
}

TEST(Bake, UndoesSplitsThatDoNotLowerTheError) {
  BakeOptions options = quick_options();
  options.max_error_percent = 0.002;  // more than drafts of a cone's maps reach, however it is cut
  options.max_parts = 12;
  options.max_bytes = std::uint64_t{1} << 24;  // so that parts alone decide
  auto result = bake(test::as_source(test::cone(0.5, 1.0, 64)), options);
  ASSERT_TRUE(result.ok());
  EXPECT_LT(result.value().asset.parts.size(), 12U);
  EXPECT_EQ(result.value().stopped_by, "gain");
}

TEST(Bake, FindsThePartsBehindASplitThatDoesNotPay) {
  // Halving a cone raises the error by two thirds; the next cuts of the halves bring it to a half.
  BakeOptions options = quick_options();
  options.max_error_percent = 0.02;
  options.max_parts = 12;
  auto result = bake(test::as_source(test::cone(0.5, 1.0, 64)), options);
  ASSERT_TRUE(result.ok());
  EXPECT_LT(result.value().asset.parts.size(), 12U);
  EXPECT_EQ(result.value().stopped_by, "target");
}

TEST(Bake, AsksForFinerMapsUntilTheyAreFiner) {
  // Two fifths of the target draw the same maps as the target, two fifths of that others.
  auto result = bake(test::as_source(test::thin_sheet(1, 0.002)), {});
  ASSERT_TRUE(result.ok());
  EXPECT_LT(finest(result.value().asset, 3).depth_mean_percent, 0.25);  // with the first maps 0.56
}

TEST(Bake, SharpensSingleMapsWhereDrawingAllFinerDoesNotHelp) {
  // What a stricter target asks for are columns along the sheet; its rim needs rows.
  auto result = bake(test::as_source(test::thin_sheet(1, 0.01)), {});
  ASSERT_TRUE(result.ok());
  EXPECT_LT(finest(result.value().asset, 3).depth_mean_percent, 0.06);  // otherwise 0.116
}

#ifdef SQMAP_MESH_DIR
/// A mesh of libcgal-demo, if it is here.
std::optional<BakeResult> bake_sample(const std::string& name) {
  const auto path = std::filesystem::path(SQMAP_MESH_DIR) / name;
  if (!std::filesystem::exists(path)) return std::nullopt;
  auto mesh = read_mesh(path.string(), {});
  if (!mesh.ok()) throw std::runtime_error(mesh.error().finding);
  auto result = bake(mesh.value(), {});
  if (!result.ok()) throw std::runtime_error(result.error().finding);
  return std::move(result).value();
}

TEST(Bake, TakesThePartitionWhoseMapsNeedFewBytes) {
  // Of the partitions that refinement passes, the one that needs fewest bytes is neither the last nor the one
  // that drafts foretell to: they foretell it more bytes, and an error beyond what maps may reach.
  const auto hand = bake_sample("hand.off");
  if (!hand) GTEST_SKIP() << "no hand.off";
  EXPECT_LE(runtime::Object::build(hand->asset).value().resident_bytes(), 68000U);
  EXPECT_EQ(hand->stopped_by, "target");
  EXPECT_LE(finest(hand->asset, 3).depth_mean_percent, 0.05);
  EXPECT_LE(finest(hand->asset, 3).misclassified_3_percent, 0.6);
}

TEST(Bake, DrawsCoarserMapsWhereTheTargetAllowsThem) {
  // With the maps foretold for the target it errs less than it may.
  const auto elephant = bake_sample("elephant.off");
  if (!elephant) GTEST_SKIP() << "no elephant.off";
  EXPECT_LE(runtime::Object::build(elephant->asset).value().resident_bytes(), 60000U);
  EXPECT_LE(finest(elephant->asset, 3).depth_mean_percent, 0.05);
  EXPECT_LE(finest(elephant->asset, 3).misclassified_3_percent, 0.6);
  EXPECT_LE(finest(elephant->asset, 3).misclassified_05_percent, 3);
}

TEST(Bake, DrawsMoreThanOnePartition) {
  // One that is split on takes less than the first within the target.
  const auto dino = bake_sample("dino.off");
  if (!dino) GTEST_SKIP() << "no dino.off";
  EXPECT_LE(runtime::Object::build(dino->asset).value().resident_bytes(), 61000U);
  EXPECT_EQ(dino->stopped_by, "target");
  EXPECT_LE(finest(dino->asset, 3).depth_mean_percent, 0.05);
  EXPECT_LE(finest(dino->asset, 3).misclassified_3_percent, 0.6);
}
#endif

TEST(Bake, WritesDownEveryOptionThatDecidesTheBytes) {
  const std::string usual = BakeOptions().to_json();
  const auto changes = [&](auto&& change) {
    BakeOptions options;
    change(options);
    return options.to_json() != usual;
  };
  EXPECT_TRUE(changes([](BakeOptions& o) { o.decompose.min_hull_gain = 0.06; }));
  EXPECT_TRUE(changes([](BakeOptions& o) { o.decompose.use_hyperbolic = false; }));
  EXPECT_TRUE(changes([](BakeOptions& o) { o.decompose.locale_width = 0.02; }));
  EXPECT_TRUE(changes([](BakeOptions& o) { o.decompose.join_components = true; }));
  EXPECT_TRUE(changes([](BakeOptions& o) { o.fit.quick = true; }));
  EXPECT_TRUE(changes([](BakeOptions& o) { o.fit.taper = true; }));
  EXPECT_TRUE(changes([](BakeOptions& o) { o.fit.bend = true; }));
  EXPECT_TRUE(changes([](BakeOptions& o) { o.read.up = UpAxis::kY; }));
  EXPECT_TRUE(changes([](BakeOptions& o) { o.repair.max_hole_edges = 7; }));
  EXPECT_TRUE(changes([](BakeOptions& o) { o.seed = 2; }));
  EXPECT_TRUE(changes([](BakeOptions& o) { o.max_error_m = 0.1; }));
  EXPECT_FALSE(changes([](BakeOptions& o) { o.read.max_file_bytes = 1; }));
}

TEST(Bake, NamesTheOptionItRefuses) {
  BakeOptions options;
  options.max_error_percent = -1;
  auto result = bake(test::as_source(test::sphere(1, 2)), options);
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().status, Status::kBadOption);
  EXPECT_NE(result.error().finding.find("max_error_percent = -1"), std::string::npos);
}

TEST(Bake, TakesTheTargetAsALengthToo) {
  const SourceMesh torus = test::as_source(test::torus(1, 0.3, 48, 24));  // R_max 2.6 m
  BakeOptions share = quick_options(), length = quick_options();
  share.max_error_percent = 0.5;
  length.max_error_m = 0.013;
  auto by_share = bake(torus, share), by_length = bake(torus, length);
  ASSERT_TRUE(by_share.ok() && by_length.ok());
  const Asset &a = by_share.value().asset, &b = by_length.value().asset;
  ASSERT_EQ(a.parts.size(), b.parts.size());
  for (std::size_t k = 0; k < a.parts.size(); ++k) EXPECT_EQ(a.parts[k].map.code, b.parts[k].map.code);
  auto usual = bake(torus, quick_options());
  ASSERT_TRUE(usual.ok());
  EXPECT_NE(usual.value().asset.parts[0].map.code, b.parts[0].map.code);
}

TEST(Bake, BetterQualityHasLessErrorAndMoreBytes) {
  double last_percent = 100;
  std::size_t last_texels = 0;
  for (const Quality quality : {Quality::kDraft, Quality::kStandard, Quality::kFine}) {
    BakeOptions options;
    options.set(quality);
    auto result = bake(test::as_source(test::torus(1, 0.3, 48, 24)), options);
    ASSERT_TRUE(result.ok());
    std::size_t texels = 0;
    for (const Part& part : result.value().asset.parts) texels += part.map.code.size();
    const double percent = finest(result.value().asset, 3).eq35_percent;
    EXPECT_LT(percent, last_percent);
    EXPECT_GT(texels, last_texels);
    last_percent = percent;
    last_texels = texels;
  }
}

TEST(Bake, KeepsToTheNumberOfPartsWhateverTheNumberOfComponents) {
  // Two far rows of balls, more than are compared with each other: a part may hold many, but not of both
  // rows.
  Mesh balls;
  for (int i = 0; i < 1200; ++i) {
    const Mesh ball = test::sphere(0.3, 0);
    const auto first = static_cast<std::uint32_t>(balls.vertices_m.size());
    const int place = i / 2;
    const Vec3d centre{static_cast<double>(place), i % 2 == 0 ? 0.0 : 5000.0, 0};
    for (const Vec3d& p : ball.vertices_m) balls.vertices_m.push_back(p + centre);
    for (const auto& f : ball.faces) balls.faces.push_back({first + f[0], first + f[1], first + f[2]});
  }
  balls.source_face.resize(balls.faces.size());
  std::iota(balls.source_face.begin(), balls.source_face.end(), 0U);
  BakeOptions options;
  options.set(Quality::kDraft);
  options.max_parts = 5;
  options.sample_count = 1000;
  auto result = bake(test::as_source(balls), options);
  ASSERT_TRUE(result.ok()) << result.error().finding;
  EXPECT_LE(result.value().asset.parts.size(), 5U);
  for (const Part& part : result.value().asset.parts) EXPECT_LT(part.sphere.radius_m, 1500);
}

TEST(Bake, KeepsToTheByteBudgetAndSaysSo) {
  BakeOptions options = quick_options();
  options.max_error_percent = 0.005;
  options.max_parts = 3;
  options.max_bytes = 6000;
  auto result = bake(test::as_source(test::torus(1, 0.3, 48, 24)), options);
  ASSERT_TRUE(result.ok());
  const auto texels = [](const Asset& asset) {
    std::size_t count = 0;
    for (const Part& part : asset.parts) count += part.map.code.size();
    return count;
  };
  options.max_bytes = 1 << 20;
  auto roomy = bake(test::as_source(test::torus(1, 0.3, 48, 24)), options);
  ASSERT_TRUE(roomy.ok());
  EXPECT_LT(4 * texels(result.value().asset), texels(roomy.value().asset));
  EXPECT_EQ(result.value().stopped_by, "bytes");
}

}  // namespace
}  // namespace sqmap::bake
