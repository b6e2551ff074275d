// SPDX-License-Identifier: GPL-3.0-or-later
#include "map_builder.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "sqmap/asset/shape_table.hpp"

#include "part_lines.hpp"

namespace sqmap::bake {

namespace {

// Crossings this far beyond the medial axis are still stored: a cell on the axis then interpolates between
// two hits and not between a hit and a miss.
constexpr double kReachMargin = 1.25;
// Octant cells a side on which the medial distance is found; it is smooth, and kReachMargin covers the rest.
constexpr std::uint32_t kReachCells = 12;

/// Largest t for which the foot point of r - t n is still r, in [0, distance to the planes of symmetry]; z =
/// 0 is none of a tapered shape, which ends at z = +-a3.
double medial_distance(const ShapeTable<double>& table, const Vec3d& r, const Vec3d& n) {
  double high = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 2; ++axis) {
    if (n[axis] > 1e-9) high = std::min(high, r[axis] / n[axis]);
  }
  const double floor_m = table.taper == 0 ? 0 : std::copysign(table.axes_m.z, -n.z);
  if (std::abs(n.z) > 1e-9) high = std::min(high, (r.z - floor_m) / n.z);
  if (!(high > 0) || !std::isfinite(high)) return 0;
  constexpr int kHalvings = 10;
  constexpr double kNearer = 0.995;  // another foot is nearer by more than the tables' error
  double low = 0;
  const double limit = high;
  if (table.foot(r - limit * n).depth_m > kNearer * limit) return limit;
  for (int k = 0; k < kHalvings; ++k) {
    const double t = 0.5 * (low + high);
    (table.foot(r - t * n).depth_m > kNearer * t ? low : high) = t;
  }
  return low;
}

/// Medial distance at (row, col) of a quadrant of columns, bilinear between the nodes it was found at; rows
/// from the equator up, and of a tapered shape down too.
class Reach {
 public:
  Reach(const Superquadric& shape, const MapGrid& grid)
      : half_((grid.rows() - 1) / 2), quarter_(grid.cols() / 4) {
    const ShapeTable<double> table(shape, grid.rows(), grid.cols());
    const std::uint32_t halves = shape.taper == 0 ? 1 : 2;
    below_ = shape.taper == 0 ? 0 : kNodes;
    distance_m_.resize(std::size_t{halves} * kNodes);
    tbb::parallel_for(0U, halves * (kReachCells + 1), [&](std::uint32_t k) {
      const std::uint32_t a = k % (kReachCells + 1);
      const double up = k == a ? 1 : -1;
      for (std::uint32_t b = 0; b <= kReachCells; ++b) {
        const SurfaceSample<double> s = table.sample(half_ + up * (a * double(half_) / kReachCells),
                                                     2.0 * quarter_ + b * double(quarter_) / kReachCells);
        distance_m_[k * (kReachCells + 1) + b] = medial_distance(table, s.point_m, s.normal);
      }
    });
  }

  double at(std::uint32_t row, std::uint32_t col) const {
    const double u = std::abs(double(row) - half_) / half_ * kReachCells;
    const std::uint32_t along = col % (2 * quarter_);
    const double v = double(along <= quarter_ ? along : 2 * quarter_ - along) / quarter_ * kReachCells;
    const auto i = std::min(static_cast<std::uint32_t>(u), kReachCells - 1);
    const auto j = std::min(static_cast<std::uint32_t>(v), kReachCells - 1);
    const std::size_t first = row < half_ ? below_ : 0;
    const double* corner = &distance_m_[first + i * (kReachCells + 1) + j];
    const double low = corner[0] + (v - j) * (corner[1] - corner[0]);
    const double high =
        corner[kReachCells + 1] + (v - j) * (corner[kReachCells + 2] - corner[kReachCells + 1]);
    return low + (u - i) * (high - low);
  }

 private:
  static constexpr std::size_t kNodes = std::size_t{kReachCells + 1} * (kReachCells + 1);

  std::uint32_t half_, quarter_;
  std::size_t below_;  // where the nodes below the equator begin
  std::vector<double> distance_m_;
};

}  // namespace

int MeshQueries::winding(const Vec3d& p_m, const Vec3d& direction,
                         const std::vector<RayTracer::Hit>& line_hits) const {
  if (!open.can_mislead(p_m, direction)) {
    int ahead = 0, behind = 0;
    for (const auto& hit : line_hits) (hit.t_m < 0 ? behind : ahead) += hit.entering ? -1 : 1;
    // What leaves the material ahead must have been entered before.
    if (ahead >= 0 && ahead + behind == 0) return ahead;
  }
  return oracle.rounded_winding_number(p_m);
}

double MeshQueries::signed_distance(const Vec3d& p_m, double at_most_m) const {
  // Any direction serves; this one lies in no plane that models are aligned with.
  const Vec3d direction = normalized(Vec3d{0.3217, 0.5431, 0.7757});
  if (open.can_mislead(p_m, direction)) return oracle.signed_distance(p_m);
  std::vector<RayTracer::Hit> hits;
  rays.trace_line(p_m, direction, hits);
  const double distance_m = oracle.nearest(p_m, at_most_m).distance_m;
  return winding(p_m, direction, hits) > 0 ? -distance_m : distance_m;
}

RayField trace_map(const Superquadric& shape, const Pose& object_from_part, std::uint32_t rows,
                   std::uint32_t cols, const MeshQueries& queries) {
  const MapGrid grid(straight(shape), rows, cols);
  const Reach reach(shape, grid);
  const PartLines part_lines(shape, object_from_part, queries);
  struct Row {
    std::vector<std::uint8_t> start_inside;
    std::vector<std::uint32_t> count;
    std::vector<double> depth_m, reach_m;
  };
  std::vector<Row> by_row(rows);
  tbb::parallel_for(tbb::blocked_range<std::uint32_t>(0, rows, 4),
                    [&](const tbb::blocked_range<std::uint32_t>& range) {
                      std::vector<RayTracer::Ray> lines(cols);
                      PartLines::Traced traced;
                      for (std::uint32_t row = range.begin(); row != range.end(); ++row) {
                        Row& out = by_row[row];
                        for (std::uint32_t col = 0; col < cols; ++col)
                          lines[col] = {grid.point(row, col), -grid.normal(row, col)};
                        part_lines.trace(lines, traced);
                        for (std::uint32_t col = 0; col < cols; ++col) {
                          int winding = traced.winding[col];
                          const double reach_m = reach.at(row, col);
                          out.start_inside.push_back(winding > 0 ? 1 : 0);
                          out.reach_m.push_back(reach_m);
                          std::uint32_t count = 0;
                          for (const auto& hit : traced.hits[col]) {
                            if (hit.t_m < 0) continue;
                            const bool was_inside = winding > 0;
                            winding += hit.entering ? 1 : -1;
                            if ((winding > 0) == was_inside) continue;
                            if (hit.t_m > (count == 0 ? kReachMargin : 1.0) * reach_m) break;
                            out.depth_m.push_back(hit.t_m);
                            ++count;
                          }
                          out.count.push_back(count);
                        }
                      }
                    });

  RayField field;
  field.rows = rows;
  field.cols = cols;
  field.first.push_back(0);
  for (const Row& row : by_row) {
    field.start_inside.insert(field.start_inside.end(), row.start_inside.begin(), row.start_inside.end());
    field.reach_m.insert(field.reach_m.end(), row.reach_m.begin(), row.reach_m.end());
    field.depth_m.insert(field.depth_m.end(), row.depth_m.begin(), row.depth_m.end());
    for (const std::uint32_t count : row.count) field.first.push_back(field.first.back() + count);
  }
  return field;
}

namespace {

/// Length of [0, reach] on which two rays disagree about being inside. `shift_m` moves the first ray's
/// crossings.
double disagreement_m(const RayField& field, std::uint32_t told, double shift_m, std::uint32_t truth) {
  const double reach_m = field.reach_m[truth];
  std::uint32_t a = field.first[told], b = field.first[truth];
  const std::uint32_t a_end = field.first[told + 1], b_end = field.first[truth + 1];
  bool differ = field.start_inside[told] != field.start_inside[truth];
  double sum = 0, at = 0;
  while (at < reach_m) {
    const double next_a = a < a_end ? std::max(0.0, field.depth_m[a] + shift_m) : reach_m;
    const double next_b = b < b_end ? field.depth_m[b] : reach_m;
    const double next = std::min({next_a, next_b, reach_m});
    if (differ) sum += std::max(0.0, next - at);
    at = std::max(at, next);
    if (next >= reach_m) break;
    differ = !differ;
    (next_a <= next_b ? a : b) += 1;
  }
  return sum;
}

/// Of fields with more texels than these, every so-many-th is compared: a step that shares no factor with the
/// strides, which divide fields of 48, 96 or 192 cells a quadrant, meets all their phases alike.
std::uint32_t sampling_step(std::uint32_t texels) {
  constexpr std::uint32_t kEnough = 3000;
  std::uint32_t step = 1;
  for (const std::uint32_t prime : {5U, 7U, 11U, 13U, 17U, 19U, 23U}) {
    if (texels / prime >= kEnough) step = prime;
  }
  return step;
}

}  // namespace

CoarseningError coarsening_error(const RayField& field, const MapGrid& grid, std::uint32_t row_stride,
                                 std::uint32_t col_stride) {
  double depth_sum = 0, depth_weight = 0, occupancy_sum = 0, weight = 0;
  const std::uint32_t step = sampling_step(field.rows * field.cols);
  for (std::uint32_t row = 0; row < field.rows; ++row) {
    const std::uint32_t low_row = std::min(row / row_stride * row_stride, field.rows - 1 - row_stride);
    const double s = double(row - low_row) / row_stride;
    // Texels of a row share its circumference, so their area falls towards the poles.
    const double area = std::abs(grid.eta(row).c);
    for (std::uint32_t col = row % step; col < field.cols; col += step) {
      const std::uint32_t texel = row * field.cols + col;
      const std::uint32_t low_col = col / col_stride * col_stride;
      const std::uint32_t high_col = (low_col + col_stride) % field.cols;
      const std::uint32_t corner[4] = {low_row * field.cols + low_col, low_row * field.cols + high_col,
                                       (low_row + row_stride) * field.cols + low_col,
                                       (low_row + row_stride) * field.cols + high_col};
      const double t = double(col - low_col) / col_stride;
      const bool is_patch =
          std::all_of(corner, corner + 4, [&](std::uint32_t k) { return field.is_eligible(k); });
      double told_m = 0;
      if (is_patch) {
        const double low = (1 - t) * field.first_depth_m(corner[0]) + t * field.first_depth_m(corner[1]);
        const double high = (1 - t) * field.first_depth_m(corner[2]) + t * field.first_depth_m(corner[3]);
        told_m = (1 - s) * low + s * high;
        if (field.is_eligible(texel)) {
          depth_sum += area * std::abs(told_m - field.first_depth_m(texel));
          depth_weight += area;
        }
      }
      // The nearest corner speaks for the texel. Half-way texels lie at as many corners as are equally near:
      // each counts.
      double disagreement_sum_m = 0;
      int corners = 0;
      for (int k = 0; k < 4; ++k) {
        const bool upper = k >= 2, right = k % 2 == 1;
        if ((upper ? s < 0.5 : s > 0.5) || (right ? t < 0.5 : t > 0.5)) continue;
        const double shift_m = is_patch ? told_m - field.first_depth_m(corner[k]) : 0;
        disagreement_sum_m += disagreement_m(field, corner[k], shift_m, texel);
        ++corners;
      }
      occupancy_sum += area * disagreement_sum_m / corners;
      weight += area;
    }
  }
  return {depth_weight > 0 ? depth_sum / depth_weight : 0, weight > 0 ? occupancy_sum / weight : 0};
}

DistanceMap quantise(const RayField& field, const MapPlan& plan) {
  DistanceMap map;
  map.rows = (field.rows - 1) / plan.row_stride + 1;
  map.cols = field.cols / plan.col_stride;
  map.bits = plan.bits;
  // Down to two cells a quadrant, as far as both directions halve.
  const int halvings = std::min(std::countr_zero((map.rows - 1) / 2), std::countr_zero(map.cols / 4));
  map.level_count = static_cast<std::uint32_t>(std::max(1, halvings));

  std::vector<std::uint32_t> kept;
  for (std::uint32_t row = 0; row < map.rows; ++row) {
    for (std::uint32_t col = 0; col < map.cols; ++col) {
      kept.push_back(row * plan.row_stride * field.cols + col * plan.col_stride);
    }
  }
  // Codes start at depth 0 whatever the rays met: a vertex between them may reach up to the superquadric.
  double most = 0;
  for (const std::uint32_t texel : kept) {
    if (field.has_hit(texel)) most = std::max(most, field.depth_m[field.first[texel + 1] - 1]);
  }
  const std::uint32_t top = map.miss_code() - 1U;
  map.depth_min_m = 0;
  map.depth_step_m = most / top;
  const auto encode = [&](double depth_m) {
    if (!(map.depth_step_m > 0)) return std::uint16_t{0};
    return static_cast<std::uint16_t>(
        std::min<double>(top, std::round((depth_m - map.depth_min_m) / map.depth_step_m)));
  };

  map.code.reserve(kept.size());
  const bool any_inside = std::any_of(kept.begin(), kept.end(),
                                      [&](std::uint32_t texel) { return field.start_inside[texel] != 0; });
  if (any_inside) map.start_inside.assign((kept.size() + 7) / 8, 0);
  std::vector<std::uint16_t> codes;
  for (std::uint32_t k = 0; k < kept.size(); ++k) {
    const std::uint32_t texel = kept[k];
    if (field.start_inside[texel] != 0) map.start_inside[k / 8] |= static_cast<std::uint8_t>(1U << (k % 8));
    // Two crossings on one code enclose less than a step: both are dropped, and the parity stays.
    codes.clear();
    for (std::uint32_t c = field.first[texel]; c < field.first[texel + 1]; ++c) {
      const std::uint16_t code = encode(field.depth_m[c]);
      if (!codes.empty() && codes.back() == code) {
        codes.pop_back();
      } else {
        codes.push_back(code);
      }
    }
    map.code.push_back(codes.empty() ? map.miss_code() : codes.front());
    for (std::size_t c = 1; c < codes.size(); ++c) map.crossings.push_back({k, codes[c]});
  }
  return map;
}

void add_vertex_samples(Part& part, const MeshQueries& queries, double tolerance_m) {
  DistanceMap& map = part.map;
  const ShapeTable<double> table(part.shape, map.rows, map.cols);
  const PartLines lines(part.shape, part.object_from_part, queries);
  const Rotation<double> turn = rotation(part.object_from_part.orientation);
  struct Best {
    double miss_m{};
    DistanceMap::VertexSample sample;
  };
  std::vector<Best> best(std::size_t{map.rows - 1} * map.cols);
  std::vector<RayTracer::Hit> hits;
  for (const Vec3d& vertex_m : queries.mesh.vertices_m) {
    const Vec3d from_centre = vertex_m - part.sphere.centre_m;
    if (dot(from_centre, from_centre) > part.sphere.radius_m * part.sphere.radius_m) continue;
    const Vec3d m =
        straightened(part.shape.bend, turn.apply_inverse(vertex_m - part.object_from_part.translation_m));
    if (!(inside_outside_radial(straight(part.shape), m) <= 1)) continue;
    // Solve r(row, col) - D n(row, col) = m, from the foot point.
    const Foot<double> foot = table.foot(m);
    double row = foot.row, col = foot.col, depth_m = foot.depth_m;
    double miss = std::numeric_limits<double>::infinity();
    for (int step = 0; step < 4; ++step) {
      const SurfaceSample<double> r = table.sample(row, col);
      const Vec3d e = m - (r.point_m - depth_m * r.normal);
      miss = norm(e);
      const Vec3d a = r.point_row_m - depth_m * r.normal_row, b = r.point_col_m - depth_m * r.normal_col;
      const Vec3d c = -r.normal;
      const double determinant = dot(a, cross(b, c));
      if (!(std::abs(determinant) > 1e-12 * norm(a) * norm(b))) break;
      row = std::clamp(row + dot(e, cross(b, c)) / determinant, 0.0, double(map.rows - 1));
      col += dot(a, cross(e, c)) / determinant;
      if (col < 0) col += map.cols;
      if (!(col < map.cols)) col -= map.cols;
      if (!(col >= 0 && col < map.cols)) break;
      depth_m += dot(a, cross(b, e)) / determinant;
    }
    if (!(miss < 1e-3 * tolerance_m)) continue;  // beyond the medial axis; also NaN

    const auto cell_row = std::min(static_cast<std::uint32_t>(row), map.rows - 2);
    const auto cell_col = std::min(static_cast<std::uint32_t>(col), map.cols - 1);
    const std::uint32_t corner[4] = {
        cell_row * map.cols + cell_col, cell_row * map.cols + (cell_col + 1) % map.cols,
        (cell_row + 1) * map.cols + cell_col, (cell_row + 1) * map.cols + (cell_col + 1) % map.cols};
    if (!std::all_of(corner, corner + 4, [&](std::uint32_t k) {
          return map.code[k] != map.miss_code() && !map.starts_inside(k);
        })) {
      continue;
    }
    const double s = row - cell_row, t = col - cell_col;
    const double low = (1 - t) * map.depth_m(map.code[corner[0]]) + t * map.depth_m(map.code[corner[1]]);
    const double high = (1 - t) * map.depth_m(map.code[corner[2]]) + t * map.depth_m(map.code[corner[3]]);
    const double missed_m = std::abs((1 - s) * low + s * high - depth_m);
    if (!(missed_m > tolerance_m) || !(missed_m > best[corner[0]].miss_m)) continue;
    const double code = std::round((depth_m - map.depth_min_m) / std::max(map.depth_step_m, 1e-300));
    if (!(code >= 0 && code < map.miss_code())) continue;
    // Visible: the first crossing of the vertex's own ray is the vertex (paper Fig. 5a, point W is not).
    const SurfaceSample<double> r = table.sample(row, col);
    lines.trace(r.point_m, -r.normal, hits);
    if (hits.empty() || hits.front().t_m < depth_m - 0.5 * tolerance_m) continue;
    best[corner[0]] = {
        missed_m,
        {corner[0], static_cast<std::uint8_t>(std::min(255.0, std::floor(s * 256))),
         static_cast<std::uint8_t>(std::min(255.0, std::floor(t * 256))), static_cast<std::uint16_t>(code)}};
  }
  for (const Best& cell : best) {
    if (cell.miss_m > 0) map.vertex_samples.push_back(cell.sample);
  }
}

}  // namespace sqmap::bake
