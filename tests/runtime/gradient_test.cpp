// SPDX-License-Identifier: Apache-2.0
// The gradient of the third layer's distance against differences, at every branch of its search.
#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "sqmap/runtime/object.hpp"

#include "chart.hpp"
#include "resident.hpp"
#include "support/branches.hpp"
#include "support/mixed_asset.hpp"

namespace sqmap::runtime {
namespace {

const bool kIsSeeded = test::seed_rapidcheck("seed=2007 max_success=4000");

using test::Branches;
using test::check;
using test::share;
using test::vector;

struct Held {
  Asset asset = test::mixed_asset();
  Resident resident{asset};
  Object object = std::move(Object::build(asset)).value();
  std::vector<ShapeTable<float>> tables;
  Held() : tables(resident.part_count()) {
    for (std::uint32_t k = 0; k < resident.part_count(); ++k) resident.unpack(resident.part(k), tables[k]);
  }
  Chart chart(std::uint32_t k) const { return {resident, resident.part(k), tables[k]}; }
};
const Held& held() {
  static const Held kHeld;
  return kHeld;
}

constexpr double kStep = 1e-3;     // units
constexpr double kNearest = 0.03;  // nearer to the surface the direction to it is that of the solver's rest

/// A point of a part's superquadric, part frame, units.
Vec3d point_of(std::uint32_t k) {
  const Superquadric& shape = held().asset.parts[k].shape;
  const Vec3d v = vector();
  RC_PRE(norm(v) > 0.1);
  const Vec3d d{shape.semi_axes_m.x * v.x, shape.semi_axes_m.y * v.y, shape.semi_axes_m.z * v.z};
  const double reach = 0.99 * std::cbrt(std::abs(share()));
  return (static_cast<double>(held().resident.units_per_m()) * reach / inside_outside_radial(shape, d)) * d;
}

/// Where the third layer's answer came from: one name, and what happened on the way.
std::string source_of(std::uint32_t k, const Vec3f& p, const ChartAnswer& here, Branches& branches) {
  const Resident& resident = held().resident;
  const PartRecord& part = resident.part(k);
  const ChartAnswer start = held().chart(k).look(p, false, 0, 0);
  if (start.has_point && here.distance == start.distance && here.surface == start.surface)
    return start.bounds_patch ? "further sheet" : "crossing without a patch";
  const auto rows = static_cast<float>(part.rows), cols = static_cast<float>(part.cols);
  const float off_cols = std::abs(here.col - start.col);
  if (here.row < 1 || here.row > rows - 2) branches.take("pole");
  if (off_cols > cols / 2) branches.take("column wrap");
  if (!start.bounds_patch) branches.take("start beside");
  if (std::abs(here.row - start.row) > 6 ||
      (std::min(off_cols, cols - off_cols) > 6 && here.row > 4 && here.row < rows - 5))
    branches.take("far from the foot");
  const std::uint32_t cell = std::min(static_cast<std::uint32_t>(here.row), part.rows - 2U) * part.cols +
                             std::min(static_cast<std::uint32_t>(here.col), part.cols - 1U);
  const std::uint32_t at = resident.find(part, part.fans, cell);
  if (at < part.fans.count && resident.key(part, part.fans, at) == cell) return "vertex fan";
  return here.faces_patch ? "patch" : "rim";
}

// The distance to a nearest place grows along the line from there, whatever kind of place it is. Its gradient
// is not always the normal: at a rim, on a fan's edge or a lone crossing the line leaves the surface askew.
TEST(ThirdLayerGradient, PointsAwayFromTheNearestPlaceAtEveryBranch) {
  Branches branches;
  check([&] {
    const int part_count = static_cast<int>(held().tables.size());
    const auto k =
        static_cast<std::uint32_t>(*rc::gen::resize(rc::kNominalSize, rc::gen::inRange(0, part_count)));
    const Chart chart = held().chart(k);
    const Vec3d p = point_of(k);
    const auto at = [&](const Vec3d& q) { return chart.look(cast<float>(q), true, 0, 0); };
    const ChartAnswer here = at(p);
    if (!std::isfinite(here.distance)) return branches.take("no distance");
    const auto distance = static_cast<double>(here.distance);
    RC_PRE(distance > kNearest);
    const Vec3d along = normalized(vector() + Vec3d{1e-3, 0, 0});
    const auto ahead = static_cast<double>(at(p + kStep * along).distance),
               behind = static_cast<double>(at(p - kStep * along).distance);
    if (!std::isfinite(ahead) || !std::isfinite(behind)) return branches.take("beside no distance");
    branches.take("all");
    const std::string source = source_of(k, cast<float>(p), here, branches);
    const Vec3d away = (1 / distance) * (p - cast<double>(here.surface));
    RC_ASSERT(std::abs(norm(away) - 1) < 1e-5);
    // The distance itself changes no faster than the point moves, and bends only where the place is another.
    if (std::max(std::abs(ahead - distance), std::abs(behind - distance)) > 1.1 * kStep)
      return branches.take("jump");
    if (std::abs(ahead - 2 * distance + behind) > 0.2 * kStep) return branches.take("ridge");
    branches.take(source);
    const double slope = (ahead - behind) / (2 * kStep);
    if (std::abs(slope - dot(away, along)) > 0.2) branches.take(source + ", not its gradient");
    // Within a patch the line is the normal.
    if (source == "patch" && std::abs(dot(away, cast<double>(here.normal))) < 0.95)
      branches.take("patch, askew");
  });
  branches.expect({"patch", "rim", "vertex fan", "start beside", "far from the foot"}, 150);
  branches.expect({"crossing without a patch", "pole", "column wrap", "ridge", "jump"}, 15);
  const int all = branches.count("all");
  branches.expect_at_most("ridge", all * 7 / 100);
  // Walks that end in a cell with a vertex sample take its fan instead, those beside it do not; this asset
  // has such samples at random places.
  branches.expect_at_most("jump", all * 9 / 100);
  for (const char* source : {"patch", "rim", "vertex fan", "crossing without a patch"})
    branches.expect_at_most(std::string(source) + ", not its gradient", branches.count(source) * 2 / 100);
  branches.expect_at_most("patch, askew", branches.count("patch") * 8 / 100);
  // A second sheet is measured along the ray, not to the nearest place, where a patch is none nearer.
  branches.expect_at_most("further sheet", all / 100);
}

// A point's side is another part's to tell where that part's ray is far surer: the distance then keeps its
// place and changes its sign, and so does the gradient, which no longer agrees with the normal. It is rare.
TEST(ThirdLayerGradient, ChangesSignWithTheDistanceWhereAnotherPartOverrules) {
  const Resident& resident = held().resident;
  const auto unit_m = static_cast<double>(resident.unit_m());
  std::mt19937_64 rng(75);
  std::uniform_real_distribution<double> unit(-1, 1);
  int known = 0, overruled = 0, ridges = 0, compared = 0, agrees_with_normal = 0;
  for (int i = 0; i < 100000; ++i) {
    const Vec3d p{1.2 * unit(rng), 0.8 * unit(rng), 0.4 + 1.2 * unit(rng)};
    const auto at = [&](const Vec3d& q) { return held().object.query(cast<float>(q), {Layer::kThree}); };
    const Answer here = at(p);
    if (!std::isfinite(here.signed_distance_m)) continue;
    ++known;
    const PartRecord& part = resident.part(here.part);
    const ChartAnswer own =
        held().chart(here.part).look(part.to_part(resident.units_per_m() * cast<float>(p)), true, 0, 0);
    ASSERT_EQ(here.inside, here.signed_distance_m < 0);
    ASSERT_NEAR(std::abs(here.signed_distance_m), resident.unit_m() * own.distance, 1e-6);
    if (own.inside == here.inside) continue;
    ++overruled;
    const auto d = static_cast<double>(here.signed_distance_m);
    if (std::abs(d) < 0.01) continue;
    const double step_m = kStep * unit_m;
    const Vec3d away = (1 / d) * (p - cast<double>(here.surface_m));
    const auto ahead = static_cast<double>(at(p + step_m * away).signed_distance_m),
               behind = static_cast<double>(at(p - step_m * away).signed_distance_m);
    if (!(std::abs(ahead - 2 * d + behind) < 0.2 * step_m)) {
      ++ridges;
      continue;
    }
    ++compared;
    EXPECT_NEAR((ahead - behind) / (2 * step_m), dot(away, away), 0.2);
    agrees_with_normal += dot(away, cast<double>(here.normal)) > 0;
  }
  RecordProperty("known", known);
  RecordProperty("overruled", overruled);
  RecordProperty("ridges", ridges);
  RecordProperty("compared", compared);
  RecordProperty("agrees_with_the_normal", agrees_with_normal);
  EXPECT_GE(overruled, 10);
  EXPECT_LE(overruled, known / 500);
  EXPECT_GE(compared, 3);
}

}  // namespace
}  // namespace sqmap::runtime
