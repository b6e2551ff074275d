// SPDX-License-Identifier: GPL-3.0-or-later
//
// NanoVDB: OpenVDB's tree of 8^3 leaves in one block of memory, sampled by its own trilinear sampler, which
// keeps the corners of the cell for the gradient. Blocks of points that reach no brick with a value within
// the band are left out first.
#include "peer_nanovdb.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <type_traits>
#include <vector>

#include <nanovdb/NanoVDB.h>
#include <nanovdb/util/GridBuilder.h>
#include <nanovdb/util/SampleFromVoxels.h>

#include "field.hpp"
#include "near_bricks.hpp"

namespace sqmap::bench {
namespace {

constexpr double kHalfDiagonal = 0.8660254037844387;  // as for dense grids

template <class Code>
class NanovdbPeer : public FieldPeer {
 public:
  NanovdbPeer(const Model& model, unsigned resolution) : FieldPeer(resolution) {
    const Field& field = model.field(resolution);
    origin_m_ = cast<float>(field.origin_m);
    per_m_ = static_cast<float>(1 / field.spacing_m);
    band_m_ = static_cast<float>(kBand * model.r_max_m());
    // Every corner of a cell that a distance within the band may fall in.
    const auto width_m = static_cast<float>(kBand * model.r_max_m() + 2 * field.spacing_m);
    nanovdb::GridBuilder<float, Code> builder(width_m, nanovdb::GridClass::LevelSet);
    auto voxels = builder.getAccessor();
    for (std::uint32_t z = 0; z < field.nodes[2]; ++z)
      for (std::uint32_t y = 0; y < field.nodes[1]; ++y)
        for (std::uint32_t x = 0; x < field.nodes[0]; ++x)
          if (const float d = field.distance_m[field.index(x, y, z)]; std::abs(d) < width_m)
            voxels.setValue(nanovdb::Coord(static_cast<int>(x), static_cast<int>(y), static_cast<int>(z)), d);
    builder.sdfToLevelSet();
    handle_ = builder.getHandle(field.spacing_m);
    grid_ = handle_.template grid<Code>();
    near_ = NearBricks(field, kBrickCells, bricks_within(field, kBrickCells, band_m_));
    // Codes divide what a leaf holds, at most from -width to width.
    const double codes = std::is_same_v<Code, nanovdb::Fp8> ? 255 : 65535;
    const double step_m = std::is_same_v<Code, float> ? 0 : 2 * width_m / codes;
    stated_percent_ = 100 * (kHalfDiagonal * field.spacing_m + 0.5 * step_m) / model.r_max_m() + 1e-4;
  }

  void answer(const Cloud& cloud, const Placement& placement, Hits& hits) const override {
    hits.count = 0;
    const auto voxels = grid_->tree().getAccessor();
    const auto sampler = nanovdb::createSampler<1>(voxels);
    const std::size_t blocks = find_near_blocks(near_.view(), cloud, placement, blocks_);
    for (std::size_t k = 0; k < blocks; ++k) {
      const std::size_t begin = blocks_[k] * kBlock, end = std::min(begin + kBlock, cloud.count);
      for (std::size_t i = begin; i < end; ++i) {
        const Vec3f u = per_m_ * (placement.apply(cloud.points_m[i]) - origin_m_);
        const nanovdb::Vec3f at(u.x, u.y, u.z);
        const float distance_m = sampler(at);
        if (!(distance_m <= band_m_)) continue;
        const nanovdb::Vec3f gradient = sampler.gradient(at);
        hits.add(i, distance_m, normalized(Vec3f{gradient[0], gradient[1], gradient[2]}));
      }
    }
  }
  std::size_t bytes() const override { return sizeof(*this) + handle_.size() + near_.bytes(); }
  StatedError stated_error() const override { return {stated_percent_, false}; }

 private:
  nanovdb::GridHandle<nanovdb::HostBuffer> handle_;
  const nanovdb::NanoGrid<Code>* grid_{};
  NearBricks near_;
  Vec3f origin_m_;
  float per_m_{}, band_m_{};
  double stated_percent_{};
  mutable std::vector<std::uint32_t> blocks_;  // of the last frame, kept to spare the allocation
};

}  // namespace

std::unique_ptr<Peer> make_nanovdb(const Model& model, NanovdbCode code, unsigned resolution) {
  if (code == NanovdbCode::kFloat) return std::make_unique<NanovdbPeer<float>>(model, resolution);
  if (code == NanovdbCode::k16Bit) return std::make_unique<NanovdbPeer<nanovdb::Fp16>>(model, resolution);
  return std::make_unique<NanovdbPeer<nanovdb::Fp8>>(model, resolution);
}

}  // namespace sqmap::bench
