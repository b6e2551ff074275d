// SPDX-License-Identifier: Apache-2.0
//
// One part made ready for queries: layers 1, 2 and 3 in the part's own frame. Templated on the scalar, so
// that the tests can hold the float runtime against the same lines in double.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "sqmap/asset/asset.hpp"
#include "sqmap/asset/shape_table.hpp"

#include "triangle.hpp"

namespace sqmap::runtime {

/// The next float at or above a double.
inline float rounded_up(double value) noexcept {
  const float rounded = static_cast<float>(value);
  return rounded < value ? std::nextafter(rounded, std::numeric_limits<float>::infinity()) : rounded;
}

/// What one chart knows of a point inside its superquadric; part frame.
template <class T>
struct ChartAnswer {
  bool inside{};  ///< by the parity of the crossings above the point
  T certainty{};  ///< distance from the nearest crossing of the ray / doubt of that crossing [-]
  T distance_m = std::numeric_limits<T>::infinity();  ///< to the represented surface; infinite: not eligible
  Vec3<T> surface_m;                                  ///< nearest point found on it
  Vec3<T> normal;                                     ///< outward unit normal there
  T row{}, col{};                                     ///< layer 3: where on the map
  bool behind_first{};  ///< layer 2: the nearest crossing is not the first of its ray
  bool leaving{};       ///< layer 2: the ray leaves the material there
  T offset_m{};  ///< delta of QueryOptions::edge_length_m for the edge length asked for; 0 on flat and hollow
                 ///< surface
  bool faces_patch{};  ///< layer 3: the nearest point lies within the represented surface, not on its rim
};

template <class T>
class Chart {
 public:
  explicit Chart(const Part& part)
      : shape_{cast<T>(part.shape.semi_axes_m), static_cast<T>(part.shape.e1), static_cast<T>(part.shape.e2)},
        object_from_part_(rotation<T>(part.object_from_part.orientation)),
        translation_m_(cast<T>(part.object_from_part.translation_m)),
        sphere_centre_m_(cast<T>(part.sphere.centre_m)),
        sphere_radius_m_(rounded_up(part.sphere.radius_m)),
        vertex_count_(part.vertex_count),
        map_(part.map),
        table_(part.shape, part.map.rows, part.map.cols) {}

  const Vec3<T>& sphere_centre_m() const noexcept { return sphere_centre_m_; }
  T sphere_radius_m() const noexcept { return sphere_radius_m_; }
  std::uint32_t vertex_count() const noexcept { return vertex_count_; }
  double texels_at(std::uint32_t level) const noexcept {
    const std::uint32_t stride = stride_at(level);
    return (static_cast<double>((map_.rows - 1) / stride) + 1) * (map_.cols / stride);
  }

  Vec3<T> to_part(const Vec3<T>& p_m) const noexcept {
    return object_from_part_.apply_inverse(p_m - translation_m_);
  }
  Vec3<T> to_object(const Vec3<T>& p_part_m) const noexcept {
    return object_from_part_.apply(p_part_m) + translation_m_;
  }
  Vec3<T> to_object_direction(const Vec3<T>& d_part) const noexcept {
    return object_from_part_.apply(d_part);
  }

  /// Layer 1.
  T inside_outside_radial(const Vec3<T>& p_part_m) const noexcept {
    return sqmap::inside_outside_radial(shape_, p_part_m);
  }
  Vec3<T> normal_at(const Vec3<T>& p_part_m) const noexcept { return sqmap::normal_at(shape_, p_part_m); }

  /// Layers 2 and 3 for a point inside the superquadric. edge_m > 0: also the offset for faces with such
  /// edges.
  ChartAnswer<T> look(const Vec3<T>& p_part_m, bool third_layer, std::uint32_t level,
                      T edge_m = T(0)) const noexcept;

  std::size_t bytes() const noexcept {
    return sizeof(*this) + table_.bytes() + map_.code.capacity() * sizeof(map_.code[0]) +
           map_.start_inside.capacity() + map_.crossings.capacity() * sizeof(DistanceMap::Crossing) +
           map_.vertex_samples.capacity() * sizeof(DistanceMap::VertexSample);
  }

 private:
  /// A cell of the map at one level: its corners in row-major order and whether they bound a surface patch.
  struct Cell {
    std::uint32_t row, col;  // lowest corner, level-0 nodes
    std::uint32_t texel[4];
    bool eligible;  // four corners hit the mesh from outside it
    T depth_m[4];
  };
  /// The represented surface r - D n (paper eq. 22) at one place, with its derivatives.
  struct Patch {
    Vec3<T> point_m, row_m, col_m;
  };

  std::uint32_t stride_at(std::uint32_t level) const noexcept {
    return 1U << std::min(level, map_.level_count - 1);
  }
  /// Outward unit normal of the represented surface at (row, col) of the cell.
  Vec3<T> patch_normal(const Cell& cell, T row, T col, std::uint32_t stride) const noexcept {
    // On a pole the columns have no length, and the cross product no direction: look from a little beside it.
    constexpr T kBesidePole = T(0.05);
    const Patch patch =
        patch_at(cell, std::clamp(row, kBesidePole, T(map_.rows - 1) - kBesidePole), col, stride);
    return normalized(cross(patch.col_m, patch.row_m));
  }
  Cell cell_at(T row, T col, std::uint32_t stride) const noexcept;
  Patch patch_at(const Cell& cell, T row, T col, std::uint32_t stride) const noexcept;
  ChartAnswer<T> second_layer(const Foot<T>& foot, std::uint32_t stride) const noexcept;
  void third_layer(const Vec3<T>& p, const Foot<T>& foot, std::uint32_t stride,
                   ChartAnswer<T>& answer) const noexcept;
  /// Largest convex curvature of the represented surface around (row, col) [1/m], at the resolution of the
  /// cells; 0 where it is flat or hollow.
  T convex_curvature(T row, T col, std::uint32_t stride) const noexcept;
  void vertex_fan(const Vec3<T>& p, const Cell& cell, ChartAnswer<T>& answer) const noexcept;

  SuperquadricOf<T> shape_;
  Rotation<T> object_from_part_;
  Vec3<T> translation_m_, sphere_centre_m_;
  T sphere_radius_m_;
  std::uint32_t vertex_count_;
  DistanceMap map_;
  ShapeTable<T> table_;
};

template <class T>
typename Chart<T>::Cell Chart<T>::cell_at(T row, T col, std::uint32_t stride) const noexcept {
  Cell cell;
  const std::uint32_t last_row = map_.rows - 1 - stride;
  cell.row = std::min(static_cast<std::uint32_t>(std::max(row, T(0))) / stride * stride, last_row);
  cell.col = std::min(static_cast<std::uint32_t>(std::max(col, T(0))), map_.cols - 1) / stride * stride;
  const std::uint32_t next_col = cell.col + stride < map_.cols ? cell.col + stride : 0;
  cell.texel[0] = cell.row * map_.cols + cell.col;
  cell.texel[1] = cell.row * map_.cols + next_col;
  cell.texel[2] = cell.texel[0] + stride * map_.cols;
  cell.texel[3] = cell.texel[1] + stride * map_.cols;
  cell.eligible = true;
  for (int k = 0; k < 4; ++k) {
    const std::uint16_t code = map_.code[cell.texel[k]];
    cell.eligible = cell.eligible && code != map_.miss_code() && !map_.starts_inside(cell.texel[k]);
    cell.depth_m[k] = static_cast<T>(map_.depth_m(code));
  }
  return cell;
}

template <class T>
typename Chart<T>::Patch Chart<T>::patch_at(const Cell& cell, T row, T col,
                                            std::uint32_t stride) const noexcept {
  const T size = T(stride);
  const T s = (row - T(cell.row)) / size, t = (col - T(cell.col)) / size;
  const T low = cell.depth_m[0] + t * (cell.depth_m[1] - cell.depth_m[0]);
  const T high = cell.depth_m[2] + t * (cell.depth_m[3] - cell.depth_m[2]);
  const T depth = low + s * (high - low);
  const T depth_row = (high - low) / size;
  const T depth_col =
      ((T(1) - s) * (cell.depth_m[1] - cell.depth_m[0]) + s * (cell.depth_m[3] - cell.depth_m[2])) / size;
  const SurfaceSample<T> r = table_.sample(row, col);
  return {r.point_m - depth * r.normal, r.point_row_m - depth_row * r.normal - depth * r.normal_row,
          r.point_col_m - depth_col * r.normal - depth * r.normal_col};
}

template <class T>
ChartAnswer<T> Chart<T>::look(const Vec3<T>& p_part_m, bool third, std::uint32_t level,
                              T edge_m) const noexcept {
  const std::uint32_t stride = stride_at(level);
  const Foot<T> foot = table_.foot(p_part_m);
  ChartAnswer<T> answer = second_layer(foot, stride);
  if (third) {
    ChartAnswer<T> refined = answer;
    third_layer(p_part_m, foot, stride, refined);
    // A second sheet behind the first has no patch of its own: its ray distance stands where it is nearer.
    if (!answer.behind_first || refined.distance_m < answer.distance_m) answer = refined;
  }
  if (edge_m > T(0) && std::isfinite(answer.distance_m)) {
    const T row = third ? answer.row : foot.row, col = third ? answer.col : foot.col;
    const T bend = edge_m * convex_curvature(row, col, stride);  // L / rho
    answer.offset_m = edge_m * bend / (T(3) * (T(1) + std::sqrt(T(1) + bend * bend / T(3))));
  }
  return answer;
}

template <class T>
T Chart<T>::convex_curvature(T row, T col, std::uint32_t stride) const noexcept {
  // Differences between the centres of neighbouring cells, so that a crease between two cells counts as well.
  struct Centre {
    Vec3<T> point_m, normal;
    bool eligible;
  };
  const T turn = T(map_.cols);
  const auto centre_at = [&](T r, T c) {
    const Cell cell = cell_at(r, c < T(0) ? c + turn : c < turn ? c : c - turn, stride);
    const T half = T(stride) / T(2), mid_row = T(cell.row) + half, mid_col = T(cell.col) + half;
    return Centre{patch_at(cell, mid_row, mid_col, stride).point_m,
                  patch_normal(cell, mid_row, mid_col, stride), cell.eligible};
  };
  const T step = T(stride);
  T most = 0;
  const Centre here = centre_at(row, col);
  const T last = T(map_.rows - 1) - T(0.5);
  for (const auto& [dr, dc] : {std::pair{step, T(0)}, {-step, T(0)}, {T(0), step}, {T(0), -step}}) {
    const Centre there = centre_at(std::clamp(row + dr, T(0), last), col + dc);
    const Vec3<T> d = there.point_m - here.point_m;
    const T square = dot(d, d);
    if (!there.eligible || !(square > T(0))) continue;
    most = std::max(most, dot(there.normal - here.normal, d) / square);
  }
  return most;
}

template <class T>
ChartAnswer<T> Chart<T>::second_layer(const Foot<T>& foot, std::uint32_t stride) const noexcept {
  const Cell cell = cell_at(foot.row, foot.col, stride);
  const SurfaceSample<T> r = table_.sample(foot.row, foot.col);
  const T s = (foot.row - T(cell.row)) / T(stride), t = (foot.col - T(cell.col)) / T(stride);
  const std::uint32_t nearest = cell.texel[(s < T(0.5) ? 0 : 2) + (t < T(0.5) ? 0 : 1)];
  T shift_m = 0;  // of the nearest texel's crossings, so that the first of them is the interpolated one
  T doubt_m;
  if (cell.eligible) {
    const T low = cell.depth_m[0] + t * (cell.depth_m[1] - cell.depth_m[0]);
    const T high = cell.depth_m[2] + t * (cell.depth_m[3] - cell.depth_m[2]);
    shift_m = low + s * (high - low) - static_cast<T>(map_.depth_m(map_.code[nearest]));
    const auto [least, most] = std::minmax_element(cell.depth_m, cell.depth_m + 4);
    doubt_m = T(0.25) * (*most - *least) + static_cast<T>(map_.depth_step_m);
  } else {
    doubt_m = (norm(r.point_col_m) + norm(r.point_row_m)) * T(stride);
  }
  // Where corners start on different sides of the mesh, the surface passes near the superquadric's own.
  const bool start = map_.starts_inside(nearest);
  bool one_start = true;
  for (const std::uint32_t texel : cell.texel) one_start = one_start && map_.starts_inside(texel) == start;

  ChartAnswer<T> answer;
  answer.inside = start;
  T gap_m = std::numeric_limits<T>::infinity();  // to the nearest crossing
  T crossing_m = 0;
  bool odd = false;
  const auto pass = [&](std::uint16_t code) {
    const T depth_m = static_cast<T>(map_.depth_m(code)) + shift_m;
    if (depth_m < foot.depth_m) answer.inside = !answer.inside;
    if (std::abs(depth_m - foot.depth_m) < gap_m) {
      gap_m = std::abs(depth_m - foot.depth_m);
      crossing_m = depth_m;
      answer.behind_first = code != map_.code[nearest];
      answer.leaving = odd;
    }
    odd = !odd;
  };
  if (map_.code[nearest] != map_.miss_code()) {
    pass(map_.code[nearest]);
    const auto less = [](const DistanceMap::Crossing& crossing, std::uint32_t texel) {
      return crossing.texel < texel;
    };
    for (auto it = std::lower_bound(map_.crossings.begin(), map_.crossings.end(), nearest, less);
         it != map_.crossings.end() && it->texel == nearest; ++it) {
      pass(it->code);
    }
  }
  // A ray without a crossing is as certain as the shape is large.
  const T reach_m = one_start ? sphere_radius_m_ : std::max(foot.depth_m, T(0));
  answer.certainty = std::min(gap_m, reach_m) / std::max(doubt_m, T(1e-6) * sphere_radius_m_);
  if (!cell.eligible || !std::isfinite(gap_m)) return answer;
  answer.distance_m = gap_m;
  answer.surface_m = r.point_m - crossing_m * r.normal;
  answer.normal = (answer.leaving ? T(-1) : T(1)) * patch_normal(cell, foot.row, foot.col, stride);
  return answer;
}

template <class T>
void Chart<T>::third_layer(const Vec3<T>& p, const Foot<T>& foot, std::uint32_t stride,
                           ChartAnswer<T>& answer) const noexcept {
  constexpr int kSteps = 6;  // Gauss-Newton converges in two or three; the rest crosses cells
  T row = foot.row, col = foot.col;
  Cell cell = cell_at(row, col, stride);
  if (!cell.eligible) return;
  const T last_row = T(map_.rows - 1), turn = T(map_.cols);
  T best_square = std::numeric_limits<T>::infinity();
  Cell best_cell = cell;
  bool on_rim = false, best_on_rim = false;
  Vec3<T> best_point_m;
  T best_row = row, best_col = col;
  for (int step = 0; step <= kSteps; ++step) {
    const Patch patch = patch_at(cell, row, col, stride);
    const Vec3<T> error_m = p - patch.point_m;
    const T square = dot(error_m, error_m);
    if (square < best_square) {
      best_square = square;
      best_point_m = patch.point_m;
      best_cell = cell;
      best_row = row;
      best_col = col;
      best_on_rim = on_rim;
    }
    const T a = dot(patch.row_m, patch.row_m), b = dot(patch.row_m, patch.col_m),
            c = dot(patch.col_m, patch.col_m);
    const T f = dot(patch.row_m, error_m), g = dot(patch.col_m, error_m);
    const T determinant = a * c - b * b;
    T d_row = 0, d_col = 0;
    if (determinant > T(1e-6) * a * c) {
      d_row = (c * f - b * g) / determinant;
      d_col = (a * g - b * f) / determinant;
    } else if (a > T(0)) {
      d_row = f / a;  // a pole: columns have no length
    }
    // At most one cell a step; beside a pole, where columns are short, as far as one row is long.
    const T most_row = T(stride);
    const T most_col =
        std::min(turn / T(8), most_row * std::max(T(1), std::sqrt(a / std::max(c, T(1e-6) * a))));
    d_row = std::clamp(d_row, -most_row, most_row);
    d_col = std::clamp(d_col, -most_col, most_col);
    if (std::abs(d_row) + std::abs(d_col) < T(1e-3)) break;
    T next_row = std::clamp(row + d_row, T(0), last_row);
    T next_col = col + d_col;
    if (next_col < T(0)) next_col += turn;
    if (!(next_col < turn)) next_col = next_col - turn;
    const Cell next = cell_at(next_row, next_col, stride);
    if (next.eligible) {
      cell = next;
      row = next_row;
      col = next_col;
      on_rim = false;
    } else {  // stay on the rim of the patch
      on_rim = true;
      const T rim_row = std::clamp(row + d_row, T(cell.row), T(cell.row + stride));
      const T rim_col = std::clamp(col + d_col, T(cell.col), T(cell.col + stride));
      if (rim_row == row && rim_col == col) break;
      row = rim_row;
      col = std::min(rim_col, std::nextafter(turn, T(0)));
    }
  }
  answer.distance_m = std::sqrt(best_square);
  answer.surface_m = best_point_m;
  answer.faces_patch = !best_on_rim;
  answer.row = best_row;
  answer.col = best_col;
  answer.normal = patch_normal(best_cell, best_row, best_col, stride);
  if (stride == 1) vertex_fan(p, best_cell, answer);
}

template <class T>
void Chart<T>::vertex_fan(const Vec3<T>& p, const Cell& cell, ChartAnswer<T>& answer) const noexcept {
  const auto less = [](const DistanceMap::VertexSample& sample, std::uint32_t texel) {
    return sample.cell < texel;
  };
  const auto it =
      std::lower_bound(map_.vertex_samples.begin(), map_.vertex_samples.end(), cell.texel[0], less);
  if (it == map_.vertex_samples.end() || it->cell != cell.texel[0]) return;
  const auto place = [&](T row, T col, T depth) {
    const SurfaceSample<T> r = table_.sample(row, col);
    return r.point_m - depth * r.normal;
  };
  const Vec3<T> apex =
      place(T(cell.row) + T(it->row_256ths) / T(256), T(cell.col) + T(it->col_256ths) / T(256),
            static_cast<T>(map_.depth_m(it->code)));
  // Corners counter-clockwise seen from outside: rows grow upwards, columns to the right.
  const T top = T(cell.row + 1), right = T(cell.col + 1);
  const Vec3<T> corner[4] = {place(T(cell.row), T(cell.col), cell.depth_m[0]),
                             place(T(cell.row), right, cell.depth_m[1]), place(top, right, cell.depth_m[3]),
                             place(top, T(cell.col), cell.depth_m[2])};
  T best_square = std::numeric_limits<T>::infinity();
  for (int k = 0; k < 4; ++k) {
    const Vec3<T>& a = corner[k];
    const Vec3<T>& b = corner[(k + 1) % 4];
    const Vec3<T> nearest = nearest_on_triangle(p, a, b, apex);
    const Vec3<T> d = p - nearest;
    if (dot(d, d) < best_square) {
      best_square = dot(d, d);
      answer.distance_m = std::sqrt(best_square);
      answer.surface_m = nearest;
      answer.normal = normalized(cross(b - a, apex - a));
    }
  }
}

}  // namespace sqmap::runtime
