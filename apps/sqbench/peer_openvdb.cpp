// SPDX-License-Identifier: GPL-3.0-or-later
//
// OpenVDB: a level set in a tree of 8^3 leaves, sampled through an accessor that keeps the path to the last
// leaf. Release 10 keeps values in float, none in half.
#include "peer_openvdb.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>
#include <openvdb/tools/Prune.h>
#include <openvdb/tools/SignedFloodFill.h>

#include "field.hpp"
#include "near_bricks.hpp"
#include "trilinear.hpp"

namespace sqmap::bench {
namespace {

constexpr double kHalfDiagonal = 0.8660254037844387;  // as for dense grids

using Tree = openvdb::FloatTree;
using Leaf = Tree::LeafNodeType;

class OpenvdbPeer : public FieldPeer {
 public:
  OpenvdbPeer(const Model& model, unsigned resolution) : FieldPeer(resolution) {
    const Field& field = model.field(resolution);
    origin_m_ = cast<float>(field.origin_m);
    per_m_ = static_cast<float>(1 / field.spacing_m);
    const double band_m = kBand * model.r_max_m();
    band_m_ = static_cast<float>(band_m);
    // Every corner of a cell that a distance within the band may fall in.
    const auto width_m = static_cast<float>(band_m + 2 * field.spacing_m);
    grid_ = openvdb::FloatGrid::create(width_m);
    grid_->setGridClass(openvdb::GRID_LEVEL_SET);
    auto voxels = grid_->getAccessor();
    for (std::uint32_t z = 0; z < field.nodes[2]; ++z)
      for (std::uint32_t y = 0; y < field.nodes[1]; ++y)
        for (std::uint32_t x = 0; x < field.nodes[0]; ++x)
          if (const float d = field.distance_m[field.index(x, y, z)]; std::abs(d) < width_m)
            voxels.setValueOn({static_cast<int>(x), static_cast<int>(y), static_cast<int>(z)}, d);
    openvdb::tools::signedFloodFill(grid_->tree(), false);
    openvdb::tools::pruneLevelSet(grid_->tree(), false);
    near_ = NearBricks(field, kBrickCells, bricks_within(field, kBrickCells, band_m));
    stated_percent_ = 100 * kHalfDiagonal * field.spacing_m / model.r_max_m() + 1e-4;
  }

  void answer(const Cloud& cloud, const Placement& placement, Hits& hits) const override {
    hits.count = 0;
    const auto voxels = grid_->getConstUnsafeAccessor();  // one thread, and the tree stays as it is
    const std::size_t blocks = find_near_blocks(near_.view(), cloud, placement, blocks_);
    for (std::size_t k = 0; k < blocks; ++k) {
      const std::size_t begin = blocks_[k] * kBlock, end = std::min(begin + kBlock, cloud.count);
      for (std::size_t i = begin; i < end; ++i) {
        const Vec3f u = per_m_ * (placement.apply(cloud.points_m[i]) - origin_m_);
        const openvdb::Coord cell(static_cast<int>(std::floor(u.x)), static_cast<int>(std::floor(u.y)),
                                  static_cast<int>(std::floor(u.z)));
        float corner[8];
        fetch(voxels, cell, corner);
        const Trilinear sample =
            trilinear(corner, u - Vec3f{static_cast<float>(cell.x()), static_cast<float>(cell.y()),
                                        static_cast<float>(cell.z())});
        if (sample.value <= band_m_) hits.add(i, sample.value, normalized(sample.gradient));
      }
    }
  }
  std::size_t bytes() const override { return sizeof(*this) + grid_->memUsage() + near_.bytes(); }
  StatedError stated_error() const override { return {stated_percent_, false}; }

 private:
  /// Two thirds of the cells lie in one leaf, which is then read without a further search.
  static void fetch(const openvdb::FloatGrid::ConstUnsafeAccessor& voxels, const openvdb::Coord& cell,
                    float (&corner)[8]) {
    constexpr openvdb::Index kLast = Leaf::DIM - 1;
    const auto within = [](int x) { return static_cast<openvdb::Index>(x) & kLast; };
    const Leaf* leaf = within(cell.x()) < kLast && within(cell.y()) < kLast && within(cell.z()) < kLast
                           ? voxels.probeConstLeaf(cell)
                           : nullptr;
    if (leaf != nullptr) {
      const openvdb::Index first = Leaf::coordToOffset(cell);  // z fastest
      for (openvdb::Index c = 0; c < 8; ++c)
        corner[c] =
            leaf->getValue(first + (c & 1U) * Leaf::DIM * Leaf::DIM + (c >> 1 & 1U) * Leaf::DIM + (c >> 2));
      return;
    }
    float values[2][2][2];
    openvdb::tools::BoxSampler::getValues(values, voxels, cell);
    for (unsigned c = 0; c < 8; ++c) corner[c] = values[c & 1U][c >> 1 & 1U][c >> 2];
  }

  openvdb::FloatGrid::Ptr grid_;
  NearBricks near_;
  Vec3f origin_m_;
  float per_m_{}, band_m_{};
  double stated_percent_{};
  mutable std::vector<std::uint32_t> blocks_;  // of the last frame, kept to spare the allocation
};

}  // namespace

std::unique_ptr<Peer> make_openvdb(const Model& model, unsigned resolution) {
  return std::make_unique<OpenvdbPeer>(model, resolution);
}

}  // namespace sqmap::bench
