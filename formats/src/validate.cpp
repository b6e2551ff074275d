// SPDX-License-Identifier: Apache-2.0
//
// The rules are those of formats/FORMAT.md section 8, under the same numbers. Every comparison is written so
// that a NaN breaks the rule.
#include "sqmap/asset/validate.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <numbers>
#include <string_view>
#include <utility>

namespace sqmap {
namespace {

constexpr double kMaxLength_m = 1e16;     // sums of squares of lengths stay finite in float
constexpr double kMinSemiAxis_m = 1e-18;  // its square and its reciprocal are normal floats
constexpr double kUnitTolerance = 1e-6;   // of a quaternion's norm: float input, normalised once
constexpr double kSphereTolerance =
    1e-6;  // of a sphere's radius: rounding of its maker, far below any use of it
constexpr std::uint32_t kMaxLevels = 12;
constexpr std::uint32_t kMaxRows = 4097;
constexpr std::uint32_t kMaxCols = 8192;
constexpr std::size_t kMaxNameBytes = 4096;
constexpr std::size_t kMaxOptionBytes = 32768;

bool in_range(double value, double low, double high) { return value >= low && value <= high; }  // NaN: false
bool is_length(double value) { return in_range(value, 0, kMaxLength_m); }
bool is_position(const Vec3d& p) {
  return is_length(std::abs(p.x)) && is_length(std::abs(p.y)) && is_length(std::abs(p.z));
}
bool is_sphere(const BoundingSphere& sphere) {
  return is_position(sphere.centre_m) && sphere.radius_m > 0 && is_length(sphere.radius_m);
}

std::string text(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.9g", value);
  return buffer;
}
std::string text(const Vec3d& v) { return "(" + text(v.x) + ", " + text(v.y) + ", " + text(v.z) + ")"; }

// Well-formed UTF-8 (Unicode 15, table 3-7) without the character NUL, which ends a string in the file.
bool is_utf8_text(std::string_view s) {
  for (std::size_t i = 0; i < s.size();) {
    const auto lead = static_cast<unsigned char>(s[i++]);
    if (lead == 0) return false;
    if (lead < 0x80) continue;
    const int more = lead >= 0xC2 && lead < 0xE0   ? 1
                     : lead >= 0xE0 && lead < 0xF0 ? 2
                     : lead >= 0xF0 && lead < 0xF5 ? 3
                                                   : 0;
    if (more == 0 || s.size() - i < static_cast<std::size_t>(more)) return false;
    unsigned low = 0x80, high = 0xBF;  // of the first continuation byte: no overlong forms, no surrogates
    if (lead == 0xE0) low = 0xA0;
    if (lead == 0xED) high = 0x9F;
    if (lead == 0xF0) low = 0x90;
    if (lead == 0xF4) high = 0x8F;
    for (int k = 0; k < more; ++k) {
      const auto next = static_cast<unsigned char>(s[i++]);
      if (next < low || next > high) return false;
      low = 0x80;
      high = 0xBF;
    }
  }
  return true;
}

class Checker {
 public:
  explicit Checker(const Asset& asset) : asset_(asset) {}

  std::vector<Finding> run(CheckLevel level) {
    check_asset();
    check_provenance();
    check_errors();
    if (level == CheckLevel::kFull) check_asset_fully();
    for (part_ = 0; part_ < asset_.parts.size(); ++part_) {
      const Part& part = asset_.parts[part_];
      check_part(part);
      check_bounds(part.bounds, level);
      const std::size_t before = findings_.size();
      check_grid(part.map);
      // What follows indexes by the grid.
      if (findings_.size() != before) continue;
      check_lists(part.map);
      if (findings_.size() == before && level == CheckLevel::kFull) check_part_fully(part);
    }
    std::stable_sort(findings_.begin(), findings_.end(),
                     [](const Finding& a, const Finding& b) { return a.rule < b.rule; });
    return std::move(findings_);
  }

 private:
  void require(bool holds, int rule, const std::string& message) {
    if (!holds) findings_.push_back({rule, message});
  }
  void require_part(bool holds, int rule, const std::string& message) {
    if (!holds) findings_.push_back({rule, "part " + std::to_string(part_) + ": " + message});
  }

  void check_asset() {
    const std::size_t count = asset_.parts.size();
    require(count >= 1 && count <= kMaxParts, 1,
            std::to_string(count) + " parts, must be 1 to " + std::to_string(kMaxParts));
    require(asset_.r_max_m > 0 && is_length(asset_.r_max_m), 2,
            "r_max_m = " + text(asset_.r_max_m) + ", must be > 0 and at most " + text(kMaxLength_m));
    require(is_sphere(asset_.sphere), 3, "sphere of the asset: " + describe(asset_.sphere));
    require(std::isfinite(asset_.mesh.volume_m3), 8,
            "mesh.volume_m3 = " + text(asset_.mesh.volume_m3) + ", must be finite");
    for (std::size_t face = 0; face < asset_.face_labels.size(); ++face)
      if (const std::uint16_t label = asset_.face_labels[face]; label != kNoPart && label >= count)
        return require(false, 9,
                       "face_labels[" + std::to_string(face) + "] = " + std::to_string(label) +
                           ", must be a part (below " + std::to_string(count) + ") or 65535");
  }

  void check_provenance() {
    const Provenance& p = asset_.provenance;
    const std::pair<const char*, const std::string*> names[] = {{"generator", &p.generator},
                                                                {"generator_version", &p.generator_version},
                                                                {"source_name", &p.source_name},
                                                                {"options", &p.options_json}};
    for (const auto& [name, value] : names) {
      const std::size_t limit = value == &p.options_json ? kMaxOptionBytes : kMaxNameBytes;
      require(value->size() <= limit && is_utf8_text(*value), 4,
              std::string(name) + " has " + std::to_string(value->size()) +
                  " bytes, must be UTF-8 without NUL, at most " + std::to_string(limit) + " bytes");
    }
    const bool hexadecimal = p.source_hash.find_first_not_of("0123456789abcdef") == std::string::npos;
    require(p.source_hash.empty() || (p.source_hash.size() == 32 && hexadecimal), 5,
            "source_hash has " + std::to_string(p.source_hash.size()) +
                " characters, must be 32 lower-case hexadecimal digits or empty");
    require(p.metres_per_unit > 0 && std::isfinite(p.metres_per_unit), 6,
            "metres_per_unit = " + text(p.metres_per_unit) + ", must be finite and > 0");
    require(p.up_axis == "x" || p.up_axis == "y" || p.up_axis == "z", 7,
            "up_axis must be \"x\", \"y\" or \"z\"");
  }

  void check_errors() {
    std::uint32_t levels = 0;
    for (const Part& part : asset_.parts) levels = std::max(levels, part.map.level_count);
    for (std::size_t i = 0; i < asset_.errors.size(); ++i) {
      const ErrorRow& row = asset_.errors[i];
      const std::string where = "errors[" + std::to_string(i) + "]: ";
      const bool known = row.level < levels && row.layer >= 1 && row.layer <= 3;
      require(known, 10,
              where + "level " + std::to_string(row.level) + ", layer " + std::to_string(row.layer) +
                  ", must be a level below " + std::to_string(levels) + " and a layer of 1 to 3");
      bool measured = true;
      for (const double percent : {row.eq35_percent, row.depth_mean_percent, row.depth_p95_percent,
                                   row.misclassified_3_percent, row.misclassified_05_percent})
        measured = measured && (std::isnan(percent) || (percent >= 0 && std::isfinite(percent)));
      require(measured, 11, where + "every percentage must be finite and >= 0, or NaN for not measured");
      if (!known || !measured) return;
    }
  }

  void check_part(const Part& part) {
    const Superquadric& shape = part.shape;
    bool axes = true;
    for (int i = 0; i < 3; ++i) axes = axes && in_range(shape.semi_axes_m[i], kMinSemiAxis_m, kMaxLength_m);
    require_part(axes, 20,
                 "semi_axes_m = " + text(shape.semi_axes_m) + ", must be " + text(kMinSemiAxis_m) + " to " +
                     text(kMaxLength_m));
    require_part(
        in_range(shape.e1, kMinExponent, kMaxExponent) && in_range(shape.e2, kMinExponent, kMaxExponent), 21,
        "exponents " + text(shape.e1) + ", " + text(shape.e2) + ", must be " + text(kMinExponent) + " to " +
            text(kMaxExponent));
    // Of exponents that rule 21 refuses it says nothing.
    if (in_range(shape.e1, kMinExponent, kMaxExponent))
      require_part(std::abs(shape.taper) <= max_taper(shape.e1), 29,
                   "taper = " + text(shape.taper) + ", must be within " + text(max_taper(shape.e1)) +
                       " of 0: a superquadric of e1 = " + text(shape.e1) + " is not convex beyond it");
    check_bend(part);
    const Quaternion& q = part.object_from_part.orientation;
    const double length = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
    require_part(in_range(length, 1 - kUnitTolerance, 1 + kUnitTolerance), 22,
                 "orientation has the norm " + text(length) + ", must be 1 within " + text(kUnitTolerance));
    require_part(is_position(part.object_from_part.translation_m), 23,
                 "translation_m = " + text(part.object_from_part.translation_m) + ", must be at most " +
                     text(kMaxLength_m) + " along each axis");
    require_part(is_sphere(part.sphere), 24, "sphere: " + describe(part.sphere));
    require_part(
        part.segment < kMaxParts, 25,
        "segment = " + std::to_string(part.segment) + ", must be below " + std::to_string(kMaxParts));
    require_part(part.reason <= CutReason::kErrorTarget, 26,
                 "reason = " + std::to_string(static_cast<int>(part.reason)) + ", must be 0 to 4");
    require_part(std::isfinite(part.volume_m3), 27,
                 "volume_m3 = " + text(part.volume_m3) + ", must be finite");
    // Rule 56 implies it; readers, which do not check that one, need it to keep lengths over the sphere's
    // radius finite.
    const double reach_m = asset_.sphere.radius_m * (1 + kSphereTolerance);
    const double off_m = norm(part.object_from_part.translation_m - asset_.sphere.centre_m);
    // What is bent by up to kMostBendTurn spans a ball of half its length.
    const double half_length_m = shape.semi_axes_m.z / (shape.bend.is_none() ? 1 : kMostBendTurn);
    require_part(off_m <= reach_m && shape.semi_axes_m.x <= reach_m && shape.semi_axes_m.y <= reach_m &&
                     half_length_m <= reach_m,
                 28,
                 "its centre is " + text(off_m) + " m from that of the asset's sphere, its semi-axes are " +
                     text(shape.semi_axes_m) + ", must be at most the sphere's radius of " +
                     text(asset_.sphere.radius_m));
  }

  void check_bend(const Part& part) {
    const Bend<double>& bend = part.shape.bend;
    if (bend.is_none()) return;
    const double turn = bend.curvature() * part.shape.semi_axes_m.z, reach = bend_reach(part.shape);
    require_part(in_range(turn, kLeastBendTurn, kMostBendTurn) && reach <= kMostBendReach, 40,
                 "bend_per_m = (" + text(bend.x) + ", " + text(bend.y) + ") turns the axis by " + text(turn) +
                     " rad, must be none or " + text(kLeastBendTurn) + " to " + text(kMostBendTurn) +
                     ", and reaches over " + text(reach) + " of the arc's radius, must be at most " +
                     text(kMostBendReach));
    require_part(part.bounds.cells == 0, 40, "a part with bounds has bend_per_m, must be straight");
  }

  void check_grid(const DistanceMap& map) {
    const bool levels = map.level_count >= 1 && map.level_count <= kMaxLevels;
    require_part(
        levels, 30,
        "level_count = " + std::to_string(map.level_count) + ", must be 1 to " + std::to_string(kMaxLevels));
    const std::uint32_t stride = 1U << (levels ? map.level_count - 1 : 0);
    const bool rows = map.rows >= 3 && map.rows <= kMaxRows && (map.rows - 1) % (2 * stride) == 0;
    require_part(rows, 31,
                 "rows = " + std::to_string(map.rows) + ", rows - 1 must be a multiple of " +
                     std::to_string(2 * stride) + " and rows at most " + std::to_string(kMaxRows));
    const bool cols = map.cols >= 4 && map.cols <= kMaxCols && map.cols % (4 * stride) == 0;
    require_part(cols, 32,
                 "cols = " + std::to_string(map.cols) + ", must be a multiple of " +
                     std::to_string(4 * stride) + " and at most " + std::to_string(kMaxCols));
    const bool bits = map.bits >= 4 && map.bits <= 16;
    require_part(bits, 33, "bits = " + std::to_string(map.bits) + ", must be 4 to 16");
    const double deepest = map.depth_min_m + 65535 * map.depth_step_m;
    require_part(map.depth_min_m >= 0 && map.depth_step_m >= 0 && is_length(deepest), 34,
                 "depth_min_m = " + text(map.depth_min_m) + ", depth_step_m = " + text(map.depth_step_m) +
                     ", must be >= 0 and min + 65535 step at most " + text(kMaxLength_m));
    if (!rows || !cols) return;
    const std::size_t texels = std::size_t{map.rows} * map.cols;
    require_part(map.code.size() == texels, 35,
                 std::to_string(map.code.size()) + " codes, must be rows * cols = " + std::to_string(texels));
    require_part(map.start_inside.empty() || map.start_inside.size() == (texels + 7) / 8, 36,
                 std::to_string(map.start_inside.size()) + " bytes of start_inside, must be 0 or " +
                     std::to_string((texels + 7) / 8));
  }

  void check_lists(const DistanceMap& map) {
    const std::uint32_t texels = map.rows * map.cols;
    for (std::size_t i = 0; i < map.crossings.size(); ++i) {
      const auto& at = map.crossings[i];
      const bool ascends = i == 0 || std::pair(map.crossings[i - 1].texel, map.crossings[i - 1].code) <
                                         std::pair(at.texel, at.code);
      if (at.texel < texels && ascends) continue;
      require_part(false, 37,
                   "crossings[" + std::to_string(i) + "] of texel " + std::to_string(at.texel) + ", code " +
                       std::to_string(at.code) + ", must be above the one before and below texel " +
                       std::to_string(texels));
      break;
    }
    const std::uint32_t cells = texels - map.cols;
    for (std::size_t i = 0; i < map.vertex_samples.size(); ++i) {
      const std::uint32_t cell = map.vertex_samples[i].cell;
      if (cell < cells && (i == 0 || map.vertex_samples[i - 1].cell < cell)) continue;
      require_part(false, 38,
                   "vertex_samples[" + std::to_string(i) + "] of cell " + std::to_string(cell) +
                       ", must be above the one before and below " + std::to_string(cells));
      break;
    }
  }

  void check_bounds(const SurfaceBounds& bounds, CheckLevel level) {
    const bool cells = bounds.cells <= SurfaceBounds::kMostCells &&
                       bounds.cell.size() == std::size_t{6} * bounds.cells * bounds.cells;
    require_part(cells && is_length(bounds.tolerance_m), 39,
                 std::to_string(bounds.cell.size()) + " bounds, bound_cells = " +
                     std::to_string(bounds.cells) + ", bound_tolerance_m = " + text(bounds.tolerance_m) +
                     ", must be 6 bound_cells^2 bounds, at most " +
                     std::to_string(SurfaceBounds::kMostCells) + " cells and a length");
    if (!cells || level != CheckLevel::kFull) return;
    const auto contradicts = std::find_if(bounds.cell.begin(), bounds.cell.end(), [](const BoundCell& cell) {
      const bool has_second = cell.lower <= cell.upper;
      return cell.sides > 3 || (has_second && cell.upper > cell.outer);
    });
    require_part(contradicts == bounds.cell.end(), 57,
                 "the bounds of cell " + std::to_string(contradicts - bounds.cell.begin()) +
                     " must have `upper` at most `outer` and no bit of `sides` but the two lowest");
  }

  void check_asset_fully() {
    const std::size_t labels = asset_.face_labels.size();
    require(labels == 0 || labels == asset_.mesh.source_faces, 50,
            std::to_string(labels) + " face_labels, must be as many as mesh.source_faces = " +
                std::to_string(asset_.mesh.source_faces) + ", or none");
  }

  void check_part_fully(const Part& part) {
    const DistanceMap& map = part.map;
    const std::uint16_t miss = map.miss_code();
    const auto beyond =
        std::find_if(map.code.begin(), map.code.end(), [&](std::uint16_t c) { return c > miss; });
    require_part(beyond == map.code.end(), 51, "a code has more than " + std::to_string(map.bits) + " bits");
    const std::size_t texels = map.code.size();
    if (!map.start_inside.empty() && texels % 8 != 0)
      require_part(map.start_inside.back() >> (texels % 8) == 0, 52,
                   "start_inside has bits beyond its last texel");
    for (const auto& at : map.crossings)
      if (!(at.code < miss && at.code > map.code[at.texel])) {
        require_part(false, 53,
                     "a further crossing of texel " + std::to_string(at.texel) + " has the code " +
                         std::to_string(at.code) + ", must be above the first crossing's " +
                         std::to_string(map.code[at.texel]) + " and below " + std::to_string(miss));
        break;
      }
    for (const auto& sample : map.vertex_samples)
      if (!(sample.code < miss)) {
        require_part(false, 54,
                     "the vertex sample of cell " + std::to_string(sample.cell) + " has the code " +
                         std::to_string(sample.code) + ", must be below " + std::to_string(miss));
        break;
      }
    const Farthest farthest = farthest_points(part);
    require_enclosed(farthest.from_part_m, part.sphere, 55, "its own sphere");
    require_enclosed(farthest.from_asset_m, asset_.sphere, 56, "the sphere of the asset");
  }

  struct Farthest {
    double from_part_m{}, from_asset_m{};  // from the centres of both spheres
  };

  // Surface points at equal angles, among them the poles, the ends of the axes and the diagonals, where the
  // corners of squarish bodies are. The distances found never exceed the true ones, so that no good sphere is
  // refused.
  Farthest farthest_points(const Part& part) const {
    constexpr int kSteps = 16;  // a quadrant
    const auto at_angle = [](int step, double e) {
      const double angle_rad = step * std::numbers::pi / (2 * kSteps);
      return superellipse_point(std::cos(angle_rad), std::sin(angle_rad), e);
    };
    std::vector<SuperellipsePoint<double>> omegas;
    for (int col = 0; col < 4 * kSteps; ++col) omegas.push_back(at_angle(col, part.shape.e2));
    const Rotation<double> turn = rotation(part.object_from_part.orientation);
    Farthest farthest;
    for (int row = -kSteps; row <= kSteps; ++row) {
      const auto eta = at_angle(row, part.shape.e1);
      for (const auto& omega : omegas) {
        const Vec3d p_m =
            turn.apply(surface_point(part.shape, eta, omega)) + part.object_from_part.translation_m;
        farthest.from_part_m = std::max(farthest.from_part_m, norm(p_m - part.sphere.centre_m));
        farthest.from_asset_m = std::max(farthest.from_asset_m, norm(p_m - asset_.sphere.centre_m));
      }
    }
    return farthest;
  }

  void require_enclosed(double farthest_m, const BoundingSphere& sphere, int rule, const char* whose) {
    require_part(farthest_m <= sphere.radius_m * (1 + kSphereTolerance), rule,
                 "a point of its superquadric is " + text(farthest_m) + " m from the centre of " + whose +
                     ", whose radius is " + text(sphere.radius_m));
  }

  static std::string describe(const BoundingSphere& sphere) {
    return "centre " + text(sphere.centre_m) + ", radius " + text(sphere.radius_m) +
           ", must be finite with a radius > 0 and at most " + text(kMaxLength_m);
  }

  const Asset& asset_;
  std::size_t part_ = 0;
  std::vector<Finding> findings_;
};

}  // namespace

std::vector<Finding> validate(const Asset& asset, CheckLevel level) { return Checker(asset).run(level); }

}  // namespace sqmap
