// SPDX-License-Identifier: GPL-3.0-or-later
//
// Voxmap and pointshell (McNeely, Puterbaugh and Troy 1999): the object in voxels that are free, surface or
// interior, the probe in points with normals; a point in a surface voxel is pushed from the tangent plane
// through the voxel's centre. The voxels stand in a tree whose nodes have 512 children, as the paper quotes
// it, two bits a voxel.
#include "peer_voxmap.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "closest.hpp"
#include "exact_answer.hpp"
#include "field.hpp"

namespace sqmap::bench {
namespace {

constexpr double kHalfDiagonal = 0.8660254037844387;  // of a unit voxel
constexpr std::uint32_t kFree = 0, kSurface = 1, kInterior = 2;
constexpr std::int32_t kAllFree = -1, kAllInterior = -2;  // instead of the place of a child
constexpr std::uint32_t kEdge = 8;                        // 8 x 8 x 8 children

struct Point {
  Vec3f place_m, outward;
};

class VoxmapPeer : public ContactPeer {
 public:
  VoxmapPeer(const Model& model, const bake::Mesh& probe, unsigned resolution)
      : order_(probe.vertices_m), near_(model) {
    const Field& field = model.field(resolution);
    per_m_ = static_cast<float>(1 / field.spacing_m);
    spacing_m_ = static_cast<float>(field.spacing_m);
    origin_m_ = cast<float>(field.origin_m - 0.5 * field.spacing_m * Vec3d{1, 1, 1});  // nodes are centres
    for (std::size_t axis = 0; axis < 3; ++axis) {
      voxels_[axis] = static_cast<float>(field.nodes[axis]);
      roots_[axis] = (field.nodes[axis] + kEdge * kEdge - 1) / (kEdge * kEdge);
    }
    for (std::uint32_t z = 0; z < roots_[2]; ++z)
      for (std::uint32_t y = 0; y < roots_[1]; ++y)
        for (std::uint32_t x = 0; x < roots_[0]; ++x) root_.push_back(node(field, x, y, z));
    nodes_.shrink_to_fit();
    leaves_.shrink_to_fit();

    const Pseudonormals normals(probe);
    std::vector<Vec3d> outward(probe.vertices_m.size());
    for (std::size_t f = 0; f < probe.faces.size(); ++f)
      for (std::size_t k = 0; k < 3; ++k)
        outward[probe.faces[f][k]] =
            normalized(normals.at(static_cast<std::uint32_t>(f), static_cast<int>(k)));
    for (const std::uint32_t i : order_.source)
      shell_.push_back({cast<float>(probe.vertices_m[i]), cast<float>(outward[i])});
  }

  /// Points in surface and interior voxels.
  std::size_t contacts(const Placement& placement) const override {
    std::size_t count = 0;
    Vec3f force_n;
    near_.for_each(order_, placement, [&](std::size_t index, const Vec3f& p_m) {
      const Point& point = shell_[index];
      const Vec3f u = per_m_ * (p_m - origin_m_);
      if (!(u.x >= 0 && u.x < voxels_[0] && u.y >= 0 && u.y < voxels_[1] && u.z >= 0 && u.z < voxels_[2]))
        return;
      const auto x = static_cast<std::uint32_t>(u.x), y = static_cast<std::uint32_t>(u.y),
                 z = static_cast<std::uint32_t>(u.z);
      const std::uint32_t voxel = at(x, y, z);
      if (voxel == kFree) return;
      ++count;
      if (voxel == kInterior) return;
      const Vec3f centre_m =
          origin_m_ + spacing_m_ * Vec3f{static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F,
                                         static_cast<float>(z) + 0.5F};
      const Vec3f inward = -placement.rotation.apply(point.outward);
      const float depth_m = dot(centre_m - p_m, inward);
      if (depth_m > 0) force_n = force_n + (kStiffness_n_per_m * depth_m) * inward;
    });
    force_n_ = force_n;
    return count;
  }
  std::size_t bytes() const override {
    return sizeof(*this) + root_.capacity() * sizeof(std::int32_t) + nodes_.capacity() * sizeof(nodes_[0]) +
           leaves_.capacity() * sizeof(leaves_[0]);
  }

 private:
  using Node = std::array<std::int32_t, 512>;
  using Leaf = std::array<std::uint8_t, 128>;  // four voxels a byte

  static std::uint32_t slot(std::uint32_t x, std::uint32_t y, std::uint32_t z) noexcept {
    return ((z % kEdge) * kEdge + y % kEdge) * kEdge + x % kEdge;
  }
  std::uint32_t at(std::uint32_t x, std::uint32_t y, std::uint32_t z) const noexcept {
    const std::uint32_t root = (z / 64 * roots_[1] + y / 64) * roots_[0] + x / 64;
    std::int32_t child = root_[root];
    if (child >= 0) child = nodes_[static_cast<std::size_t>(child)][slot(x / kEdge, y / kEdge, z / kEdge)];
    if (child == kAllFree) return kFree;
    if (child == kAllInterior) return kInterior;
    const std::uint32_t voxel = slot(x, y, z);
    return leaves_[static_cast<std::size_t>(child)][voxel / 4] >> (voxel % 4 * 2) & 3U;
  }
  static std::uint32_t voxel_of(const Field& field, std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    if (x >= field.nodes[0] || y >= field.nodes[1] || z >= field.nodes[2]) return kFree;
    const double d = field.distance_m[field.index(x, y, z)];
    return std::abs(d) <= kHalfDiagonal * field.spacing_m ? kSurface : d < 0 ? kInterior : kFree;
  }
  /// Place of the node, or what all below it is.
  std::int32_t node(const Field& field, std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    Node children;
    for (std::uint32_t k = 0; k < kEdge; ++k)
      for (std::uint32_t j = 0; j < kEdge; ++j)
        for (std::uint32_t i = 0; i < kEdge; ++i)
          children[slot(i, j, k)] = leaf(field, kEdge * x + i, kEdge * y + j, kEdge * z + k);
    if (is_one_negative(children)) return children.front();
    nodes_.push_back(children);
    return static_cast<std::int32_t>(nodes_.size() - 1);
  }
  static bool is_one_negative(const Node& children) {
    return children.front() < 0 && std::all_of(children.begin(), children.end(),
                                               [&](std::int32_t c) { return c == children.front(); });
  }
  std::int32_t leaf(const Field& field, std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    Leaf bits{};
    std::array<std::size_t, 3> count{};
    for (std::uint32_t k = 0; k < kEdge; ++k)
      for (std::uint32_t j = 0; j < kEdge; ++j)
        for (std::uint32_t i = 0; i < kEdge; ++i) {
          const std::uint32_t voxel = voxel_of(field, kEdge * x + i, kEdge * y + j, kEdge * z + k);
          const std::uint32_t place = slot(i, j, k);
          bits[place / 4] = static_cast<std::uint8_t>(bits[place / 4] | voxel << (place % 4 * 2));
          ++count[voxel];
        }
    if (count[kFree] == 512) return kAllFree;
    if (count[kInterior] == 512) return kAllInterior;
    leaves_.push_back(bits);
    return static_cast<std::int32_t>(leaves_.size() - 1);
  }

  Cloud order_;  // of the probe: neighbours together, as all methods have them
  NearBox near_;
  float per_m_{}, spacing_m_{};
  Vec3f origin_m_;
  std::array<float, 3> voxels_{};
  std::array<std::uint32_t, 3> roots_{};
  std::vector<std::int32_t> root_;
  std::vector<Node> nodes_;
  std::vector<Leaf> leaves_;
  std::vector<Point> shell_;
  mutable Vec3f force_n_;  // what a frame is for; read by nobody here
};

}  // namespace

std::unique_ptr<ContactPeer> make_voxmap(const Model& model, const bake::Mesh& probe, unsigned resolution) {
  return std::make_unique<VoxmapPeer>(model, probe, resolution);
}

double voxel_reach_m(const Model& model, unsigned resolution) {
  return 2 * kHalfDiagonal * model.field(resolution).spacing_m;
}

}  // namespace sqmap::bench
