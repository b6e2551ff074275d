// SPDX-License-Identifier: Apache-2.0
#include <bit>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "sqmap/asset/shape_table.hpp"
#include "sqmap/runtime/body.hpp"
#include "sqmap/runtime/contact.hpp"
#include "sqmap/runtime/object.hpp"

#include "chart.hpp"
#include "part_shape.hpp"
#include "resident.hpp"
#include "support/mixed_asset.hpp"

namespace sqmap::runtime {
namespace {

constexpr SimdTarget kTargets[] = {SimdTarget::kBaseline, SimdTarget::kSse4, SimdTarget::kAvx2,
                                   SimdTarget::kAvx512};

Object built(const Asset& asset) {
  auto object = Object::build(asset);
  EXPECT_TRUE(object.ok()) << (object ? "" : object.error().finding);
  return std::move(object).value();
}

/// Equal to the last bit but for the sign of zero; any NaN equals any.
bool same(float a, float b) { return a == b || (std::isnan(a) && std::isnan(b)); }

struct Batch {
  explicit Batch(std::size_t count)
      : distance_m(count, 77), normal(count), surface_m(count), part(count), layer(count), inside(count) {}
  Answers answers() { return {distance_m, normal, surface_m, part, layer, inside}; }
  bool holds(std::size_t i, const Answer& one) const {
    return same(distance_m[i], one.signed_distance_m) && normal[i] == one.normal &&
           surface_m[i] == one.surface_m && part[i] == one.part &&
           layer[i] == static_cast<std::uint8_t>(one.layer) && (inside[i] != 0) == one.inside;
  }
  std::vector<float> distance_m;
  std::vector<Vec3f> normal, surface_m;
  std::vector<std::uint32_t> part;
  std::vector<std::uint8_t> layer, inside;
};

class EveryTarget : public testing::TestWithParam<SimdTarget> {
 protected:
  void SetUp() override {
    before_ = simd_target();
    if (!set_simd_target(GetParam())) GTEST_SKIP() << "this processor has no such instructions";
    EXPECT_EQ(simd_target(), GetParam());
  }
  void TearDown() override { set_simd_target(before_); }

 private:
  SimdTarget before_{};
};
std::string target_name(const testing::TestParamInfo<SimdTarget>& target) {
  constexpr const char* kNames[] = {"Baseline", "Sse4", "Avx2", "Avx512"};
  return kNames[static_cast<std::size_t>(target.param)];
}
INSTANTIATE_TEST_SUITE_P(Engine, EveryTarget, testing::ValuesIn(kTargets), target_name);

TEST_P(EveryTarget, AnswersLikeTheSinglePointToTheLastBit) {
  for (const auto& [taper_share, turn_rad] : {std::pair{0.0, 0.0}, {0.9, 0.0}, {0.0, 1.5}, {0.5, 0.4}}) {
    const Asset asset = test::mixed_asset(9, taper_share, turn_rad);
    const Object object = built(asset);
    const std::vector<Vec3f> points = test::points_around(asset, 3000, 21);
    Batch batch(points.size());
    for (const Layer layer : {Layer::kOne, Layer::kTwo, Layer::kThree, Layer::kAuto}) {
      for (const auto& [level, edge_m] :
           {std::pair{0U, 0.0F}, {0U, 0.2F}, {1U, 0.0F}, {1U, 0.2F}, {7U, 0.0F}, {7U, 0.2F}}) {
        const QueryOptions options{layer, level, edge_m};
        object.query(points, batch.answers(), options);
        int differing = 0, inside = 0, known = 0, nowhere = 0;
        for (std::size_t i = 0; i < points.size(); ++i) {
          const Answer one = object.query(points[i], options);
          differing += !batch.holds(i, one);
          inside += one.inside;
          known += !std::isnan(one.signed_distance_m);
          nowhere += one.part == kNowhere;
        }
        EXPECT_EQ(differing, 0) << "layer " << int(layer) << ", level " << level << ", edge " << edge_m
                                << ", taper " << taper_share << ", turn " << turn_rad;
        EXPECT_GT(inside, 500);
        EXPECT_GT(nowhere, 100);
        EXPECT_EQ(known > 1000, layer != Layer::kOne) << known;
      }
    }
  }
}

/// Bounds that know nothing of the maps: whatever a cell is sure of, about half of its places contradict
/// them. One part has none.
Asset with_adverse_bounds(Asset asset) {
  std::mt19937_64 rng(31);
  const auto byte = [&](unsigned least, unsigned most) {
    return static_cast<std::uint8_t>(least + rng() % (most - least + 1));
  };
  for (std::size_t k = 1; k < asset.parts.size(); ++k) {
    SurfaceBounds& bounds = asset.parts[k].bounds;
    bounds.cells = static_cast<std::uint32_t>(2 * k + 1);
    bounds.tolerance_m = 1e-6;
    for (std::uint32_t cell = 0; cell < 6 * bounds.cells * bounds.cells; ++cell)
      bounds.cell.push_back(
          {byte(96, 160), byte(96, 160), byte(120, 255), byte(60, 120), byte(0, 60), byte(0, 3)});
  }
  return asset;
}

TEST_P(EveryTarget, NeverContradictsASureAnswer) {
  const Asset plain = test::mixed_asset(9, 0.7), asset = with_adverse_bounds(plain);
  const Object object = built(asset), bare = built(plain);
  const std::vector<Vec3f> points = test::points_around(asset, 4000, 32);
  const PointBody body = PointBody::build(points).value();
  std::vector<Certainty> told(points.size());
  object.certainty(points, told);
  Batch batch(points.size());
  std::vector<Contact> contacts(points.size());
  for (const Layer layer : {Layer::kTwo, Layer::kThree, Layer::kAuto}) {
    for (const std::uint32_t level : {0U, 1U}) {
      const QueryOptions options{layer, level};
      object.query(points, batch.answers(), options);
      int differing = 0, sure = 0, contradicted = 0, otherwise = 0, distances = 0;
      std::size_t touching = 0;
      for (std::size_t i = 0; i < points.size(); ++i) {
        const Answer one = object.query(points[i], options);
        differing += !batch.holds(i, one);
        touching += one.inside;
        ASSERT_FALSE(one.inside ? one.signed_distance_m > 0 : one.signed_distance_m < 0);
        if (told[i] == Certainty::kUnsure || one.part == kNowhere) continue;
        ++sure;
        contradicted += one.inside != (told[i] == Certainty::kInside);
        otherwise += one.inside != bare.query(points[i], options).inside;
        distances += !std::isnan(one.signed_distance_m);
      }
      SCOPED_TRACE("layer " + std::to_string(int(layer)) + ", level " + std::to_string(level));
      EXPECT_EQ(differing, 0);
      EXPECT_EQ(contradicted, 0);
      EXPECT_EQ(object.contacts(body, {}, contacts, {options}), touching);
      EXPECT_GT(sure, 1000);
      EXPECT_GT(otherwise, sure / 4) << "the bounds no longer contradict the maps";
      EXPECT_GT(distances, sure / 2);
    }
  }
}

TEST_P(EveryTarget, AnswersBatchesOfAnyLengthAndWritesNothingBeyond) {
  const Asset asset = test::mixed_asset();
  const Object object = built(asset);
  const std::vector<Vec3f> points = test::points_around(asset, 1100, 22);
  for (const std::size_t count : {0U, 1U, 3U, 15U, 16U, 17U, 511U, 512U, 513U, 1100U}) {
    Batch batch(points.size());
    Answers answers = batch.answers();
    answers.signed_distance_m = answers.signed_distance_m.first(count);
    answers.normal = answers.surface_m = {};
    answers.part = {};
    answers.layer = answers.inside = {};
    object.query(std::span(points).first(count), answers);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const float expected = i < count ? object.query(points[i]).signed_distance_m : 77;
      ASSERT_TRUE(same(batch.distance_m[i], expected)) << i << " of " << count;
    }
  }
}

TEST_P(EveryTarget, FindsNothingForPointsThatAreNotFiniteAndLeavesTheirNeighboursAlone) {
  const Asset asset = test::mixed_asset();
  const Object object = built(asset);
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(),
                  kInf = std::numeric_limits<float>::infinity();
  std::vector<Vec3f> points = test::points_around(asset, 64, 23);
  const std::vector<Vec3f> clean = points;
  const Vec3f bad[] = {{kNan, 0, 0},  {0, kNan, 0},       {0, 0, kNan},         {kInf, 0, 0},
                       {0, -kInf, 0}, {kNan, kInf, kNan}, {1e38F, 1e38F, 1e38F}};
  for (std::size_t i = 0; i < std::size(bad); ++i) points[5 + 7 * i] = bad[i];
  Batch batch(points.size());
  object.query(points, batch.answers());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const bool replaced = !(points[i] == clean[i]);  // NaN: replaced
    EXPECT_TRUE(batch.holds(i, replaced ? Answer{} : object.query(clean[i]))) << i;
  }
}

TEST_P(EveryTarget, FiniteForDenormalsCentresAxesAndSeams) {
  const Object object = built(test::mixed_asset());
  std::vector<Vec3f> points;
  for (const float x : {-1.0F, -0.5F, -1e-30F, -1e-42F, 0.0F, 1e-42F, 0.5F, 1.0F}) {
    for (const float y : {-0.5F, 0.0F, 1e-42F, 0.5F}) {
      for (const float z : {-0.5F, -0.0F, 1e-40F, 0.5F}) points.push_back({x, y, z});
    }
  }
  Batch batch(points.size());
  for (const Layer layer : {Layer::kTwo, Layer::kThree}) {
    object.query(points, batch.answers(), {layer});
    for (std::size_t i = 0; i < points.size(); ++i) {
      ASSERT_FALSE(std::isinf(batch.distance_m[i]));
      ASSERT_TRUE(std::isfinite(batch.normal[i].x) && std::isfinite(batch.surface_m[i].x));
    }
  }
}

TEST(Engine, AnswersScaleWithTheObject) {
  // Lengths are kept in units near the object's radius, so a power of two changes nothing but the exponent.
  const Object plain = built(test::mixed_asset());
  const std::vector<Vec3f> points = test::points_around(test::mixed_asset(), 500, 24);
  for (const int exponent : {-40, -3, 20, 44}) {
    const double factor = std::ldexp(1.0, exponent);
    const Object scaled = built(test::scaled(test::mixed_asset(), factor));
    int known = 0;
    for (const Vec3f& p : points) {
      const Answer a = plain.query(p, {Layer::kThree});
      const Answer b = scaled.query(static_cast<float>(factor) * p, {Layer::kThree});
      EXPECT_TRUE(same(b.signed_distance_m, static_cast<float>(factor) * a.signed_distance_m));
      EXPECT_EQ(a.normal, b.normal);
      known += !std::isnan(a.signed_distance_m);
    }
    EXPECT_GT(known, 100);
  }
}

TEST(Engine, FirstLayerAgreesWithTheExactFunction) {
  std::mt19937_64 rng(25);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (const double e1 : {0.1, 0.3, 1.0, 1.7, 2.0}) {
    for (const double e2 : {0.1, 0.6, 1.0, 2.0}) {
      Asset asset = test::mixed_asset();
      asset.parts.resize(1);
      const double taper_share = e2 == 0.6 ? 0.95 : e2 == 1.0 ? -0.4 : 0;
      asset.parts[0].shape = {{0.5, 0.3, 0.8}, e1, e2, taper_share * max_taper(e1)};
      asset.parts[0].object_from_part = {};
      const Resident resident(asset);
      const double per_m = resident.units_per_m();
      int inside = 0, wrong = 0;
      for (int i = 0; i < 2000; ++i) {
        const Vec3d d{0.5 * unit(rng), 0.3 * unit(rng), 0.8 * unit(rng)};
        const double radial = inside_outside_radial(asset.parts[0].shape, d);
        // On the surface but for 1e-5: nearer than any distance that the maps tell apart.
        const double off = i % 2 == 0 ? 1 - 1e-5 : 1 + 1e-5;
        const Vec3f p = cast<float>((per_m * off / radial) * d);
        wrong += in_superquadric(resident.part(0), p) != (off < 1);
        inside += off < 1;
      }
      EXPECT_EQ(wrong, 0) << e1 << ' ' << e2;
      EXPECT_EQ(inside, 1000);
    }
  }
}

// The planes must hold the whole superquadric, or points are lost; and touch it, or they cull nothing.
TEST(Engine, SlabsTouchTheSuperquadricFromOutside) {
  std::mt19937_64 rng(27);
  std::uniform_real_distribution<double> angle(0, std::acos(0.0));
  for (const double e1 : {0.1, 0.5, 1.0, 1.6, 2.0}) {
    for (const double e2 : {0.1, 0.7, 1.0, 2.0}) {
      const double taper_share = e2 == 0.7 ? 0.95 : e2 == 1.0 ? -0.4 : 0;
      const Superquadric shape{{0.5, 0.3, 0.8}, e1, e2, taper_share * max_taper(e1)};
      const Vec3d a = half_extents_m(shape);
      const Slabs slabs =
          Slabs::of({static_cast<float>(1 / a.x), static_cast<float>(1 / a.y), static_cast<float>(1 / a.z)},
                    e1, e2, shape.taper);
      double across = 0, up = 0, diagonal = 0;
      for (int i = 0; i < 40000; ++i) {
        const double eta = angle(rng), omega = angle(rng), side = i % 2 == 0 ? 1 : -1;
        const Vec3d d{std::cos(eta) * std::cos(omega) * a.x, std::cos(eta) * std::sin(omega) * a.y,
                      side * std::sin(eta) * a.z};
        const Vec3d r = (1 / inside_outside_radial(shape, d)) * d;
        const Vec3d w{r.x / a.x, r.y / a.y, side * r.z / a.z};
        across = std::max(across, w.x + w.y);
        up = std::max(up, std::max(w.x, w.y) + w.z);
        diagonal = std::max(diagonal, w.x + w.y + w.z);
      }
      for (const auto& [found, bound] :
           {std::pair{across, slabs.across}, {up, slabs.up}, {diagonal, slabs.diagonal}}) {
        EXPECT_LT(found, bound) << e1 << ' ' << e2;
        EXPECT_GT(found, 0.98 * double{bound}) << e1 << ' ' << e2;
      }
    }
  }
}

/// An asset of one part whose rows are so long that they begin at even texels only. With more than 65536
/// texels keys of lists and words of rows take 32 bits.
Asset wide_asset(std::uint32_t rows, std::uint32_t cols) {
  const std::vector<test::Ball> balls{{{0.2, 0, 0}, 0.3}, {{-0.4, 0.1, 0.1}, 0.25}};
  Part part = test::traced_part({{1, 0.8, 0.6}, 0.7, 1.1}, {}, rows, cols, 3, 1.5,
                                [&](const Vec3d& origin_m, const Vec3d& direction, bool& inside) {
                                  return test::union_crossings_m(balls, origin_m, direction, inside);
                                });
  // Now and then a hit, so that few rows have a long run of misses.
  for (std::uint32_t texel = 0; texel < part.map.code.size(); texel += 97)
    if (part.map.code[texel] == part.map.miss_code()) part.map.code[texel] = 5;
  for (std::uint32_t cell = 3; cell < (rows - 1) * cols; cell += 1001)
    part.map.vertex_samples.push_back({cell, 7, 9, 11});
  return test::asset_of({std::move(part)}, 2);
}

TEST(FanDepth, IsLinearOnTheTrianglesBetweenTheSampleAndTheSides) {
  const float corner[4] = {1, 2, 4, 7}, apex = 9;
  const float place[4][2] = {{0, 0}, {0, 1}, {1, 0}, {1, 1}};
  for (const auto& [at_s, at_t] : {std::pair{0.5F, 0.25F}, {0.0F, 0.75F}, {0.0F, 0.0F}, {0.9F, 0.99F}}) {
    SCOPED_TRACE(at_s);
    EXPECT_EQ(fan_depth(corner, at_s, at_t, at_s, at_t, apex), apex);
    for (const auto& [i, j] : {std::pair{0, 1}, {1, 3}, {3, 2}, {2, 0}}) {  // the sides
      for (const float u : {0.1F, 0.5F, 0.8F}) {
        for (const float v : {0.2F, 0.7F, 1.0F}) {  // v of the way from the sample to the place u of the side
          const float rim_s = place[i][0] + u * (place[j][0] - place[i][0]);
          const float rim_t = place[i][1] + u * (place[j][1] - place[i][1]);
          if (rim_s == at_s || rim_t == at_t)
            continue;  // on a side through the sample: a triangle without area
          const float rim = corner[i] + u * (corner[j] - corner[i]);
          EXPECT_NEAR(
              fan_depth(corner, at_s + v * (rim_s - at_s), at_t + v * (rim_t - at_t), at_s, at_t, apex),
              apex + v * (rim - apex), 1e-4);
        }
      }
    }
  }
}

TEST(Resident, HoldsEveryCodeStartSheetAndSample) {
  std::vector<Asset> assets{wide_asset(33, 8192), wide_asset(33, 1600)};
  for (const std::uint32_t bits : {4U, 7U, 8U, 11U, 16U}) assets.push_back(test::mixed_asset(bits));
  EXPECT_GT(Resident(assets[0]).part(0).row_shift, 0);
  EXPECT_TRUE(Resident(assets[0]).part(0).wide_keys);
  EXPECT_GT(Resident(assets[1]).part(0).row_shift, 0);
  EXPECT_FALSE(Resident(assets[1]).part(0).wide_keys);
  for (const Asset& asset : assets) {
    const Resident resident(asset);
    ASSERT_TRUE(resident.fits());
    std::size_t sheets = 0, samples = 0, starts = 0;
    for (std::uint32_t k = 0; k < resident.part_count(); ++k) {
      const DistanceMap& map = asset.parts[k].map;
      const PartRecord& part = resident.part(k);
      for (std::uint32_t texel = 0; texel < map.rows * map.cols; ++texel) {
        const std::uint32_t held =
            resident.texel(part, resident.row(part, texel / map.cols), texel % map.cols);
        ASSERT_EQ(held & part.miss_code(), map.code[texel]);
        ASSERT_EQ(held > part.miss_code(), map.starts_inside(texel));
        starts += map.starts_inside(texel);
      }
      for (std::uint32_t i = 0; i < map.crossings.size(); ++i) {
        std::uint32_t at = resident.find(part, part.sheets, map.crossings[i].texel);
        ASSERT_LE(at, i);
        while (at < i && resident.key(part, part.sheets, at) == map.crossings[i].texel) ++at;
        ASSERT_EQ(at, i);
        ASSERT_EQ(resident.sheet_code(part, at), map.crossings[i].code);
      }
      for (const auto& sample : map.vertex_samples) {
        const std::uint32_t at = resident.find(part, part.fans, sample.cell);
        ASSERT_LT(at, part.fans.count);
        ASSERT_EQ(resident.key(part, part.fans, at), sample.cell);
        ASSERT_EQ(resident.fan_code(part, at), sample.code);
        ASSERT_EQ(resident.fan_place(part, at), sample.row_256ths | sample.col_256ths << 8);
      }
      sheets += map.crossings.size();
      samples += map.vertex_samples.size();
    }
    EXPECT_GT(sheets, 50U);
    EXPECT_GT(samples, 50U);
    if (asset.parts.size() > 1) {
      EXPECT_GT(starts, 50U);
    }
  }
}

TEST(Resident, AnswersFromRowsThatBeginAtEvenTexels) {
  const Asset asset = wide_asset(33, 8192);
  const Resident resident(asset);
  ShapeTable<float> table;
  resident.unpack(resident.part(0), table);
  const Chart chart(resident, resident.part(0), table);
  const runtime::Object object = built(asset);
  std::mt19937_64 rng(8);
  std::uniform_real_distribution<float> unit(-1, 1);
  std::vector<Vec3f> points(4000);
  for (Vec3f& p : points) p = {unit(rng), 0.8F * unit(rng), 0.6F * unit(rng)};
  std::vector<float> told(points.size());
  Answers answers;
  answers.signed_distance_m = told;
  object.query(points, answers, {Layer::kThree, 0});
  std::size_t asked = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3f p = resident.units_per_m() * points[i];
    if (!in_superquadric(resident.part(0), p)) continue;
    ++asked;
    const ChartAnswer answer = chart.look(p, true, 0, 0);
    if (!std::isfinite(answer.distance)) continue;
    ASSERT_EQ(told[i], (answer.inside ? -1.0F : 1.0F) * (resident.unit_m() * answer.distance)) << i;
  }
  EXPECT_GT(asked, 1000U);
}

TEST(Engine, FindsTheNearerOfTwoPlacesOutsideThem) {
  // Above the gap between two balls, rays of the superquadric meet the large one, also where the small one is
  // nearer: a search that begins at the foot alone ends on the wrong one.
  const std::vector<test::Ball> balls{{{-0.35, 0, 0}, 0.6}, {{0.75, 0.1, 0}, 0.22}};
  Part part = test::traced_part({{1.0, 0.7, 0.7}, 1.0, 1.0}, {}, 65, 128, 3, 1.5,
                                [&](const Vec3d& origin_m, const Vec3d& direction, bool& inside) {
                                  return test::union_crossings_m(balls, origin_m, direction, inside);
                                });
  const runtime::Object object = built(test::asset_of({std::move(part)}, 2));
  std::mt19937_64 rng(9);
  std::uniform_real_distribution<float> unit(-1, 1);
  std::vector<Vec3f> points;
  std::vector<double> truth;
  while (points.size() < 4000) {
    const Vec3f p{unit(rng), 0.7F * unit(rng), 0.7F * unit(rng)};
    double nearest = 10;
    for (const test::Ball& ball : balls)
      nearest = std::min(nearest, norm(cast<double>(p) - ball.centre_m) - ball.radius_m);
    if (!(nearest > 0.02)) continue;
    points.push_back(p);
    truth.push_back(nearest);
  }
  std::vector<float> told(points.size());
  Answers answers;
  answers.signed_distance_m = told;
  object.query(points, answers, {Layer::kThree, 0});
  std::size_t known = 0, wrong = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    known += !std::isnan(told[i]);
    wrong += told[i] > truth[i] + 0.05;
  }
  EXPECT_GT(known, 1000U);
  EXPECT_LT(100 * wrong, 4 * known);  // otherwise 18 in a hundred
}

/// Texels of a row that memory must hold: without all but one of the longest run, round the turn, of those
/// that hit nothing and start alike; one more than all where no two are.
std::size_t held_of_row(const DistanceMap& map, std::uint32_t row) {
  const auto alike = [&](std::uint32_t a, std::uint32_t b) {
    a = row * map.cols + a % map.cols;
    b = row * map.cols + b % map.cols;
    return map.code[a] == map.miss_code() && map.code[b] == map.miss_code() &&
           map.starts_inside(a) == map.starts_inside(b);
  };
  std::uint32_t most = 0;
  for (std::uint32_t from = 0; from < map.cols; ++from) {
    std::uint32_t count = 0;
    while (count < map.cols && alike(from, from + count)) ++count;
    most = std::max(most, count);
  }
  return most < 2 ? map.cols + 1 : map.cols - most + 1;
}

TEST(Resident, TakesTheBytesItsFormulaSays) {
  for (const auto& [taper_share, turn_rad] : {std::pair{0.0, 0.0}, {0.5, 0.0}, {0.5, 1.0}}) {
    const Asset asset = test::mixed_asset(7, taper_share, turn_rad);
    const Resident resident(asset);
    std::size_t bytes = 4;
    for (std::uint32_t k = 0; k < resident.part_count(); ++k) {
      const Part& part = asset.parts[k];
      const std::size_t texels = part.map.code.size();
      bool seam = false;
      for (const std::uint8_t b : part.map.start_inside) seam = seam || b != 0;
      std::size_t held = 0;
      for (std::uint32_t row = 0; row < part.map.rows; ++row) held += held_of_row(part.map, row);
      bytes += sizeof(PartRecord) + 388 + std::size_t{3} * (part.map.rows + 1);
      bytes += (held * (part.map.bits + (seam ? 1U : 0U)) + 7) / 8;
      if (part.shape.taper != 0) bytes += 212;
      const std::size_t starts = resident.part(k).starts.bytes();
      EXPECT_GT(starts, 3 * 180U / 2);
      EXPECT_LE(starts, 3 * 256U / 2);
      bytes += starts;
      const std::size_t blocks = (texels + 63) / 64;
      if (!part.map.crossings.empty()) bytes += blocks + 4 * part.map.crossings.size();
      if (!part.map.vertex_samples.empty()) bytes += blocks + 6 * part.map.vertex_samples.size();
    }
    EXPECT_EQ(resident.size(), bytes);
    EXPECT_LE(sizeof(PartRecord), 256U);
    EXPECT_GT(built(asset).resident_bytes(), bytes);
    EXPECT_LT(built(asset).resident_bytes(), bytes + 200);
  }
}

TEST(Resident, CurvesErrByLessThanAHundredThousandth) {
  constexpr int kCells = CurveTable<double>::kCells;
  for (const double e : {0.1, 0.5, 1.0, 1.5, 2.0}) {
    for (const Vec3d axes : {Vec3d{1, 0.9, 0.8}, Vec3d{1, 0.05, 0.05}, Vec3d{0.03, 1, 0.5}}) {
      for (const double taper : {0.0, 0.6, -0.6}) {
        Asset asset = test::mixed_asset();
        asset.parts.resize(1);
        asset.parts[0].shape = {axes, e, 2 - 0.9 * e};
        asset.parts[0].shape.taper = taper;
        const Resident resident(asset);
        ShapeTable<float> table;
        resident.unpack(resident.part(0), table);
        const double across = std::sqrt(axes.x * axes.y);
        const auto eta = CurveTable<double>::of(across, axes.z, e, taper).tapered(taper);
        double arc = 0;
        for (int k = 1; k <= kCells; ++k)
          arc += std::hypot(across * (eta.c[k] - eta.c[k - 1]), axes.z * (eta.s[k] - eta.s[k - 1])) / kCells;
        for (int k = 0; k <= kCells; ++k) {
          EXPECT_NEAR(table.eta.c[k], eta.c[k], 8e-6);
          EXPECT_NEAR(table.eta.s[k], eta.s[k], 8e-6);
          // As shares of an arc: radians, or of the length.
          EXPECT_NEAR(across / arc * table.eta.c_step[k], across / arc * eta.c_step[k], 5e-5);
          EXPECT_NEAR(axes.z / arc * table.eta.s_step[k], axes.z / arc * eta.s_step[k], 5e-5);
          if (k == 0 || taper != 0) continue;
          // Differences of neighbours make the curvature.
          EXPECT_NEAR(table.eta.c[k] - table.eta.c[k - 1], eta.c[k] - eta.c[k - 1],
                      1.6e-5 * (eta.c[k - 1] - eta.c[k]) + 1e-5);
        }
        EXPECT_EQ(table.eta.c[kCells], 0) << "a pole lies on the axis";
        EXPECT_EQ(table.eta.s[0], 0);
      }
    }
  }
}

// Against exhaustive search on a grid of 161 x 161 nodes an octant; exponents and ratios that the baker
// makes.
TEST(FootPoint, IsTheNearestOfAllButFewPoints) {
  constexpr std::uint32_t kNodes = 160;
  std::mt19937_64 rng(26);
  std::uniform_real_distribution<double> unit(-1, 1);
  int count = 0, worse = 0, much_worse = 0;
  for (const double e1 : {0.3, 0.5, 1.0, 1.5}) {
    for (const double e2 : {0.3, 0.5, 1.0, 1.5}) {
      for (const Vec3d& a : {Vec3d{1, 0.8, 0.7}, Vec3d{1, 0.6, 0.3}, Vec3d{1, 1, 0.1}, Vec3d{0.2, 0.2, 2},
                             Vec3d{0.05, 1, 0.5}, Vec3d{0.05, 0.05, 1}}) {
        const Superquadric shape{a, e1, e2};
        const ShapeTable<float> table(shape, 65, 128);
        const auto eta = quadrant_nodes(std::sqrt(a.x * a.y), a.z, e1, kNodes);
        const auto omega = quadrant_nodes(a.x, a.y, e2, kNodes);
        for (int i = 0; i < 24; ++i, ++count) {
          const Vec3d d{a.x * unit(rng), a.y * unit(rng), a.z * unit(rng)};
          const double reach = i % 2 == 0 ? std::cbrt(std::abs(unit(rng))) : 0.8 + 0.2 * std::abs(unit(rng));
          const Vec3d m = (reach / inside_outside_radial(shape, d)) * d;
          const Vec3f q{std::abs(static_cast<float>(m.x)), std::abs(static_cast<float>(m.y)),
                        std::abs(static_cast<float>(m.z))};
          float least = std::numeric_limits<float>::infinity();
          for (const auto& e : eta) {
            for (const auto& o : omega) {
              const Vec3f r = cast<float>(surface_point(shape, e, o)) - q;
              least = std::min(least, dot(r, r));
            }
          }
          const double excess = (table.foot(cast<float>(m)).depth_m - std::sqrt(least)) / norm(a);
          EXPECT_GT(excess, -5e-3);
          worse += excess > 1e-3;
          much_worse += excess > 1e-2;
        }
      }
    }
  }
  EXPECT_LE(worse, count * 6 / 1000);
  EXPECT_LE(much_worse, count / 1000);
}

}  // namespace
}  // namespace sqmap::runtime
