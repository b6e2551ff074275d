// SPDX-License-Identifier: Apache-2.0
#include "part_surface.hpp"

#include <algorithm>
#include <limits>

#include "sqmap/asset/map_grid.hpp"

namespace sqmap::apps {
namespace {

// Fine enough that the outline looks smooth at the size of a screen.
constexpr std::uint32_t kDrawnRows = 33;
constexpr std::uint32_t kDrawnCols = 64;
// A smooth surface that leans by 75 degrees against its ray stretches a cell by 4.
constexpr double kMaxStretch = 4;
constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();

struct GridNode {
  Vec3d point_m;  ///< of the surface to draw
  Vec3d normal;   ///< of the superquadric
};

double longest_edge_m(const std::array<Vec3d, 4>& corner) {
  double longest_m = 0;
  for (std::size_t k = 0; k < 4; ++k) longest_m = std::max(longest_m, norm(corner[(k + 1) % 4] - corner[k]));
  return longest_m;
}

/// Collects triangles between grid nodes and keeps the nodes that are used.
class SurfaceBuilder {
 public:
  explicit SurfaceBuilder(const std::vector<GridNode>& nodes)
      : nodes_(nodes), place_(nodes.size(), kUnused) {}

  void add(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const Vec3d area = cross(nodes_[b].point_m - nodes_[a].point_m, nodes_[c].point_m - nodes_[a].point_m);
    if (!(norm(area) > 0)) return;  // a cell at a pole is a triangle
    surface_.triangles.push_back({place(a), place(b), place(c)});
    for (const std::uint32_t corner : surface_.triangles.back())
      normal_sum_[corner] = normal_sum_[corner] + area;
  }

  TriangleSurface finish() {
    for (std::size_t i = 0; i < normal_sum_.size(); ++i) {
      const Vec3d mean = normalized(normal_sum_[i]);
      if (norm(mean) > 0) surface_.normals[i] = cast<float>(mean);
    }
    return std::move(surface_);
  }

 private:
  std::uint32_t place(std::uint32_t node) {
    if (place_[node] == kUnused) {
      place_[node] = static_cast<std::uint32_t>(surface_.points_m.size());
      surface_.points_m.push_back(cast<float>(nodes_[node].point_m));
      surface_.normals.push_back(cast<float>(nodes_[node].normal));
      normal_sum_.emplace_back();
    }
    return place_[node];
  }

  const std::vector<GridNode>& nodes_;
  std::vector<std::uint32_t> place_;
  std::vector<Vec3d> normal_sum_;
  TriangleSurface surface_;
};

/// Triangulates the cells of a grid that wraps in its columns; is_drawn(row, col) says which.
template <class IsDrawn>
TriangleSurface build(const std::vector<GridNode>& nodes, const MapGrid& grid, IsDrawn is_drawn) {
  SurfaceBuilder builder(nodes);
  const std::uint32_t cols = grid.cols();
  for (std::uint32_t row = 0; row + 1 < grid.rows(); ++row) {
    for (std::uint32_t col = 0; col < cols; ++col) {
      if (!is_drawn(row, col)) continue;
      const std::uint32_t low = row * cols, high = low + cols, right = (col + 1) % cols;
      builder.add(low + col, low + right, high + right);
      builder.add(low + col, high + right, high + col);
    }
  }
  return builder.finish();
}

/// One level of a distance map as a grid of its own.
class LevelGrid {
 public:
  LevelGrid(const Part& part, std::uint32_t level)
      : map_(part.map),
        stride_(1U << std::min(level, part.map.level_count - 1)),
        rows_((part.map.rows - 1) / stride_ + 1),
        cols_(part.map.cols / stride_),
        bend_(part.shape.bend),
        grid_(straight(part.shape), rows_, cols_) {}

  std::uint32_t rows() const noexcept { return rows_; }
  std::uint32_t cols() const noexcept { return cols_; }
  double depth_m(std::uint32_t row, std::uint32_t col) const {
    return map_.depth_m(map_.code[texel(row, col)]);
  }

  /// Bilinear depth at a place inside a cell, row and col in [0, 1].
  double depth_m(std::uint32_t row, std::uint32_t col, double row_share, double col_share) const {
    const std::uint32_t above = std::min(row + 1, rows_ - 1);
    const double low = depth_m(row, col) + col_share * (depth_m(row, col + 1) - depth_m(row, col));
    const double high = depth_m(above, col) + col_share * (depth_m(above, col + 1) - depth_m(above, col));
    return low + row_share * (high - low);
  }

  /// The cell's corners hit the mesh from outside it, and its surface does not jump.
  bool is_drawn(std::uint32_t row, std::uint32_t col) const {
    std::array<Vec3d, 4> base, drawn;
    for (std::uint32_t k = 0; k < 4; ++k) {
      const std::uint32_t r = row + k / 2, c = (col + (k == 1 || k == 2 ? 1 : 0)) % cols_;
      const std::uint32_t node = texel(r, c);
      if (map_.code[node] == map_.miss_code() || map_.starts_inside(node)) return false;
      const Vec3d p = grid_.point(r, c);
      base[k] = bent(bend_, p);
      drawn[k] = bent(bend_, p - depth_m(r, c) * grid_.normal(r, c));
    }
    return longest_edge_m(drawn) <= kMaxStretch * longest_edge_m(base);
  }

 private:
  std::uint32_t texel(std::uint32_t row, std::uint32_t col) const noexcept {
    return row * stride_ * map_.cols + col % cols_ * stride_;
  }

  const DistanceMap& map_;
  std::uint32_t stride_, rows_, cols_;
  Bend<double> bend_;
  MapGrid grid_;
};

}  // namespace

TriangleSurface superquadric_surface(const Superquadric& shape) {
  const MapGrid grid(shape, kDrawnRows, kDrawnCols);
  std::vector<GridNode> nodes;
  nodes.reserve(std::size_t{kDrawnRows} * kDrawnCols);
  for (std::uint32_t row = 0; row < kDrawnRows; ++row)
    for (std::uint32_t col = 0; col < kDrawnCols; ++col)
      nodes.push_back({grid.point(row, col), grid.normal(row, col)});
  return build(nodes, grid, [](std::uint32_t, std::uint32_t) { return true; });
}

TriangleSurface mapped_surface(const Part& part, std::uint32_t level) {
  const LevelGrid map(part, level);
  // A cell of the map is curved as the superquadric is: a coarse map is drawn on a finer grid. Equal arc
  // lengths make every node of the map a node of that grid, too.
  const std::uint32_t row_steps = (kDrawnRows - 2) / (map.rows() - 1) + 1,
                      col_steps = (kDrawnCols - 1) / map.cols() + 1;
  const Bend<double>& bend = part.shape.bend;
  const MapGrid grid(straight(part.shape), (map.rows() - 1) * row_steps + 1, map.cols() * col_steps);
  std::vector<GridNode> nodes;
  nodes.reserve(std::size_t{grid.rows()} * grid.cols());
  for (std::uint32_t row = 0; row < grid.rows(); ++row) {
    for (std::uint32_t col = 0; col < grid.cols(); ++col) {
      const double depth_m =
          map.depth_m(row / row_steps, col / col_steps, static_cast<double>(row % row_steps) / row_steps,
                      static_cast<double>(col % col_steps) / col_steps);
      const Vec3d normal = grid.normal(row, col), p = grid.point(row, col) - depth_m * normal;
      nodes.push_back({bent(bend, p), normalized(turned(bend, p, normal))});
    }
  }
  std::vector<bool> is_drawn;
  for (std::uint32_t row = 0; row + 1 < map.rows(); ++row)
    for (std::uint32_t col = 0; col < map.cols(); ++col) is_drawn.push_back(map.is_drawn(row, col));
  return build(nodes, grid, [&](std::uint32_t row, std::uint32_t col) {
    return is_drawn[std::size_t{row / row_steps} * map.cols() + col / col_steps];
  });
}

}  // namespace sqmap::apps
