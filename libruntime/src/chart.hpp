// SPDX-License-Identifier: Apache-2.0
//
// The scalar reference of layers 2 and 3 on one part. The SIMD engine (lanes.inl, look.inl) follows it
// operation by operation and gives the same bits: change both. Part frame; lengths in units of
// Resident::unit_m.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "sqmap/asset/shape_table.hpp"

#include "certainty.hpp"
#include "part_bend.hpp"
#include "resident.hpp"

namespace sqmap::runtime {

/// What one chart knows of a point inside its superquadric.
struct ChartAnswer {
  bool inside{};      ///< by the parity of the crossings above the point
  float certainty{};  ///< distance from the nearest crossing of the ray / doubt of that crossing [-]
  float distance =
      std::numeric_limits<float>::infinity();  ///< to the represented surface; infinite: not eligible
  Vec3f surface;                               ///< nearest point found on it
  Vec3f normal;                                ///< outward unit normal: outward_at()
  float row{}, col{};                          ///< where on the map
  bool has_point{};                            ///< layer 2: the distance is to a crossing that is on no patch
  bool leaving{};                              ///< layer 2: the ray leaves the material there
  bool bounds_patch{};                         ///< layer 2: the cell of the foot bounds a surface patch
  float offset{};      ///< delta of QueryOptions::edge_length_m; 0 on flat and hollow surface
  bool refined{};      ///< by the search of layer 3
  bool faces_patch{};  ///< layer 3: the nearest point lies within the represented surface, not on its rim
};

// Numbers that the reference and the engine share.
inline constexpr float kLeastDoubt = 1e-6F;  ///< of the part's sphere
inline constexpr float kBesidePole =
    0.05F;  ///< cells: on a pole the columns have no length, and no direction
/// Cells: so near a pole the search of layer 3 may stop short of the nearest place.
inline constexpr float kShortOfPole = 0.25F;
inline constexpr int kThirdLayerSteps =
    8;  ///< Gauss-Newton converges in one or two; the rest crosses cells and creases
inline constexpr float kMostCells = 2;     ///< of one such step
inline constexpr float kBackStep = 0.35F;  ///< what is kept of a step that leads farther from the point
inline constexpr float kLeastAngle =
    1e-6F;  ///< squared sine between rows and columns, below which one is a pole
/// Cells: shorter steps end the search.
inline constexpr float kLeastCellStep = 0.05F;
/// Nor is a step worth its while that brings the point nearer by less than this share of a depth step, as its
/// linear model foretells: the map knows no better.
inline constexpr float kLeastGain = 0.06F;
/// A second search must end nearer than the first by this: the first knows better where both found one place.
inline constexpr float kNearer = 0.999F;
/// Rings of eight cells, 2^ring cells away, around a foot whose cell bounds no patch.
inline constexpr int kRings = 4;

/// The direction of v, however long: normalized() loses it where the square of the length does not fit a
/// float. Zero where v is.
inline Vec3f direction_of(const Vec3f& v) noexcept {
  const float most = greater(greater(std::abs(v.x), std::abs(v.y)), std::abs(v.z));
  return most > 0 ? normalized(Vec3f{v.x / most, v.y / most, v.z / most}) : Vec3f{};
}

/// The direction in which the distance grows at a point that `out` joins to the nearest place of the surface,
/// away from the object. Near the surface, where `out` says little, that is the surface's normal there; in
/// between
///
///     n ~ out + blur normal,
///
/// so that facets which meet in an edge turn a force no faster than the point moves around it. On the rim of
/// a patch, beyond which the surface goes on, the normal knows better too, and beside a pole,
/// where the search may stop short.
inline Vec3f outward_at(const Vec3f& out, const Vec3f& normal, float blur, bool on_rim) noexcept {
  // A normal that looks the other way is that of a patch folded over itself; sideways or nearby, the side is
  // in doubt.
  const float up = dot(out, normal), square = dot(out, out);
  const bool turns = up * up > 0.25F * square && square > 4.0F * (blur * blur);
  const bool holds = up < 0 ? !turns : on_rim;
  return holds ? normal : normalized(out + blur * normal);
}

class Chart {
 public:
  /// `table`: the part's, unpacked; it must live as long as the chart.
  Chart(const Resident& resident, const PartRecord& part, const ShapeTable<float>& table) noexcept
      : resident_(resident), part_(part), table_(table) {}

  /// Layers 2 and 3 for a point inside the superquadric. edge > 0: also the offset for faces with such edges.
  ChartAnswer look(const Vec3f& p, bool third, std::uint32_t level, float edge) const noexcept;
  /// The represented surface at a place of level 0. False: its cell bounds no patch.
  bool patch_point(float row, float col, Vec3f& point) const noexcept;
  /// Where a place of the straight frame lies in the part.
  Vec3f to_part(const Vec3f& straight) const noexcept {
    return part_.bend.is_none() ? straight : part_.bend.point(part_.bend.turn_at(straight), straight);
  }
  /// delta of QueryOptions::edge_length_m at a place of the map.
  float offset(float row, float col, std::uint32_t level, float edge) const noexcept;

 private:
  /// A cell of the map at one level: its corners in row-major order and whether they bound a surface patch.
  struct Cell {
    std::uint32_t row, col;  // lowest corner, level-0 nodes
    std::uint32_t texel[4], code[4];
    float depth[4];
    bool starts[4];
    bool eligible;  // four corners hit the mesh from outside it
  };
  /// Where a search may begin, and how far from the point that is.
  struct Start {
    float row = 0, col = 0, square = std::numeric_limits<float>::infinity();  ///< infinite: it may not
  };
  /// The represented surface r - D n (paper eq. 22) at one place, with its derivatives.
  struct Patch {
    Vec3f point, row, col;
  };

  /// A column less than a turn off the map, on it.
  float wrapped(float col) const noexcept {
    const auto turn = static_cast<float>(part_.cols);
    const float raised = col < 0.0F ? col + turn : col;
    return raised < turn ? raised : raised - turn;
  }
  Cell cell_at(float row, float col, std::uint32_t stride) const noexcept;
  Start start_at(const Vec3f& p, float row, float col, std::uint32_t stride) const noexcept;
  /// In the nearest of the eight cells of the first ring around (row, col) that has one with a patch.
  Start start_beside(const Vec3f& p, float row, float col, std::uint32_t stride) const noexcept;
  /// The nearest of the places that the table of starts names around p.
  Start start_named(const Vec3f& p, std::uint32_t stride) const noexcept;
  /// The place that the box names which p lies in, unless it is near this one.
  Start start_away(const Vec3f& p, float row, float col, std::uint32_t stride) const noexcept;
  Patch patch_at(const Cell& cell, float row, float col, std::uint32_t stride) const noexcept;
  /// Outwards across the represented surface at (row, col) of the cell; of no certain length.
  Vec3f patch_across(const Cell& cell, float row, float col, std::uint32_t stride) const noexcept {
    const float last = static_cast<float>(part_.rows - 1);
    const Patch patch = patch_at(cell, lesser(greater(row, kBesidePole), last - kBesidePole), col, stride);
    return cross(patch.col, patch.row);
  }
  Vec3f place(float row, float col, float depth) const noexcept {
    const SurfaceSample<float> r = table_.sample(row, col);
    return to_part(r.point_m - depth * r.normal);
  }
  /// The superquadric's normal at a place of its map; of a bent one of no certain length.
  Vec3f shape_normal_at(float row, float col) const noexcept {
    const SurfaceSample<float> r = table_.sample(row, col);
    return part_.bend.is_none() ? r.normal : part_.bend.gradient(part_.bend.turn_at(r.point_m), r.normal);
  }
  /// `third`: with the vertex samples, which decide about sides too.
  ChartAnswer second_layer(const Vec3f& p, const Foot<float>& foot, std::uint32_t stride,
                           bool third) const noexcept;
  struct Step {
    float row, col;  ///< [cells of level 0]
    float gain;      ///< of the squared distance, by the linear model
    Vec3f way;       ///< of the place, by the linear model
  };
  /// Gauss-Newton from (row, col), towards the point of the patch where `error` = p - patch.point is normal
  /// to it.
  Step step_towards(const Patch& patch, const Vec3f& error, std::uint32_t stride) const noexcept;
  /// Whether the step is not worth its while; square: of the distance so far.
  bool is_over(const Step& step, float square) const noexcept {
    const float least_gain = kLeastGain * part_.depth_step;
    return std::abs(step.row) + std::abs(step.col) < kLeastCellStep ||
           step.gain * step.gain < least_gain * least_gain * square;
  }
  /// From (answer.row, answer.col), whose cell bounds a patch.
  void third_layer(const Vec3f& p, std::uint32_t stride, ChartAnswer& answer) const noexcept;
  bool vertex_fan(const Vec3f& p, const Cell& cell, ChartAnswer& answer) const noexcept;
  /// fan_depth() in a cell with a vertex sample; in others `depth`.
  float over_fan(const Cell& cell, float s, float t, float depth) const noexcept {
    const std::uint32_t position = resident_.find_fan(part_, cell.texel[0]);
    return position < part_.fans.count ? resident_.fan_depth_at(part_, position, cell.depth, s, t) : depth;
  }
  /// Largest convex curvature of the represented surface around (row, col), at the resolution of the cells; 0
  /// where it is flat or hollow.
  float convex_curvature(float row, float col, std::uint32_t stride) const noexcept;

  const Resident& resident_;
  const PartRecord& part_;
  const ShapeTable<float>& table_;
};

inline Chart::Cell Chart::cell_at(float row, float col, std::uint32_t stride) const noexcept {
  Cell cell;
  cell.row =
      std::min(static_cast<std::uint32_t>(greater(row, 0.0F)) / stride * stride, part_.rows - 1 - stride);
  cell.col = std::min(static_cast<std::uint32_t>(greater(col, 0.0F)), part_.cols - 1U) / stride * stride;
  const std::uint32_t next_col = cell.col + stride < part_.cols ? cell.col + stride : 0;
  cell.texel[0] = cell.row * part_.cols + cell.col;
  cell.texel[1] = cell.row * part_.cols + next_col;
  cell.texel[2] = cell.texel[0] + stride * part_.cols;
  cell.texel[3] = cell.texel[1] + stride * part_.cols;
  cell.eligible = true;
  const MapRow low = resident_.row(part_, cell.row), high = resident_.row(part_, cell.row + stride);
  for (int k = 0; k < 4; ++k) {
    const std::uint32_t texel = resident_.texel(part_, k < 2 ? low : high, k % 2 == 0 ? cell.col : next_col);
    cell.code[k] = texel & part_.miss_code();
    cell.starts[k] = texel > part_.miss_code();
    cell.depth[k] = part_.depth_of(cell.code[k]);
    cell.eligible = cell.eligible && texel < part_.miss_code();
  }
  return cell;
}

inline Chart::Patch Chart::patch_at(const Cell& cell, float row, float col,
                                    std::uint32_t stride) const noexcept {
  const float inverse = 1.0F / static_cast<float>(stride);  // a power of two: exact
  const float s = (row - static_cast<float>(cell.row)) * inverse,
              t = (col - static_cast<float>(cell.col)) * inverse;
  const float rise_low = cell.depth[1] - cell.depth[0], rise_high = cell.depth[3] - cell.depth[2];
  const float low = cell.depth[0] + t * rise_low, high = cell.depth[2] + t * rise_high;
  const float depth = low + s * (high - low);
  const float depth_row = (high - low) * inverse;
  const float depth_col = (rise_low + s * (rise_high - rise_low)) * inverse;
  const SurfaceSample<float> r = table_.sample(row, col);
  const Patch straight{r.point_m - depth * r.normal,
                       r.point_row_m - depth_row * r.normal - depth * r.normal_row,
                       r.point_col_m - depth_col * r.normal - depth * r.normal_col};
  const PartBend& bend = part_.bend;
  if (bend.is_none()) return straight;
  const PartBend::Turn turn = bend.turn_at(straight.point);
  return {bend.point(turn, straight.point), bend.step(turn, straight.row), bend.step(turn, straight.col)};
}

inline ChartAnswer Chart::look(const Vec3f& p, bool third, std::uint32_t level, float edge) const noexcept {
  const std::uint32_t stride = part_.stride_at(level);
  const Foot<float> foot = table_.foot(part_.bend.straightened(p));
  ChartAnswer answer = second_layer(p, foot, stride, third);
  // What the bounds prove leaves no doubt.
  if (const Certainty told = told_by(resident_, part_, p); told != Certainty::kUnsure) {
    answer.inside = told == Certainty::kInside;
    answer.certainty = std::numeric_limits<float>::infinity();
  }
  if (third) {
    // The search goes downhill only, so an inner point that stays far from the surface begins again
    // elsewhere, and one whose foot has no patch begins where that is nearer. Points outside the mesh, the
    // most of those that touch nothing, do with the foot; an inner point needs a distance, or it would feel
    // no force.
    Start first;
    if (answer.bounds_patch) {
      first = start_at(p, foot.row, foot.col, stride);
    } else if (answer.inside) {
      first = start_beside(p, foot.row, foot.col, stride);
      if (const Start named = start_named(p, stride); named.square < first.square) first = named;
    }
    ChartAnswer refined = answer;
    if (std::isfinite(first.square)) {
      refined.row = first.row;
      refined.col = first.col;
      third_layer(p, stride, refined);
      // A crossing that is on no patch stands where it is nearer.
      if (!answer.has_point || refined.distance < answer.distance) answer = refined;
    }
    if (answer.bounds_patch && answer.distance > part_.far_from(stride)) {
      // Outer points, of which there are many, ask one box only.
      const Start other =
          answer.inside ? start_named(p, stride) : start_away(p, answer.row, answer.col, stride);
      if (std::isfinite(other.square)) {
        refined.row = other.row;
        refined.col = other.col;
        third_layer(p, stride, refined);
        if (refined.distance < kNearer * answer.distance) answer = refined;
      }
    }
  } else if (answer.inside && !std::isfinite(answer.distance)) {
    // Layer 2 of an inner point above which the ray meets nothing: it would feel no force. The search of
    // layer 3 tells how far it is from the surface, from where the table of starts says.
    if (const Start other = start_named(p, stride); std::isfinite(other.square)) {
      answer.row = other.row;
      answer.col = other.col;
      third_layer(p, stride, answer);
    }
  }
  if (answer.refined) answer.normal = direction_of(answer.normal);
  if (answer.refined || (third && !answer.bounds_patch)) {
    const Vec3f out = answer.inside ? answer.surface - p : p - answer.surface;
    const float near = kShortOfPole * static_cast<float>(stride), last = static_cast<float>(part_.rows - 1);
    const bool beside_pole = answer.row < near || answer.row > last - near;
    const bool on_rim = answer.refined && (!answer.faces_patch || beside_pole);
    answer.normal = outward_at(out, answer.normal, part_.blur(stride), on_rim);
  }
  if (edge > 0 && std::isfinite(answer.distance)) answer.offset = offset(answer.row, answer.col, level, edge);
  return answer;
}

inline float Chart::offset(float row, float col, std::uint32_t level, float edge) const noexcept {
  const float bend = edge * convex_curvature(row, col, part_.stride_at(level));  // L / rho
  return edge * bend / (3.0F * (1.0F + std::sqrt(1.0F + bend * bend / 3.0F)));
}

inline float Chart::convex_curvature(float row, float col, std::uint32_t stride) const noexcept {
  // Differences between the centres of neighbouring cells, so that a crease between two cells counts as well.
  struct Centre {
    Vec3f point, normal;
    bool eligible;
  };
  const auto centre_at = [&](float r, float c) {
    const Cell cell = cell_at(r, wrapped(c), stride);
    const float half = static_cast<float>(stride) / 2;
    const float mid_row = static_cast<float>(cell.row) + half, mid_col = static_cast<float>(cell.col) + half;
    const Patch patch = patch_at(cell, mid_row, mid_col, stride);
    return Centre{patch.point, normalized(cross(patch.col, patch.row)), cell.eligible};
  };
  const auto step = static_cast<float>(stride);
  const float last = static_cast<float>(part_.rows - 1) - 0.5F;
  const Centre here = centre_at(row, col);
  float most = 0;
  for (const auto& [dr, dc] : {std::pair{step, 0.0F}, {-step, 0.0F}, {0.0F, step}, {0.0F, -step}}) {
    const Centre there = centre_at(std::clamp(row + dr, 0.0F, last), col + dc);
    const Vec3f d = there.point - here.point;
    const float square = dot(d, d);
    if (!there.eligible || !(square > 0)) continue;
    most = greater(most, dot(there.normal - here.normal, d) / square);
  }
  return most;
}

inline ChartAnswer Chart::second_layer(const Vec3f& p, const Foot<float>& foot, std::uint32_t stride,
                                       bool third) const noexcept {
  const Cell cell = cell_at(foot.row, foot.col, stride);
  const float inverse = 1.0F / static_cast<float>(stride);
  const float s = (foot.row - static_cast<float>(cell.row)) * inverse;
  const float t = (foot.col - static_cast<float>(cell.col)) * inverse;
  const int nearest = (s < 0.5F ? 0 : 2) + (t < 0.5F ? 0 : 1);
  const float* depth = cell.depth;
  float shift = 0;  // of the nearest texel's crossings, so that the first of them is the interpolated one
  float doubt;
  if (cell.eligible) {
    const float low = depth[0] + t * (depth[1] - depth[0]), high = depth[2] + t * (depth[3] - depth[2]);
    float here = low + s * (high - low);
    if (third && stride == 1) here = over_fan(cell, s, t, here);
    shift = here - depth[nearest];
    const float least = lesser(lesser(depth[0], depth[1]), lesser(depth[2], depth[3]));
    const float most = greater(greater(depth[0], depth[1]), greater(depth[2], depth[3]));
    doubt = 0.25F * (most - least) + part_.depth_step;
  } else {
    doubt = foot.cell_m * static_cast<float>(stride);
  }
  // Where corners start on different sides of the mesh, the surface passes near the superquadric's own.
  const bool start = cell.starts[nearest];
  const bool one_start = cell.starts[0] == start && cell.starts[1] == start && cell.starts[2] == start &&
                         cell.starts[3] == start;

  ChartAnswer answer;
  answer.row = foot.row;
  answer.col = foot.col;
  answer.bounds_patch = cell.eligible;
  answer.inside = start;
  float gap = std::numeric_limits<float>::infinity();  // to the nearest crossing
  float crossing = 0;
  bool odd = false;
  const auto pass = [&](float crossing_depth, bool is_first) {
    if (crossing_depth < foot.depth_m) answer.inside = !answer.inside;
    if (std::abs(crossing_depth - foot.depth_m) < gap) {
      gap = std::abs(crossing_depth - foot.depth_m);
      crossing = crossing_depth;
      answer.has_point = !is_first;
      answer.leaving = odd != start;
    }
    odd = !odd;
  };
  if (cell.code[nearest] != part_.miss_code()) {
    pass(depth[nearest] + shift, true);
    const std::uint32_t texel = cell.texel[nearest];
    for (std::uint32_t k = resident_.find(part_, part_.sheets, texel);
         k < part_.sheets.count && resident_.key(part_, part_.sheets, k) == texel; ++k) {
      pass(part_.depth_of(resident_.sheet_code(part_, k)) + shift, false);
    }
  }
  // A ray without a crossing is as certain as the shape is large.
  const float reach = one_start ? part_.sphere_radius : greater(foot.depth_m, 0.0F);
  answer.certainty = lesser(gap, reach) / greater(doubt, kLeastDoubt * part_.sphere_radius);
  if (!cell.eligible) {
    // No patch, but a point of the surface: where the ray of the nearest texel crosses it. An inner point is
    // no deeper than its distance from there.
    answer.has_point = answer.inside && gap < std::numeric_limits<float>::infinity();
    if (!answer.has_point) return answer;
    answer.row = static_cast<float>(cell.row + (nearest < 2 ? 0 : stride));
    answer.col = static_cast<float>(cell.col + (nearest % 2 == 0 ? 0 : stride));
    answer.surface = place(answer.row, answer.col, crossing);
    const Vec3f d = p - answer.surface;
    answer.distance = std::sqrt(dot(d, d));
    answer.normal = (answer.leaving ? -1.0F : 1.0F) * shape_normal_at(answer.row, answer.col);
    return answer;
  }
  answer.distance = gap;
  answer.surface = place(foot.row, foot.col, crossing);
  if (!part_.bend.is_none() && gap < std::numeric_limits<float>::infinity()) {
    const Vec3f d = p - answer.surface;  // the gap is that in the straight frame
    answer.distance = std::sqrt(dot(d, d));
  }
  answer.normal =
      (answer.leaving ? -1.0F : 1.0F) * direction_of(patch_across(cell, foot.row, foot.col, stride));
  return answer;
}

inline bool Chart::patch_point(float row, float col, Vec3f& point) const noexcept {
  const Cell cell = cell_at(row, col, 1);
  if (cell.eligible) point = patch_at(cell, row, col, 1).point;
  return cell.eligible;
}

}  // namespace sqmap::runtime

#include "chart_search.hpp"  // IWYU pragma: keep
