// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>

#include <fmt/format.h>

#include "peer.hpp"
#include "peer_hulls.hpp"
#include "peer_nanovdb.hpp"
#include "peer_openvdb.hpp"

namespace sqmap::bench {
namespace {

/// The mean over the parts at this level.
unsigned rows_of(const Asset& asset, unsigned level) {
  std::size_t rows = 0;
  for (const Part& part : asset.parts)
    rows += ((part.map.rows - 1) >> std::min(level, part.map.level_count - 1)) + 1;
  return static_cast<unsigned>(rows / std::max<std::size_t>(asset.parts.size(), 1));
}

Entrant sqmap_entrant(int layer, unsigned level, unsigned density = 0) {
  return {fmt::format("sqmap-layer{}{}", layer, level == 0 ? "" : fmt::format("-level{}", level)),
          fmt::format("sqmap-layer{}", layer),
          [=](const Model& model) { return make_sqmap(model, layer, level); }, density};
}

Entrant tapered_entrant(int layer) {
  const std::string id = fmt::format("sqmap-tapered-layer{}", layer);
  return {id, id, [=](const Model& model) { return make_sqmap(model.tapered(), layer, 0); }, 0};
}

Entrant grid_entrant(GridCode code, unsigned resolution) {
  const char* kind = code == GridCode::kFloatScalar || code == GridCode::kFloatSimd ? "float" : "int16";
  const char* how = code == GridCode::kFloatScalar       ? "scalar"
                    : code == GridCode::kInt16SimdCulled ? "simd-culled"
                                                         : "simd";
  return {fmt::format("grid-{}-{}-{}", kind, resolution, how), fmt::format("grid-{}-{}", kind, how),
          [=](const Model& model) { return make_grid(model, code, resolution); }, resolution};
}

Entrant bricks_entrant(unsigned resolution) {
  return {fmt::format("bricks-8bit-{}-simd", resolution), "bricks-8bit-simd",
          [=](const Model& model) { return make_bricks(model, resolution); }, resolution};
}

Entrant paper_entrant(unsigned rows, unsigned cols, unsigned subdivisions) {
  const int layer = subdivisions == 0 ? 2 : 3;
  return {fmt::format("paper-{}x{}-layer{}", rows, cols, layer), fmt::format("paper-layer{}", layer),
          [=](const Model& model) { return make_paper(model, rows, cols, subdivisions); }, rows};
}

Entrant adf_entrant(unsigned resolution, double bound_percent) {
  return {fmt::format("adf-float-{}-{}", resolution, bound_percent), fmt::format("adf-float-{}", resolution),
          [=](const Model& model) { return make_adf(model, resolution, bound_percent); }, resolution};
}

Entrant nanovdb_entrant(NanovdbCode code, unsigned resolution) {
  const char* kind = code == NanovdbCode::kFloat ? "float" : code == NanovdbCode::k16Bit ? "16bit" : "8bit";
  return {fmt::format("nanovdb-{}-{}", kind, resolution), fmt::format("nanovdb-{}", kind),
          [=](const Model& model) { return make_nanovdb(model, code, resolution); }, resolution};
}

Entrant openvdb_entrant(unsigned resolution) {
  return {fmt::format("openvdb-float-{}", resolution), "openvdb-float",
          [=](const Model& model) { return make_openvdb(model, resolution); }, resolution};
}

Entrant hulls_entrant(unsigned hulls) {
  return {fmt::format("bullet-hacd-{}", hulls), "bullet-hacd",
          [=](const Model& model) { return make_hulls(model, hulls); }, 0};
}

/// HACD takes up to 74 s for one of the default objects (results/bench.json).
bool has_hulls(const Model& model, bool smoke) {
  constexpr std::size_t kMostInSmoke = 2000;
  return !smoke || model.mesh.faces.size() <= kMostInSmoke;
}

const Entrant kEmbree{"embree-closest", "embree-closest", make_embree, 0};
const Entrant kCgal{"cgal-closest", "cgal-closest", make_cgal, 0};

}  // namespace

std::vector<Entrant> frame_entrants(const Model& model, bool smoke) {
  std::vector<Entrant> entrants{sqmap_entrant(1, 0), sqmap_entrant(2, 0), sqmap_entrant(3, 0),
                                tapered_entrant(2), tapered_entrant(3)};
  for (const unsigned resolution : {64U, 128U, 256U})
    for (const GridCode code :
         {GridCode::kInt16Simd, GridCode::kInt16SimdCulled, GridCode::kFloatSimd, GridCode::kFloatScalar})
      if (!smoke || resolution < 256) entrants.push_back(grid_entrant(code, resolution));
  for (const unsigned resolution : {64U, 128U}) entrants.push_back(bricks_entrant(resolution));
  entrants.push_back(nanovdb_entrant(NanovdbCode::kFloat, 128));
  entrants.push_back(nanovdb_entrant(NanovdbCode::k8Bit, 128));
  entrants.push_back(openvdb_entrant(128));
  entrants.push_back(adf_entrant(128, 0.1));
  if (!smoke) entrants.push_back(adf_entrant(256, 0.05));
  if (has_hulls(model, smoke)) entrants.push_back(hulls_entrant(16));
  entrants.push_back(paper_entrant(100, 200, 0));
  if (!smoke) entrants.push_back(paper_entrant(100, 200, 1));
  entrants.push_back(kEmbree);
  entrants.push_back(kCgal);
  return entrants;
}

/// The levels that tell more than nothing: answers with the sides swapped err by twice the mean distance of
/// the shell's points, which is 1.5 % of R_max.
std::uint32_t useful_levels(const Asset& asset) {
  constexpr double kMost_percent = 2.5;
  std::uint32_t levels = 1;
  for (const ErrorRow& row : asset.errors)
    if (row.layer > 1 && row.depth_mean_percent < kMost_percent) levels = std::max(levels, row.level + 1);
  return levels;
}

std::vector<Entrant> accuracy_entrants(const Model& model, bool smoke) {
  std::vector<Entrant> entrants;
  const std::uint32_t levels = useful_levels(model.asset);
  for (const int layer : {2, 3})
    for (unsigned level = 0; level < levels; ++level)
      entrants.push_back(sqmap_entrant(layer, level, rows_of(model.asset, level)));
  for (const int layer : {2, 3}) entrants.push_back(tapered_entrant(layer));
  for (const unsigned resolution : {16U, 32U, 64U, 128U, 256U}) {
    if (smoke && resolution > 128) continue;
    entrants.push_back(grid_entrant(GridCode::kFloatScalar, resolution));
    entrants.push_back(grid_entrant(GridCode::kFloatSimd, resolution));
    entrants.push_back(grid_entrant(GridCode::kInt16Simd, resolution));
    entrants.push_back(bricks_entrant(resolution));
    if (resolution < 64) continue;  // the levels above its leaves make a coarse tree larger than a dense grid
    entrants.push_back(nanovdb_entrant(NanovdbCode::kFloat, resolution));
    entrants.push_back(nanovdb_entrant(NanovdbCode::k16Bit, resolution));
    entrants.push_back(nanovdb_entrant(NanovdbCode::k8Bit, resolution));
    entrants.push_back(openvdb_entrant(resolution));
  }
  entrants.push_back(grid_entrant(GridCode::kInt16SimdCulled, 128));
  for (const double bound_percent : {0.8, 0.4, 0.2, 0.1, 0.05}) {
    if (smoke && bound_percent > 0.4) continue;
    entrants.push_back(adf_entrant(128, bound_percent));
    if (!smoke) entrants.push_back(adf_entrant(256, bound_percent));
  }
  for (const unsigned rows : {25U, 50U, 100U, 200U})
    if (!smoke || rows == 50 || rows == 100) entrants.push_back(paper_entrant(rows, 2 * rows, 0));
  for (const unsigned rows : {25U, 50U, 100U})
    if (!smoke || rows == 25) entrants.push_back(paper_entrant(rows, 2 * rows, 1));
  if (has_hulls(model, smoke)) entrants.push_back(hulls_entrant(16));
  entrants.push_back(kEmbree);
  entrants.push_back(kCgal);
  return entrants;
}

}  // namespace sqmap::bench
