// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>

#include <fmt/format.h>

#include "peer.hpp"

namespace sqmap::bench {
namespace {

Entrant sqmap_entrant(int layer, unsigned level) {
  return {fmt::format("sqmap-layer{}{}", layer, level == 0 ? "" : fmt::format("-level{}", level)),
          fmt::format("sqmap-layer{}", layer),
          [=](const Model& model) { return make_sqmap(model, layer, level); }};
}

Entrant grid_entrant(GridCode code, unsigned resolution) {
  const char* kind = code == GridCode::kFloatScalar || code == GridCode::kFloatSimd ? "float" : "int16";
  const char* how = code == GridCode::kFloatScalar       ? "scalar"
                    : code == GridCode::kInt16SimdCulled ? "simd-culled"
                                                         : "simd";
  return {fmt::format("grid-{}-{}-{}", kind, resolution, how), fmt::format("grid-{}-{}", kind, how),
          [=](const Model& model) { return make_grid(model, code, resolution); }};
}

Entrant bricks_entrant(unsigned resolution) {
  return {fmt::format("bricks-8bit-{}-simd", resolution), "bricks-8bit-simd",
          [=](const Model& model) { return make_bricks(model, resolution); }};
}

const Entrant kEmbree{"embree-closest", "embree-closest", make_embree};
const Entrant kCgal{"cgal-closest", "cgal-closest", make_cgal};

}  // namespace

std::vector<Entrant> frame_entrants(bool smoke) {
  std::vector<Entrant> entrants{sqmap_entrant(2, 0), sqmap_entrant(3, 0)};
  for (const unsigned resolution : {64U, 128U, 256U})
    if (!smoke || resolution < 256) entrants.push_back(grid_entrant(GridCode::kInt16Simd, resolution));
  entrants.push_back(grid_entrant(GridCode::kInt16SimdCulled, 128));
  entrants.push_back(grid_entrant(GridCode::kFloatSimd, 128));
  entrants.push_back(grid_entrant(GridCode::kFloatScalar, 128));
  for (const unsigned resolution : {64U, 128U}) entrants.push_back(bricks_entrant(resolution));
  entrants.push_back(kEmbree);
  entrants.push_back(kCgal);
  return entrants;
}

std::vector<Entrant> accuracy_entrants(const Model& model, bool smoke) {
  std::vector<Entrant> entrants;
  std::uint32_t levels = 1;
  for (const Part& part : model.asset.parts) levels = std::max(levels, part.map.level_count);
  for (const int layer : {2, 3})
    for (unsigned level = 0; level < levels; ++level) entrants.push_back(sqmap_entrant(layer, level));
  for (const unsigned resolution : {16U, 32U, 64U, 128U, 256U}) {
    if (smoke && resolution > 128) continue;
    entrants.push_back(grid_entrant(GridCode::kFloatSimd, resolution));
    entrants.push_back(grid_entrant(GridCode::kInt16Simd, resolution));
    entrants.push_back(bricks_entrant(resolution));
  }
  entrants.push_back(grid_entrant(GridCode::kInt16SimdCulled, 128));
  entrants.push_back(grid_entrant(GridCode::kFloatScalar, 128));
  entrants.push_back(kEmbree);
  entrants.push_back(kCgal);
  return entrants;
}

}  // namespace sqmap::bench
