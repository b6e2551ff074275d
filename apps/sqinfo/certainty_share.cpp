// SPDX-License-Identifier: Apache-2.0
#include "certainty_share.hpp"

#include <cmath>

namespace sqmap::apps {
namespace {

constexpr int kPoints = 4096;
// Powers of the reciprocal of the root of x^4 = x + 1: multiples of them, modulo 1, fill a cube evenly.
constexpr Vec3d kStride{0.8191725133961645, 0.6710436067037893, 0.5497004779019703};

double spread(int k, double stride) { return 2 * (k * stride - std::floor(k * stride)) - 1; }

}  // namespace

std::optional<CertaintyShare> certainty_share(const Asset& asset, const runtime::Object& object) {
  CertaintyShare share;
  share.tolerance_m = object.certainty_tolerance_m();
  if (std::isnan(share.tolerance_m)) return {};
  double volume = 0, outside = 0, inside = 0;
  for (const Part& part : asset.parts) {
    share.bytes += part.bounds.cell.size() * sizeof(BoundCell);
    const Vec3d a = half_extents_m(part.shape);
    const double weight = a.x * a.y * a.z;
    const Rotation<double> turn = rotation(part.object_from_part.orientation);
    for (int k = 0; k < kPoints; ++k) {
      const Vec3d p = bent(part.shape.bend, Vec3d{a.x * spread(k, kStride.x), a.y * spread(k, kStride.y),
                                                  a.z * spread(k, kStride.z)});
      if (!(inside_outside_radial(part.shape, p) <= 1)) continue;
      const auto told = object.certainty(cast<float>(turn.apply(p) + part.object_from_part.translation_m));
      volume += weight;
      outside += told == runtime::Certainty::kOutside ? weight : 0;
      inside += told == runtime::Certainty::kInside ? weight : 0;
    }
  }
  share.outside_percent = 100 * outside / volume;
  share.inside_percent = 100 * inside / volume;
  return share;
}

}  // namespace sqmap::apps
