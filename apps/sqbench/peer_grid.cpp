// SPDX-License-Identifier: GPL-3.0-or-later
//
// Dense grids of signed distances with trilinear interpolation; the gradient is that of the same eight
// corners.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "field.hpp"
#include "grid_kernels.hpp"
#include "peer.hpp"
#include "trilinear.hpp"

namespace sqmap::bench {
namespace {

/// sqrt(3)/2: no point of a cell is farther from the mean of its corners, weighted as trilinear interpolation
/// does, and distances change by no more than that.
constexpr double kHalfDiagonal = 0.8660254037844387;

class DenseGrid : public FieldPeer {
 public:
  DenseGrid(const Model& model, GridCode code, unsigned resolution) : FieldPeer(resolution), code_(code) {
    const Field& field = model.field(resolution);
    view_.spacing_m = static_cast<float>(field.spacing_m);
    for (int axis = 0; axis < 3; ++axis) {
      view_.nodes[axis] = static_cast<float>(field.nodes[static_cast<std::size_t>(axis)]);
      view_.origin_m[axis] = static_cast<float>(field.origin_m[axis]);
    }
    view_.row = static_cast<std::int32_t>(field.nodes[0]);
    view_.slab = static_cast<std::int32_t>(field.nodes[0] * field.nodes[1]);
    view_.band_m = static_cast<float>(kBand * model.r_max_m());
    view_.far_error_m = 2 * view_.spacing_m;
    double stated_m = kHalfDiagonal * field.spacing_m;
    if (code == GridCode::kFloatScalar || code == GridCode::kFloatSimd) {
      distance_m_ = field.distance_m;
    } else {
      float most_m = 0;
      for (const float d : field.distance_m) most_m = std::max(most_m, std::abs(d));
      view_.step_m = most_m / 32767;
      codes_.reserve(field.distance_m.size() + 1);
      for (const float d : field.distance_m)
        codes_.push_back(static_cast<std::int16_t>(std::lround(d / view_.step_m)));
      codes_.push_back(0);  // the last pair of neighbours is read whole
      stated_m += 0.5 * view_.step_m;
    }
    view_.distance_m = distance_m_.data();
    view_.code = codes_.data();
    stated_percent_ = 100 * stated_m / model.r_max_m() + 1e-4;  // coordinates in float
  }

  void answer(const Cloud& cloud, const Placement& placement, Hits& hits) const override {
    switch (code_) {
      case GridCode::kFloatScalar:
        return answer_scalar(cloud, placement, hits);
      case GridCode::kFloatSimd:
        return answer_dense_float(view_, cloud, placement, hits);
      case GridCode::kInt16Simd:
        return answer_dense_int16(view_, cloud, placement, hits);
      case GridCode::kInt16SimdCulled:
        return answer_dense_int16_culled(view_, cloud, placement, hits);
    }
  }

  std::size_t bytes() const override {
    return sizeof(*this) + distance_m_.capacity() * sizeof(float) + codes_.capacity() * sizeof(std::int16_t);
  }
  StatedError stated_error() const override { return {stated_percent_, false}; }

 private:
  void answer_scalar(const Cloud& cloud, const Placement& placement, Hits& hits) const {
    hits.count = 0;
    const float per_m = 1 / view_.spacing_m;
    const float* field = distance_m_.data();
    for (std::size_t i = 0; i < cloud.count; ++i) {
      const Vec3f p_m = placement.apply(cloud.points_m[i]);
      const float ux = per_m * (p_m.x - view_.origin_m[0]), uy = per_m * (p_m.y - view_.origin_m[1]),
                  uz = per_m * (p_m.z - view_.origin_m[2]);
      if (!(ux >= 0 && ux < view_.nodes[0] - 1 && uy >= 0 && uy < view_.nodes[1] - 1 && uz >= 0 &&
            uz < view_.nodes[2] - 1))
        continue;
      const auto x = static_cast<std::int32_t>(ux), y = static_cast<std::int32_t>(uy),
                 z = static_cast<std::int32_t>(uz);
      const Vec3f at{ux - static_cast<float>(x), uy - static_cast<float>(y), uz - static_cast<float>(z)};
      const float* low = field + (x + std::ptrdiff_t{y} * view_.row + std::ptrdiff_t{z} * view_.slab);
      const float* high = low + view_.slab;
      const std::int32_t row = view_.row;
      const Trilinear sample =
          trilinear({low[0], low[1], low[row], low[row + 1], high[0], high[1], high[row], high[row + 1]}, at);
      if (sample.value <= view_.band_m) hits.add(i, sample.value, normalized(sample.gradient));
    }
  }

  GridCode code_;
  std::vector<float> distance_m_;
  std::vector<std::int16_t> codes_;
  DenseView view_{};
  double stated_percent_;
};

}  // namespace

std::unique_ptr<Peer> make_grid(const Model& model, GridCode code, unsigned resolution) {
  return std::make_unique<DenseGrid>(model, code, resolution);
}

}  // namespace sqmap::bench
