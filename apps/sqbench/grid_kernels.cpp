// SPDX-License-Identifier: GPL-3.0-or-later
#include "grid_kernels.hpp"

#include <array>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "grid_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace sqmap::bench::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
#include "packing.inl"

using DF = hn::ScalableTag<float>;
using DI = hn::RebindToSigned<DF>;
using VF = hn::Vec<DF>;
using VI = hn::Vec<DI>;
using MF = hn::Mask<DF>;
constexpr DF kFloats;
constexpr DI kInts;

struct Corners {
  VF v000, v100, v010, v110, v001, v101, v011, v111;
};

struct Sample {
  VF distance, x, y, z;  // gradient in units of the corners, a spacing
};

HWY_INLINE VF lerp(VF f, VF a, VF b) { return hn::MulAdd(f, hn::Sub(b, a), a); }

/// Value and gradient of the trilinear function of eight corners.
HWY_INLINE Sample trilinear(const Corners& c, VF fx, VF fy, VF fz) {
  const VF dx00 = hn::Sub(c.v100, c.v000), dx10 = hn::Sub(c.v110, c.v010);
  const VF dx01 = hn::Sub(c.v101, c.v001), dx11 = hn::Sub(c.v111, c.v011);
  const VF c00 = hn::MulAdd(fx, dx00, c.v000), c10 = hn::MulAdd(fx, dx10, c.v010);
  const VF c01 = hn::MulAdd(fx, dx01, c.v001), c11 = hn::MulAdd(fx, dx11, c.v011);
  const VF dy0 = hn::Sub(c10, c00), dy1 = hn::Sub(c11, c01);
  const VF low = hn::MulAdd(fy, dy0, c00), high = hn::MulAdd(fy, dy1, c01);
  const VF dz = hn::Sub(high, low);
  return {hn::MulAdd(fz, dz, low), lerp(fz, lerp(fy, dx00, dx10), lerp(fy, dx01, dx11)), lerp(fz, dy0, dy1),
          dz};
}

/// Points of the cloud in lattice coordinates.
class ToLattice {
 public:
  HWY_INLINE ToLattice(const Placement& placement, const float* origin_m, float spacing_m) {
    const float per_m = 1 / spacing_m;
    for (int i = 0; i < 3; ++i) {
      const Vec3f& row = placement.rotation.row[static_cast<std::size_t>(i)];
      x_[i] = per_m * row.x;
      y_[i] = per_m * row.y;
      z_[i] = per_m * row.z;
      shift_[i] = per_m * (placement.translation_m[i] - origin_m[i]);
    }
  }
  HWY_INLINE VF at(int axis, VF x, VF y, VF z) const {
    return hn::MulAdd(hn::Set(kFloats, x_[axis]), x,
                      hn::MulAdd(hn::Set(kFloats, y_[axis]), y,
                                 hn::MulAdd(hn::Set(kFloats, z_[axis]), z, hn::Set(kFloats, shift_[axis]))));
  }

 private:
  float x_[3], y_[3], z_[3], shift_[3];
};

/// The cell of a point and its place in it; lanes outside the lattice have cell 0.
struct Place {
  MF in;
  VI cell_x, cell_y, cell_z;
  VF fx, fy, fz;
};

HWY_INLINE Place place(VF ux, VF uy, VF uz, const float* cells) {
  const VF zero = hn::Zero(kFloats);
  Place p;
  p.in = hn::And(hn::And(hn::And(hn::Ge(ux, zero), hn::Lt(ux, hn::Set(kFloats, cells[0]))),
                         hn::And(hn::Ge(uy, zero), hn::Lt(uy, hn::Set(kFloats, cells[1])))),
                 hn::And(hn::Ge(uz, zero), hn::Lt(uz, hn::Set(kFloats, cells[2]))));
  ux = hn::IfThenElseZero(p.in, ux);
  uy = hn::IfThenElseZero(p.in, uy);
  uz = hn::IfThenElseZero(p.in, uz);
  p.cell_x = hn::ConvertTo(kInts, ux);
  p.cell_y = hn::ConvertTo(kInts, uy);
  p.cell_z = hn::ConvertTo(kInts, uz);
  p.fx = hn::Sub(ux, hn::ConvertTo(kFloats, p.cell_x));
  p.fy = hn::Sub(uy, hn::ConvertTo(kFloats, p.cell_y));
  p.fz = hn::Sub(uz, hn::ConvertTo(kFloats, p.cell_z));
  return p;
}

HWY_INLINE VI cell_index(const Place& p, std::int32_t row, std::int32_t slab) {
  return hn::Add(p.cell_x,
                 hn::Add(hn::Mul(p.cell_y, hn::Set(kInts, row)), hn::Mul(p.cell_z, hn::Set(kInts, slab))));
}

struct FloatCorners {
  const DenseView& grid;
  HWY_INLINE Corners operator()(const Place& p) const {
    const VI i = cell_index(p, grid.row, grid.slab);
    const float* base = grid.distance_m;
    const auto at = [&](std::int32_t offset) HWY_ATTR { return hn::GatherIndex(kFloats, base + offset, i); };
    return {at(0),
            at(1),
            at(grid.row),
            at(grid.row + 1),
            at(grid.slab),
            at(grid.slab + 1),
            at(grid.slab + grid.row),
            at(grid.slab + grid.row + 1)};
  }
};

/// Two neighbours along x share one 32-bit gather.
struct Int16Corners {
  const DenseView& grid;
  HWY_INLINE Corners operator()(const Place& p) const {
    const VI bytes = hn::ShiftLeft<1>(cell_index(p, grid.row, grid.slab));
    const auto pair = [&](std::int32_t offset, VF& low, VF& high) HWY_ATTR {
      const VI both = hn::GatherOffset(kInts, reinterpret_cast<const std::int32_t*>(grid.code + offset),
                                       bytes);  // x86 gathers need no alignment
      low = hn::ConvertTo(kFloats, hn::ShiftRight<16>(hn::ShiftLeft<16>(both)));
      high = hn::ConvertTo(kFloats, hn::ShiftRight<16>(both));
    };
    Corners c;
    pair(0, c.v000, c.v100);
    pair(grid.row, c.v010, c.v110);
    pair(grid.slab, c.v001, c.v101);
    pair(grid.slab + grid.row, c.v011, c.v111);
    return c;
  }
};

/// Appends the lanes in `near`: index, distance, unit normal and force.
HWY_INLINE void store(MF near, std::size_t first, VF distance_m, const Sample& s, Hits& hits) {
  const VF square =
      hn::Max(hn::MulAdd(s.x, s.x, hn::MulAdd(s.y, s.y, hn::Mul(s.z, s.z))), hn::Set(kFloats, 1e-30F));
  const VF guess = hn::ApproximateReciprocalSqrt(square);  // one Newton step makes it exact to float
  const VF half = hn::Mul(hn::Set(kFloats, 0.5F), square);
  const VF scale = hn::Mul(guess, hn::NegMulAdd(hn::Mul(half, guess), guess, hn::Set(kFloats, 1.5F)));
  const VF nx = hn::Mul(s.x, scale), ny = hn::Mul(s.y, scale), nz = hn::Mul(s.z, scale);
  const VF push =
      hn::Mul(hn::Set(kFloats, kStiffness_n_per_m), hn::Max(hn::Zero(kFloats), hn::Neg(distance_m)));
  const std::size_t at = hits.count;
  const VI index = hn::Iota(kInts, static_cast<std::int32_t>(first));
  const Packing packed(near);
  hits.count += packed.count();
  hn::StoreU(packed(index), kInts, reinterpret_cast<std::int32_t*>(hits.point.data() + at));
  hn::StoreU(packed(distance_m), kFloats, hits.distance_m.data() + at);
  hn::StoreU(packed(nx), kFloats, hits.normal_x.data() + at);
  hn::StoreU(packed(ny), kFloats, hits.normal_y.data() + at);
  hn::StoreU(packed(nz), kFloats, hits.normal_z.data() + at);
  hn::StoreU(packed(hn::Mul(push, nx)), kFloats, hits.force_x_n.data() + at);
  hn::StoreU(packed(hn::Mul(push, ny)), kFloats, hits.force_y_n.data() + at);
  hn::StoreU(packed(hn::Mul(push, nz)), kFloats, hits.force_z_n.data() + at);
}

/// The points [begin, end); `end` may exceed the cloud by its padding.
template <class Fetch>
HWY_INLINE void answer_range(const Fetch& fetch, const ToLattice& map, const DenseView& grid, VF unit_m,
                             const Cloud& cloud, std::size_t begin, std::size_t end, Hits& hits) {
  const float cells[3] = {grid.nodes[0] - 1, grid.nodes[1] - 1, grid.nodes[2] - 1};
  const VF band = hn::Set(kFloats, grid.band_m);
  for (std::size_t i = begin; i < end; i += hn::Lanes(kFloats)) {
    const VF x = hn::LoadU(kFloats, cloud.x_m.data() + i), y = hn::LoadU(kFloats, cloud.y_m.data() + i),
             z = hn::LoadU(kFloats, cloud.z_m.data() + i);
    const Place p = place(map.at(0, x, y, z), map.at(1, x, y, z), map.at(2, x, y, z), cells);
    if (hn::AllFalse(kFloats, p.in)) continue;
    const Sample s = trilinear(fetch(p), p.fx, p.fy, p.fz);
    const VF distance_m = hn::Mul(s.distance, unit_m);
    MF near = hn::And(p.in, hn::Le(distance_m, band));
    if (i + hn::Lanes(kFloats) > cloud.count) near = hn::And(near, hn::FirstN(kFloats, cloud.count - i));
    if (!hn::AllFalse(kFloats, near)) store(near, i, distance_m, s, hits);
  }
}

template <class Fetch>
HWY_INLINE void answer_all(const Fetch& fetch, const DenseView& grid, float unit_m, const Cloud& cloud,
                           const Placement& placement, Hits& hits) {
  hits.count = 0;
  const ToLattice map(placement, grid.origin_m, grid.spacing_m);
  answer_range(fetch, map, grid, hn::Set(kFloats, unit_m), cloud, 0, cloud.count, hits);
}

void dense_float(const DenseView& grid, const Cloud& cloud, const Placement& placement, Hits& hits) {
  answer_all(FloatCorners{grid}, grid, 1, cloud, placement, hits);
}

void dense_int16(const DenseView& grid, const Cloud& cloud, const Placement& placement, Hits& hits) {
  answer_all(Int16Corners{grid}, grid, grid.step_m, cloud, placement, hits);
}

void dense_int16_culled(const DenseView& grid, const Cloud& cloud, const Placement& placement, Hits& hits) {
  hits.count = 0;
  const ToLattice map(placement, grid.origin_m, grid.spacing_m);
  const Int16Corners fetch{grid};
  const VF unit_m = hn::Set(kFloats, grid.step_m), spacing_m = hn::Set(kFloats, grid.spacing_m);
  const float cells[3] = {grid.nodes[0] - 1, grid.nodes[1] - 1, grid.nodes[2] - 1};
  const auto inside = [&](VF u, int axis) HWY_ATTR {  // nearest coordinate of the lattice
    return hn::Min(hn::Max(u, hn::Zero(kFloats)), hn::Set(kFloats, cells[axis] * 0.999999F));
  };
  const VF least_m = hn::Set(kFloats, grid.band_m + grid.far_error_m);
  for (std::size_t b = 0; b < cloud.block_count; b += hn::Lanes(kFloats)) {
    const VF x = hn::LoadU(kFloats, cloud.block_x_m.data() + b),
             y = hn::LoadU(kFloats, cloud.block_y_m.data() + b),
             z = hn::LoadU(kFloats, cloud.block_z_m.data() + b);
    const VF radius_m = hn::LoadU(kFloats, cloud.block_radius_m.data() + b);
    const VF ux = map.at(0, x, y, z), uy = map.at(1, x, y, z), uz = map.at(2, x, y, z);
    const VF qx = inside(ux, 0), qy = inside(uy, 1), qz = inside(uz, 2);
    // Outside the lattice the distance to it counts: nothing out there is near.
    const VF ox = hn::Sub(ux, qx), oy = hn::Sub(uy, qy), oz = hn::Sub(uz, qz);
    const VF off_m = hn::Mul(spacing_m, hn::Sqrt(hn::MulAdd(ox, ox, hn::MulAdd(oy, oy, hn::Mul(oz, oz)))));
    MF keep = hn::Le(off_m, hn::MulAdd(spacing_m, hn::Set(kFloats, 1e-3F), radius_m));
    if (hn::AllFalse(kFloats, keep)) continue;
    const Place p = place(qx, qy, qz, cells);
    const VF distance_m = hn::Mul(unit_m, trilinear(fetch(p), p.fx, p.fy, p.fz).distance);
    keep = hn::And(keep, hn::Le(distance_m, hn::Add(least_m, hn::Add(radius_m, off_m))));
    if (b + hn::Lanes(kFloats) > cloud.block_count)
      keep = hn::And(keep, hn::FirstN(kFloats, cloud.block_count - b));
    HWY_ALIGN std::uint8_t bits[8] = {};
    hn::StoreMaskBits(kFloats, keep, bits);
    for (std::size_t lane = 0; lane < hn::Lanes(kFloats); ++lane)
      if (((bits[lane / 8] >> (lane % 8)) & 1) != 0)
        answer_range(fetch, map, grid, unit_m, cloud, (b + lane) * kBlock,
                     HWY_MIN((b + lane + 1) * kBlock, cloud.count), hits);
  }
}

std::size_t near_blocks(const NearView& view, const Cloud& cloud, const Placement& placement,
                        std::uint32_t* blocks) {
  const ToLattice map(placement, view.origin_m, view.brick_m);
  const VF brick_m = hn::Set(kFloats, view.brick_m), gap_m = hn::Mul(brick_m, hn::Set(kFloats, kGapStep));
  const auto inside = [&](VF u, int axis) HWY_ATTR {  // nearest coordinate of the lattice
    return hn::Min(hn::Max(u, hn::Zero(kFloats)), hn::Set(kFloats, view.bricks[axis] * 0.999999F));
  };
  std::size_t count = 0;
  for (std::size_t b = 0; b < cloud.block_count; b += hn::Lanes(kFloats)) {
    const VF x = hn::LoadU(kFloats, cloud.block_x_m.data() + b),
             y = hn::LoadU(kFloats, cloud.block_y_m.data() + b),
             z = hn::LoadU(kFloats, cloud.block_z_m.data() + b);
    // The rounding of coordinates is far below a thousandth of a brick.
    const VF radius_m =
        hn::MulAdd(brick_m, hn::Set(kFloats, 1e-3F), hn::LoadU(kFloats, cloud.block_radius_m.data() + b));
    const VF ux = map.at(0, x, y, z), uy = map.at(1, x, y, z), uz = map.at(2, x, y, z);
    const VF qx = inside(ux, 0), qy = inside(uy, 1), qz = inside(uz, 2);
    const VF ox = hn::Sub(ux, qx), oy = hn::Sub(uy, qy), oz = hn::Sub(uz, qz);
    const VF off_m = hn::Mul(brick_m, hn::Sqrt(hn::MulAdd(ox, ox, hn::MulAdd(oy, oy, hn::Mul(oz, oz)))));
    MF keep = hn::Le(off_m, radius_m);
    if (hn::AllFalse(kFloats, keep)) continue;
    const VI place = hn::Add(hn::ConvertTo(kInts, qx),
                             hn::Add(hn::Mul(hn::ConvertTo(kInts, qy), hn::Set(kInts, view.row)),
                                     hn::Mul(hn::ConvertTo(kInts, qz), hn::Set(kInts, view.slab))));
    const VI gap = hn::And(  // x86 gathers need no alignment
        hn::GatherOffset(kInts, reinterpret_cast<const std::int32_t*>(view.gap), place), hn::Set(kInts, 255));
    keep = hn::And(keep, hn::Le(hn::Mul(gap_m, hn::ConvertTo(kFloats, gap)), hn::Add(radius_m, off_m)));
    if (b + hn::Lanes(kFloats) > cloud.block_count)
      keep = hn::And(keep, hn::FirstN(kFloats, cloud.block_count - b));
    const Packing packed(keep);
    hn::StoreU(packed(hn::Iota(kInts, static_cast<std::int32_t>(b))), kInts,
               reinterpret_cast<std::int32_t*>(blocks + count));
    count += packed.count();
  }
  return count;
}

/// As answer_range, of bricks.
HWY_INLINE void answer_in_bricks(const BrickView& grid, const ToLattice& map, const Cloud& cloud,
                                 std::size_t begin, std::size_t end, Hits& hits) {
  const VF band = hn::Set(kFloats, grid.band_m);
  constexpr int kShift = 2;  // of a cell to its brick
  static_assert(1 << kShift == kBrickCells);
  const VI within = hn::Set(kInts, kBrickCells - 1);
  for (std::size_t i = begin; i < end; i += hn::Lanes(kFloats)) {
    const VF x = hn::LoadU(kFloats, cloud.x_m.data() + i), y = hn::LoadU(kFloats, cloud.y_m.data() + i),
             z = hn::LoadU(kFloats, cloud.z_m.data() + i);
    const Place p = place(map.at(0, x, y, z), map.at(1, x, y, z), map.at(2, x, y, z), grid.cells);
    if (hn::AllFalse(kFloats, p.in)) continue;
    const VI at = hn::Add(hn::ShiftRight<kShift>(p.cell_x),
                          hn::Add(hn::Mul(hn::ShiftRight<kShift>(p.cell_y), hn::Set(kInts, grid.row)),
                                  hn::Mul(hn::ShiftRight<kShift>(p.cell_z), hn::Set(kInts, grid.slab))));
    VI record = hn::GatherIndex(kInts, grid.brick, at);
    MF near = hn::And(p.in, hn::RebindMask(kFloats, hn::Gt(record, hn::Set(kInts, -1))));
    if (hn::AllFalse(kFloats, near)) continue;
    record = hn::Max(record, hn::Zero(kInts));
    const VI offset = hn::Add(
        record,
        hn::Add(hn::And(p.cell_x, within),
                hn::Add(hn::Mul(hn::And(p.cell_y, within), hn::Set(kInts, kBrickNodes)),
                        hn::Mul(hn::And(p.cell_z, within), hn::Set(kInts, kBrickNodes * kBrickNodes)))));
    const auto* header = reinterpret_cast<const float*>(grid.records);
    const VF least_m = hn::GatherOffset(kFloats, header, record),
             step_m = hn::GatherOffset(kFloats, header + 1, record);
    const auto pair = [&](int code, VF& low, VF& high) HWY_ATTR {
      const VI both = hn::GatherOffset(
          kInts, reinterpret_cast<const std::int32_t*>(grid.records + kBrickHeader + code), offset);
      const VI byte = hn::Set(kInts, 255);
      low = hn::ConvertTo(kFloats, hn::And(both, byte));
      high = hn::ConvertTo(kFloats, hn::And(hn::ShiftRight<8>(both), byte));
    };
    Corners c;
    pair(0, c.v000, c.v100);
    pair(kBrickNodes, c.v010, c.v110);
    pair(kBrickNodes * kBrickNodes, c.v001, c.v101);
    pair(kBrickNodes * kBrickNodes + kBrickNodes, c.v011, c.v111);
    const Sample s = trilinear(c, p.fx, p.fy, p.fz);
    const VF distance_m = hn::MulAdd(s.distance, step_m, least_m);
    near = hn::And(near, hn::Le(distance_m, band));
    if (i + hn::Lanes(kFloats) > cloud.count) near = hn::And(near, hn::FirstN(kFloats, cloud.count - i));
    if (!hn::AllFalse(kFloats, near)) store(near, i, distance_m, s, hits);
  }
}

void bricks(const BrickView& grid, const Cloud& cloud, const Placement& placement, std::uint32_t* blocks,
            Hits& hits) {
  hits.count = 0;
  const ToLattice map(placement, grid.origin_m, grid.spacing_m);
  const std::size_t count = near_blocks(grid.near, cloud, placement, blocks);
  for (std::size_t k = 0; k < count; ++k)
    answer_in_bricks(grid, map, cloud, blocks[k] * kBlock, HWY_MIN((blocks[k] + 1) * kBlock, cloud.count),
                     hits);
}

const char* target_name() { return hwy::TargetName(HWY_TARGET); }

}  // namespace
}  // namespace sqmap::bench::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sqmap::bench {

HWY_EXPORT(dense_float);
HWY_EXPORT(dense_int16);
HWY_EXPORT(dense_int16_culled);
HWY_EXPORT(near_blocks);
HWY_EXPORT(bricks);
HWY_EXPORT(target_name);

void answer_dense_float(const DenseView& grid, const Cloud& cloud, const Placement& placement, Hits& hits) {
  HWY_DYNAMIC_DISPATCH(dense_float)(grid, cloud, placement, hits);
}
void answer_dense_int16(const DenseView& grid, const Cloud& cloud, const Placement& placement, Hits& hits) {
  HWY_DYNAMIC_DISPATCH(dense_int16)(grid, cloud, placement, hits);
}
void answer_dense_int16_culled(const DenseView& grid, const Cloud& cloud, const Placement& placement,
                               Hits& hits) {
  HWY_DYNAMIC_DISPATCH(dense_int16_culled)(grid, cloud, placement, hits);
}
std::size_t find_near_blocks(const NearView& view, const Cloud& cloud, const Placement& placement,
                             std::vector<std::uint32_t>& blocks) {
  blocks.resize(cloud.block_count + kPadding);
  return HWY_DYNAMIC_DISPATCH(near_blocks)(view, cloud, placement, blocks.data());
}
void answer_bricks(const BrickView& grid, const Cloud& cloud, const Placement& placement,
                   std::vector<std::uint32_t>& blocks, Hits& hits) {
  blocks.resize(cloud.block_count + kPadding);
  HWY_DYNAMIC_DISPATCH(bricks)(grid, cloud, placement, blocks.data(), hits);
}
const char* instruction_set() { return HWY_DYNAMIC_DISPATCH(target_name)(); }

}  // namespace sqmap::bench
#endif  // HWY_ONCE
