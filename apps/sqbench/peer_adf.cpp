// SPDX-License-Identifier: GPL-3.0-or-later
//
// Adaptively sampled distance field (Frisken et al. 2000): an octree whose leaves interpolate the distance
// trilinearly, refined until that meets the exact field to within a bound. Where no answer is
// asked for, beyond the band, a leaf need only say so. Leaves are of 2 x 2 x 2 cells, which share their 27
// corners: less than half the memory of eight values a cell, and one level less to descend.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "field.hpp"
#include "peer.hpp"
#include "trilinear.hpp"

namespace sqmap::bench {
namespace {

/// As of the dense grids: a trilinear value is wrong by at most this many spacings.
constexpr double kHalfDiagonal = 0.8660254037844387;
constexpr std::array<std::size_t, 3> kStride{1, 3, 9};
constexpr std::uint32_t kLeaf = 0x80000000;  ///< marks a child that is a leaf; the rest is its index

class DistanceOctree : public FieldPeer {
 public:
  DistanceOctree(const Model& model, unsigned resolution, double bound_percent)
      : FieldPeer(resolution), band_m_(static_cast<float>(kBand * model.r_max_m())) {
    const Field& field = model.field(resolution);
    const double bound_m = bound_percent / 100 * model.r_max_m();
    std::uint32_t longest = 1;
    for (std::size_t axis = 0; axis < 3; ++axis) longest = std::max(longest, field.nodes[axis] - 1);
    while ((1U << depth_) < longest) ++depth_;
    per_m_ = static_cast<float>(1 / field.spacing_m);
    origin_m_ = cast<float>(field.origin_m);
    for (int axis = 0; axis < 3; ++axis)
      cells_[axis] = static_cast<float>(field.nodes[static_cast<std::size_t>(axis)] - 1);
    root_ = build(field, {0, 0, 0}, depth_, bound_m);
    nodes_.shrink_to_fit();
    leaves_.shrink_to_fit();
    // On each cell of the lattice a leaf's polynomial is the interpolation of its own values at the corners,
    // and those are within the bound of the field's: the two errors add.
    stated_percent_ = bound_percent + 100 * kHalfDiagonal * field.spacing_m / model.r_max_m() + 1e-4;
  }

  void answer(const Cloud& cloud, const Placement& placement, Hits& hits) const override {
    hits.count = 0;
    for (std::size_t block = 0; block < cloud.block_count; ++block) {
      const Vec3f middle = in_lattice(
          placement.apply({cloud.block_x_m[block], cloud.block_y_m[block], cloud.block_z_m[block]}));
      const float reach = cloud.block_radius_m[block] * per_m_;
      if (!is_near_lattice(middle, reach)) continue;
      Found leaf;  // neighbours mostly share one
      for (std::size_t i = block * kBlock; i < std::min((block + 1) * kBlock, cloud.count); ++i) {
        const Vec3f u = in_lattice(placement.apply(cloud.points_m[i]));
        if (!(u.x >= 0 && u.x < cells_.x && u.y >= 0 && u.y < cells_.y && u.z >= 0 && u.z < cells_.z))
          continue;
        if (leaf.corner == nullptr || !leaf.holds(u)) leaf = find(u);
        answer_point(leaf, u, i, hits);
      }
    }
  }
  std::size_t bytes() const override {
    return sizeof(*this) + nodes_.capacity() * sizeof(nodes_[0]) + leaves_.capacity() * sizeof(leaves_[0]);
  }
  StatedError stated_error() const override { return {stated_percent_, false}; }

 private:
  using Corners = std::array<float, 27>;  ///< distances [m] at (0, 1, 2)^3 halves of a leaf, x fastest

  /// A leaf and where it lies, in cells of the lattice.
  struct Found {
    const Corners* corner = nullptr;
    Vec3f low{};
    float size{};
    bool holds(const Vec3f& u) const noexcept {
      const Vec3f d = u - low;
      return d.x >= 0 && d.x < size && d.y >= 0 && d.y < size && d.z >= 0 && d.z < size;
    }
  };

  Vec3f in_lattice(const Vec3f& p_m) const noexcept { return per_m_ * (p_m - origin_m_); }
  bool is_near_lattice(const Vec3f& u, float reach) const noexcept {
    return u.x > -reach && u.x < cells_.x + reach && u.y > -reach && u.y < cells_.y + reach && u.z > -reach &&
           u.z < cells_.z + reach;
  }

  Found find(const Vec3f& u) const noexcept {
    const auto x = static_cast<std::uint32_t>(u.x), y = static_cast<std::uint32_t>(u.y),
               z = static_cast<std::uint32_t>(u.z);
    std::uint32_t at = root_, level = depth_;
    while ((at & kLeaf) == 0) {
      --level;
      at = nodes_[at][((x >> level) & 1U) | ((y >> level) & 1U) << 1 | ((z >> level) & 1U) << 2];
    }
    const auto low = [level](std::uint32_t cell) { return static_cast<float>(cell >> level << level); };
    return {&leaves_[at & ~kLeaf], {low(x), low(y), low(z)}, static_cast<float>(1U << level)};
  }

  void answer_point(const Found& leaf, const Vec3f& u, std::size_t index, Hits& hits) const noexcept {
    Vec3f f = (2 / leaf.size) * (u - leaf.low);
    std::size_t first = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const bool is_upper = f[axis] >= 1;
      if (is_upper) f[axis] -= 1;
      if (is_upper) first += kStride[static_cast<std::size_t>(axis)];
    }
    const float* d = leaf.corner->data() + first;
    const Trilinear sample = trilinear({d[0], d[1], d[3], d[4], d[9], d[10], d[12], d[13]}, f);
    if (sample.value <= band_m_) hits.add(index, sample.value, normalized(sample.gradient));
  }

  /// The cube of 2^level cells from `low` on: what a parent stores of it.
  std::uint32_t build(const Field& field, const std::array<std::uint32_t, 3>& low, std::uint32_t level,
                      double bound_m) {
    const Corners corner = corners(field, low, 1U << level);
    if (level == 1 || is_met(field, low, 1U << level, corner, bound_m)) {
      leaves_.push_back(corner);
      return kLeaf | static_cast<std::uint32_t>(leaves_.size() - 1);
    }
    const std::size_t node = nodes_.size();
    nodes_.emplace_back();
    for (std::uint32_t child = 0; child < 8; ++child) {
      const std::uint32_t half = 1U << (level - 1);
      const std::uint32_t built = build(
          field,
          {low[0] + (child & 1U) * half, low[1] + (child >> 1 & 1U) * half, low[2] + (child >> 2) * half},
          level - 1, bound_m);
      nodes_[node][child] = built;
    }
    return static_cast<std::uint32_t>(node);
  }
  /// The root is a cube, the lattice need not be: beyond, its last nodes are repeated. No point is there.
  static Corners corners(const Field& field, const std::array<std::uint32_t, 3>& low, std::uint32_t size) {
    Corners corner{};
    for (std::uint32_t k = 0; k < 27; ++k)
      corner[k] = field.distance_m[field.index(std::min(low[0] + k % 3 * size / 2, field.nodes[0] - 1),
                                               std::min(low[1] + k / 3 % 3 * size / 2, field.nodes[1] - 1),
                                               std::min(low[2] + k / 9 * size / 2, field.nodes[2] - 1))];
    return corner;
  }
  /// At a place in halves of the leaf.
  static double interpolated(const Corners& corner, double x, double y, double z) {
    const auto cell = [](double at) { return at < 1 ? std::size_t{0} : std::size_t{1}; };
    const std::size_t i = cell(x), j = cell(y), k = cell(z);
    const float* d = corner.data() + i * kStride[0] + j * kStride[1] + k * kStride[2];
    const auto along_x = [&](std::size_t at) {
      return d[at] + (x - static_cast<double>(i)) * (double{d[at + 1]} - d[at]);
    };
    const auto along_y = [&](std::size_t at) {
      return along_x(at) + (y - static_cast<double>(j)) * (along_x(at + 3) - along_x(at));
    };
    return along_y(0) + (z - static_cast<double>(k)) * (along_y(9) - along_y(0));
  }
  /// Whether interpolation is as close to the field as asked, at every node of the lattice within the cube.
  bool is_met(const Field& field, const std::array<std::uint32_t, 3>& low, std::uint32_t size,
              const Corners& corner, double bound_m) const {
    const double exact_m = band_m_ + 2 * field.spacing_m;
    const std::array<std::uint32_t, 3> end{std::min(low[0] + size, field.nodes[0] - 1),
                                           std::min(low[1] + size, field.nodes[1] - 1),
                                           std::min(low[2] + size, field.nodes[2] - 1)};
    const double half = size / 2.0;
    for (std::uint32_t z = low[2]; z <= end[2]; ++z)
      for (std::uint32_t y = low[1]; y <= end[1]; ++y)
        for (std::uint32_t x = low[0]; x <= end[0]; ++x) {
          const double told_m =
              interpolated(corner, (x - low[0]) / half, (y - low[1]) / half, (z - low[2]) / half);
          const double truth_m = field.distance_m[field.index(x, y, z)];
          const bool is_beyond =
              (truth_m > exact_m && told_m > exact_m) || (truth_m < -exact_m && told_m < -exact_m);
          if (!is_beyond && std::abs(told_m - truth_m) > bound_m) return false;
        }
    return true;
  }

  float band_m_, per_m_{};
  Vec3f origin_m_, cells_;
  std::uint32_t depth_{}, root_{};
  std::vector<std::array<std::uint32_t, 8>> nodes_;
  std::vector<Corners> leaves_;
  double stated_percent_{};
};

}  // namespace

std::unique_ptr<Peer> make_adf(const Model& model, unsigned resolution, double bound_percent) {
  return std::make_unique<DistanceOctree>(model, resolution, bound_percent);
}

}  // namespace sqmap::bench
