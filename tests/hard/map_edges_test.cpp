// SPDX-License-Identifier: Apache-2.0
// Where maps end and wrap: rays that miss beside rays that hit, the columns between the last and the first,
// the rows at the poles. On every instruction set, against exact distances to a ball.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "sqmap/asset/shape_table.hpp"
#include "sqmap/runtime/object.hpp"

#include "hard/shells.hpp"

namespace sqmap::runtime {
namespace {

const test::Ball kBall{{0.1, -0.05, 0.2}, 0.8};  // of test::ball_in_ellipsoid
constexpr std::uint32_t kRows = 65, kCols = 128;

struct Place {
  std::string name;
  Vec3f p;
  double above_m;          ///< height over the ball's surface along the ray
  double exact_m;          ///< signed distance to the ball
  bool nearest_ray_hits;   ///< of the cell's four
  bool is_tie;             ///< of the cell's four rays, two are as near as the foot search tells
  double nearest_hit_m{};  ///< from there to where the nearest texel's ray meets the ball
};

/// Points over chosen cells of the ball's map, up to 5 cm above and below the surface on their own rays.
class Places {
 public:
  explicit Places(const Part& part)
      : map_(part.map), grid_(part.shape, kRows, kCols), table_(part.shape, kRows, kCols) {}

  void add(int count, double row_from, double row_to, double col_from, double col_to) {
    std::uniform_real_distribution<double> unit(0, 1);
    for (int i = 0; i < count; ++i) {
      const double row = row_from + (row_to - row_from) * unit(rng_),
                   col = col_from + (col_to - col_from) * unit(rng_);
      const SurfaceSample<double> r = table_.sample(row, col);
      const double above_m = 0.1 * unit(rng_) - 0.05;
      const Vec3d p = r.point_m - (crossing_m(r.point_m, r.normal) - above_m) * r.normal;
      const auto near_row = static_cast<std::uint32_t>(std::lround(row)),
                 near_col = static_cast<std::uint32_t>(std::lround(col)) % kCols;
      const Vec3d node = grid_.point(near_row, near_col), n = grid_.normal(near_row, near_col);
      const Vec3d hit = node - crossing_m(node, n) * n;
      places.push_back({name_of(row, col), cast<float>(p), above_m, norm(p - kBall.centre_m) - kBall.radius_m,
                        map_.code[near_row * kCols + near_col] != map_.miss_code(),
                        is_tie(row) || is_tie(col), norm(p - hit)});
    }
  }
  std::vector<Place> places;

 private:
  static double crossing_m(const Vec3d& r, const Vec3d& n) {
    bool inside = false;
    return test::union_crossings_m({kBall}, r, -n, inside).front();
  }
  static bool is_tie(double place) { return std::abs(place - std::floor(place) - 0.5) < 0.02; }
  std::string name_of(double row, double col) const {
    const auto low = std::min(static_cast<std::uint32_t>(row), kRows - 2),
               left = static_cast<std::uint32_t>(col);
    int hits = 0;
    for (const std::uint32_t r : {low, low + 1})
      for (const std::uint32_t c : {left, (left + 1) % kCols})
        hits += map_.code[r * kCols + c] != map_.miss_code();
    if (hits == 0) return "misses";
    if (hits < 4) return "miss beside hit";
    if (low == 0 || low == kRows - 2) return low == 0 ? "first row" : "last row";
    return left + 1 == kCols ? "column wrap" : "elsewhere";
  }
  DistanceMap map_;
  MapGrid grid_;
  ShapeTable<double> table_;
  std::mt19937_64 rng_{73};
};

/// Asks layers 2 and 3 on every target; `expect` gets place, layer, inside, distance and normal.
template <class Expect>
void for_each_answer(const Asset& asset, const std::vector<Place>& places, const Expect& expect) {
  const auto object = Object::build(asset);
  ASSERT_TRUE(object.ok());
  std::vector<Vec3f> points;
  for (const Place& place : places) points.push_back(place.p);
  test::for_each_target([&](SimdTarget target) {
    for (const Layer layer : {Layer::kTwo, Layer::kThree}) {
      test::Batch batch(points.size());
      object.value().query(points, batch.answers(), {layer});
      for (std::size_t i = 0; i < points.size(); ++i) {
        SCOPED_TRACE(places[i].name + ", layer " + std::to_string(static_cast<int>(layer)) + ", target " +
                     std::to_string(static_cast<int>(target)));
        expect(places[i], layer, batch.inside[i] != 0, static_cast<double>(batch.distance_m[i]),
               cast<double>(batch.normal[i]));
      }
    }
  });
}

// Layer 2 measures along the ray, layer 3 to the nearest place. The map errs by its bilinear depths.
void expect_like_everywhere(const Place& at, Layer layer, bool inside, double distance_m,
                            const Vec3d& normal) {
  EXPECT_NEAR(distance_m, layer == Layer::kTwo ? at.above_m : at.exact_m, layer == Layer::kTwo ? 3e-3 : 5e-4);
  if (std::abs(at.exact_m) > 5e-4) {
    EXPECT_EQ(inside, at.exact_m < 0);
  }
  EXPECT_GT(dot(normal, normalized(cast<double>(at.p) - kBall.centre_m)), 0.998);
}

TEST(MapEdges, WrapAndPolesTellTheDistanceToABallLikeTheRest) {
  const Asset asset = test::ball_in_ellipsoid(kBall.radius_m, kRows, kCols);
  Places places(asset.parts[0]);
  places.add(200, 0, 1, 0, kCols);
  places.add(200, kRows - 2, kRows - 1, 0, kCols);
  places.add(200, 1, kRows - 2, kCols - 1, kCols);
  places.add(200, 0, kRows - 1, 0, kCols);
  std::map<std::string, int> counts;
  for (const Place& place : places.places) ++counts[place.name];
  for (const char* name : {"first row", "last row", "column wrap", "elsewhere"})
    EXPECT_GT(counts[name], 100) << name;
  for_each_answer(asset, places.places, expect_like_everywhere);
}

// The ball's map with every ray beyond columns 32 to 95 a miss: x < 0, the wrap, and half of each pole.
TEST(MapEdges, RaysThatMissLeaveThoseBesideThemAlone) {
  Asset asset = test::ball_in_ellipsoid(kBall.radius_m, kRows, kCols);
  DistanceMap& map = asset.parts[0].map;
  for (std::uint32_t texel = 0; texel < kRows * kCols; ++texel)
    if (texel % kCols < 32 || texel % kCols > 95) map.code[texel] = map.miss_code();
  // The far side of the ball, where rays leave it, is further down than 1 m for most.
  map.crossings.clear();
  Places places(asset.parts[0]);
  places.add(600, 0, kRows - 1, 31, 32);
  places.add(600, 0, kRows - 1, 95, 96);
  places.add(200, 0, 1, 0, kCols);
  places.add(200, kRows - 2, kRows - 1, 0, kCols);
  places.add(400, 0, kRows - 1, 36, 91);
  places.add(200, 0, kRows - 1, 97, kCols);
  std::map<std::string, int> counts;
  int found = 0, sides = 0, wrong_sides = 0;
  double worst_m = 0;
  for_each_answer(asset, places.places,
                  [&](const Place& at, Layer layer, bool inside, double distance_m, const Vec3d& normal) {
                    ++counts[at.name];
                    if (at.name == "elsewhere")
                      return expect_like_everywhere(at, layer, inside, distance_m, normal);
                    if (at.name == "misses") {
                      EXPECT_FALSE(inside);
                      EXPECT_TRUE(std::isnan(distance_m));
                      return;
                    }
                    // The nearest ray decides the side, by where it crosses: up to half a cell beside the
                    // point.
                    if (std::abs(at.above_m) < 0.02 || at.is_tie) return;
                    ++sides;
                    wrong_sides += inside != (at.nearest_ray_hits && at.above_m < 0);
                    if (at.name != "miss beside hit" || !inside) return;
                    ++found;
                    // Never nearer than the ball, never farther than that ray's crossing.
                    EXPECT_LT(distance_m, at.exact_m + 1e-3);
                    EXPECT_GT(distance_m, -at.nearest_hit_m - 1e-3);
                    EXPECT_NEAR(norm(normal), 1, 1e-4);
                    if (layer == Layer::kThree) worst_m = std::max(worst_m, at.exact_m - distance_m);
                  });
  RecordProperty("worst_m_beside_a_miss_in_layer_3", std::to_string(worst_m));
  for (const char* name : {"miss beside hit", "misses", "elsewhere"}) EXPECT_GT(counts[name], 200) << name;
  EXPECT_GT(found, 200);
  RecordProperty("sides", sides);
  RecordProperty("wrong_sides", wrong_sides);
  EXPECT_GT(sides, 1000);
  EXPECT_LE(wrong_sides, sides / 100);
  EXPECT_LT(worst_m, 0.03) << "a cell is 0.05 m wide";
}

}  // namespace
}  // namespace sqmap::runtime
