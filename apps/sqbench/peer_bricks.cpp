// SPDX-License-Identifier: GPL-3.0-or-later
//
// Sparse grid: bricks of 4^3 cells where the surface is near, 8 bits a node between the least and the
// greatest distance of the brick. Nodes on the faces are stored with each brick, so that a query reads one
// brick only. Blocks of points that reach no brick are left out first.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

#include "field.hpp"
#include "grid_kernels.hpp"
#include "near_bricks.hpp"
#include "peer.hpp"

namespace sqmap::bench {
namespace {

constexpr double kHalfDiagonal = 0.8660254037844387;  // as for dense grids

class Bricks : public FieldPeer {
 public:
  Bricks(const Model& model, unsigned resolution) : FieldPeer(resolution) {
    const Field& field = model.field(resolution);
    const double band_m = kBand * model.r_max_m();
    std::uint32_t bricks[3];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      bricks[axis] = (field.nodes[axis] - 1 + kBrickCells - 1) / kBrickCells;
      view_.cells[axis] = static_cast<float>(field.nodes[axis] - 1);
      view_.origin_m[axis] = static_cast<float>(field.origin_m[static_cast<int>(axis)]);
    }
    view_.spacing_m = static_cast<float>(field.spacing_m);
    view_.band_m = static_cast<float>(band_m);
    view_.row = static_cast<std::int32_t>(bricks[0]);
    view_.slab = static_cast<std::int32_t>(bricks[0] * bricks[1]);
    float widest_m = 0;
    for (std::uint32_t z = 0; z < bricks[2]; ++z)
      for (std::uint32_t y = 0; y < bricks[1]; ++y)
        for (std::uint32_t x = 0; x < bricks[0]; ++x)
          places_.push_back(add_brick(field, x, y, z, band_m, widest_m));
    records_.resize(records_.size() + 4);  // pairs are read as words
    places_.shrink_to_fit();
    records_.shrink_to_fit();
    view_.brick = places_.data();
    view_.records = records_.data();
    std::vector<bool> is_near;
    for (const std::int32_t place : places_) is_near.push_back(place >= 0);
    near_ = NearBricks(field, kBrickCells, is_near);
    view_.near = near_.view();
    stated_percent_ = 100 * (kHalfDiagonal * field.spacing_m + 0.5 * widest_m / 255) / model.r_max_m() + 1e-4;
  }

  void answer(const Cloud& cloud, const Placement& placement, Hits& hits) const override {
    answer_bricks(view_, cloud, placement, blocks_, hits);
  }
  std::size_t bytes() const override {
    return sizeof(*this) + places_.capacity() * sizeof(std::int32_t) + records_.capacity() + near_.bytes();
  }
  StatedError stated_error() const override { return {stated_percent_, false}; }

 private:
  /// Byte offset of the new record, or -1 where nothing is asked for: everything farther in or out than the
  /// band.
  std::int32_t add_brick(const Field& field, std::uint32_t x, std::uint32_t y, std::uint32_t z, double band_m,
                         float& widest_m) {
    float d[kBrickNodes * kBrickNodes * kBrickNodes];
    float* next = d;
    for (std::uint32_t k = 0; k < kBrickNodes; ++k)
      for (std::uint32_t j = 0; j < kBrickNodes; ++j)
        for (std::uint32_t i = 0; i < kBrickNodes; ++i)
          *next++ = field.distance_m[field.index(std::min(x * kBrickCells + i, field.nodes[0] - 1),
                                                 std::min(y * kBrickCells + j, field.nodes[1] - 1),
                                                 std::min(z * kBrickCells + k, field.nodes[2] - 1))];
    const auto [least, most] = std::minmax_element(std::begin(d), std::end(d));
    if (*least > band_m || *most < -band_m) return -1;
    widest_m = std::max(widest_m, *most - *least);
    const float step_m = std::max((*most - *least) / 255, 1e-30F);
    const auto offset = records_.size();
    records_.resize(offset + kBrickRecord);
    std::memcpy(&records_[offset], least, sizeof(float));
    std::memcpy(&records_[offset + sizeof(float)], &step_m, sizeof(float));
    for (std::size_t i = 0; i < std::size(d); ++i)
      records_[offset + kBrickHeader + i] = static_cast<std::uint8_t>(std::lround((d[i] - *least) / step_m));
    return static_cast<std::int32_t>(offset);
  }

  std::vector<std::int32_t> places_;
  std::vector<std::uint8_t> records_;
  NearBricks near_;
  BrickView view_{};
  mutable std::vector<std::uint32_t> blocks_;  // of the last frame, kept to spare the allocation
  double stated_percent_;
};

}  // namespace

std::unique_ptr<Peer> make_bricks(const Model& model, unsigned resolution) {
  return std::make_unique<Bricks>(model, resolution);
}

}  // namespace sqmap::bench
