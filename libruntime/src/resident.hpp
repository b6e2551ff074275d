// SPDX-License-Identifier: Apache-2.0
//
// An asset as it lies in memory for queries. Lengths in it are in units of unit_m, a power of two near the
// object's radius: products of four lengths then neither overflow nor vanish, and changing units rounds
// nothing. One allocation of
//
//     PartRecord[parts] | part 0: curves | bounds | starts | rows | texels | sheet blocks | sheets |
//     fan blocks | fans | part 1: ... | 4 bytes
//
//     curves   eta and omega as CurveTable, 16 bits a number: how far c falls and s rises over each cell
//              (their sums then err by half a unit, and differences of neighbours, which make the second
//              derivatives, hardly more), and how far the tangent has turned at each node: all steps are as
//              long as an arc
//     bounds   BoundCell[6 bound_cells^2], where the asset has bounds
//     starts   StartTable: where layer 3 may begin, 12 bits a box, least significant bit first
//     rows     MapRow as 24 bits a row of the map and one more for their end: the place of its first texel,
//              the column of that, and whether the others start inside. 32 bits where the map has more than
//              65536 texels
//     texels   `texel_bits` each, least significant bit first: the depth code and, where the part has a seam,
//              above it the bit that the node starts inside the mesh. Of each row, round the turn, without
//              all but the last of the longest run of nodes whose rays hit nothing and start alike; a row
//              that has no such two begins at column 0 and ends with that again. So the right neighbour of
//              a node that is held follows it, and that of another is not held, or is alike
//     sheets   second and later crossings: texel numbers, ascending, of 16 bits where the map has no more
//              than 65536 texels and of 32 in others, then codes of 16 bits
//     fans     vertex samples: cells, likewise, then places (row, col of 8 bits), then codes
//     blocks   one bit for each kBlock texels: a list holds one of them. Absent where the list is empty.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>

#include "sqmap/asset/asset.hpp"
#include "sqmap/asset/shape_table.hpp"

#include "fan_depth.hpp"
#include "part_bend.hpp"

namespace sqmap::runtime {

/// A sorted side list of a map.
struct SideList {
  std::uint32_t blocks_at{}, keys_at{}, values_at{};  ///< byte offsets; values are `value_words` x 16 bits
  std::uint32_t count{};
};

/// What one unit of the packed numbers of a curve stands for, and the steps of a tangent along c or s alone.
struct CurveUnits {
  float c{}, s{}, c_step{}, s_step{};
};

/// Planes that bound a superquadric besides its box. With w = |p| / the box's half extents, for every p in
/// it:
///
///     w_x + w_y <= across,    w_x + w_z <= up,    w_y + w_z <= up,    w_x + w_y + w_z <= diagonal
///
/// These are the values of its support function in these directions, of a rigid one the dual norms of (1, 1)
/// and (1, 1, 1); rounded up by far more than layer 1 errs.
struct Slabs {
  float across{}, up{}, diagonal{};
  /// How much a ball of radius 1 reaches beyond its centre in these sums: x + y, x + z, y + z, x + y + z.
  float across_reach{}, up_x_reach{}, up_y_reach{}, diagonal_reach{};
  /// inverse_extents: 1 / the box's half extents.
  static Slabs of(const Vec3f& inverse_extents, double e1, double e2, double taper = 0) noexcept;
};

/// Where a search for the nearest point of the represented surface may begin, besides the foot. The box of
/// the superquadric is cut into boxes, each of which names the cell of the map whose patch is nearest to its
/// middle, among those of a coarser grid, as row << col_bits | column of that grid. A point asks the eight
/// boxes around it and begins at the nearest place they name: near the medial axis one alone often names the
/// wrong side. Filled by fill_starts() from the maps; not part of the asset.
struct StartTable {
  static constexpr std::uint32_t kMostBoxes = 256;
  static constexpr int kAround = 8, kOwn = 8;
  static constexpr float kReachSteps = 1.0F;
  static constexpr std::uint32_t kBits = 12;     ///< of a name
  static constexpr std::uint32_t kNone = 0xFFF;  ///< the part has no patch

  std::uint32_t at{};         ///< byte offset
  std::uint16_t boxes[3]{};   ///< along x, y and z; x counts fastest
  std::uint8_t step_shift{};  ///< log2 of the coarser grid's spacing [cells]
  std::uint8_t col_bits{};

  static StartTable of(std::uint32_t rows, std::uint32_t cols, const Vec3f& half_extents) noexcept;
  /// Cells: places so near to one that is named are as good, for what a box knows.
  float reach() const noexcept { return kReachSteps * static_cast<float>(1U << step_shift); }
  /// From a point to one in the k-th of the boxes around it, in boxes; kOwn: in that it lies in.
  static constexpr float shift(int k, int axis) noexcept {
    return k == kOwn ? 0.0F : (k >> axis & 1) == 0 ? -0.5F : 0.5F;
  }
  std::size_t bytes() const noexcept { return (std::size_t{kBits} * boxes[0] * boxes[1] * boxes[2] + 7) / 8; }
  /// The place in the map that is named.
  float row(std::uint32_t name) const noexcept { return place(name >> col_bits); }
  float col(std::uint32_t name) const noexcept { return place(name & ((1U << col_bits) - 1U)); }
  /// Of a row or column of the coarser grid: that of the middle of its cell in the map.
  float place(std::uint32_t k) const noexcept {
    const std::uint32_t cell = (k << step_shift) + (1U << step_shift) / 2;
    return static_cast<float>(cell) + 0.5F;
  }
};

/// What is held of one row of a map.
struct MapRow {
  std::uint32_t at{};     ///< number of its first texel among those held
  std::uint32_t first{};  ///< column of that
  std::uint32_t count{};  ///< texels held; the others are misses
  bool inside{};          ///< whether those start inside
};

/// One part. Lengths in units of Resident::unit_m; byte offsets count from the start of the allocation.
struct PartRecord {
  Vec3f semi_axes;
  Vec3f inverse_extents;  ///< 1 / the half extents of its box, straight frame; 1 / semi_axes of a rigid one
  float power_1{}, power_2{}, power_ratio{};  ///< 2/e1, 2/e2, e2/e1
  float taper{};                              ///< K
  PartBend bend;
  Slabs slabs;
  Rotation<float> object_from_part;
  Vec3f translation;
  Vec3f sphere_centre;                     ///< object frame
  float sphere_radius{}, sphere_square{};  ///< the square is that of a slightly larger ball
  float depth_min{}, depth_step{};
  CurveUnits eta_units, omega_units;
  std::uint32_t vertex_count{};
  std::uint16_t rows{}, cols{};
  std::uint8_t level_count{}, code_bits{}, texel_bits{};
  std::uint8_t bound_cells{};  ///< a side of a face; 0: no bounds
  std::uint8_t row_shift{};    ///< rows begin at multiples of 2^row_shift texels
  bool wide_keys{};            ///< of the side lists: 32 bits, not 16; of the rows: 32 bits, not 24
  std::uint32_t curves_at{}, texels_at{};
  StartTable starts;
  SideList sheets, fans;

  Vec3f to_part(const Vec3f& p) const noexcept { return object_from_part.apply_inverse(p - translation); }
  Vec3f to_object(const Vec3f& p_part) const noexcept { return object_from_part.apply(p_part) + translation; }
  /// How far two places of the part may be from each other in the straight frame that are `reach` apart. The
  /// line between them comes nearer to the middle of the arc than its ends by at most what this takes off.
  float straight_reach(float reach) const noexcept {
    if (bend.is_none()) return reach;
    const float across = std::abs(bend.x) / inverse_extents.x + std::abs(bend.y) / inverse_extents.y;
    const float stretch = 1.0F - bend.curvature * across, half = 0.5F * bend.curvature * reach;
    const float square = stretch * stretch - half * half;
    return square > 0 ? reach / std::sqrt(square) : std::numeric_limits<float>::infinity();
  }
  std::uint32_t miss_code() const noexcept { return (1U << code_bits) - 1U; }
  float depth_of(std::uint32_t code) const noexcept {
    return depth_min + static_cast<float>(code) * depth_step;
  }
  std::uint32_t row_word_bytes() const noexcept { return wide_keys ? 4U : 3U; }
  /// Of four bytes that begin where the word of a row does: those that are the word's.
  std::uint32_t row_word_mask() const noexcept { return wide_keys ? 0xFFFFFFFFU : 0xFFFFFFU; }
  /// Bytes before texels_at where the rows begin.
  std::uint32_t row_bytes() const noexcept { return row_word_bytes() * (rows + 1U); }
  /// Of the word of a row: those of MapRow::at >> row_shift; above them that of `inside` and then `first`.
  std::uint32_t row_place_bits() const noexcept {
    return 8U * row_word_bytes() - 1U - static_cast<std::uint32_t>(std::bit_width(cols - 1U));
  }
  std::uint32_t stride_at(std::uint32_t level) const noexcept {
    return 1U << (level < level_count ? level : level_count - 1U);
  }
  /// Beyond this distance, about a cell of the map, a search may have ended on the wrong surface.
  float far_from(std::uint32_t stride) const noexcept {
    const float least_axis = std::min(std::min(semi_axes.x, semi_axes.y), semi_axes.z);
    return least_axis * (5 * static_cast<float>(stride) / static_cast<float>(rows));
  }
  /// Of outward_at(): so near the surface the direction to the nearest place of a map says little.
  float blur(std::uint32_t stride) const noexcept { return 0.05F * far_from(stride); }
  double texels_at_level(std::uint32_t level) const noexcept {
    const std::uint32_t stride = stride_at(level);
    const std::uint32_t row_steps = (rows - 1U) / stride, col_steps = cols / stride;
    return (static_cast<double>(row_steps) + 1) * static_cast<double>(col_steps);
  }
};

class Resident {
 public:
  static constexpr std::uint32_t kBlock = 8;         ///< texels a bit of a side list's blocks
  static constexpr std::uint32_t kCurveBytes = 388;  ///< of both curves of a part
  static constexpr std::uint32_t kBelowBytes =
      212;  ///< before them, of a tapered part: eta below the equator

  /// Precondition: a valid asset. fits() tells whether it could be held; if not, nothing is.
  explicit Resident(const Asset& asset);
  bool fits() const noexcept { return bytes_ != nullptr; }

  float unit_m() const noexcept { return unit_m_; }
  float units_per_m() const noexcept { return 1 / unit_m_; }
  /// The resident's own frame: units of unit_m from a place near the object. An object close to its own
  /// origin keeps that.
  const Vec3f& origin_m() const noexcept { return origin_m_; }
  Vec3f from_metres(const Vec3f& p_m) const noexcept { return units_per_m() * (p_m - origin_m_); }
  Vec3f to_metres(const Vec3f& p) const noexcept { return unit_m_ * p + origin_m_; }
  const Vec3f& sphere_centre() const noexcept { return sphere_centre_; }  ///< of the object, in units
  /// Of a ball that surely holds whatever layer 1 calls inside.
  float sphere_square() const noexcept { return sphere_square_; }
  float sphere_radius() const noexcept { return sphere_radius_; }
  std::uint32_t part_count() const noexcept { return part_count_; }
  const PartRecord& part(std::uint32_t index) const noexcept { return parts()[index]; }
  const PartRecord* parts() const noexcept { return reinterpret_cast<const PartRecord*>(bytes_.get()); }
  const std::uint8_t* bytes() const noexcept { return bytes_.get(); }
  std::size_t size() const noexcept { return size_; }

  /// Precondition: index < part.rows.
  MapRow row(const PartRecord& part, std::uint32_t index) const noexcept {
    const std::uint32_t size = part.row_word_bytes();
    const std::uint32_t at = part.texels_at - part.row_bytes() + size * index;
    const std::uint32_t word = load<std::uint32_t>(at) & part.row_word_mask();
    const auto next = load<std::uint32_t>(at + size);
    const std::uint32_t bits = part.row_place_bits(), mask = (1U << bits) - 1U;
    return {(word & mask) << part.row_shift, word >> (bits + 1U),
            ((next & mask) - (word & mask)) << part.row_shift, (word >> bits & 1U) != 0};
  }
  /// The depth code and start bit of the texel in a row of the part's map. Precondition: col < part.cols.
  std::uint32_t texel(const PartRecord& part, const MapRow& row, std::uint32_t col) const noexcept {
    const std::uint32_t place = col < row.first ? col + part.cols - row.first : col - row.first;
    if (place >= row.count) return part.miss_code() | (row.inside ? 1U << part.code_bits : 0U);
    const std::uint32_t bit = (row.at + place) * part.texel_bits;
    return (load<std::uint32_t>(part.texels_at + bit / 8) >> (bit % 8)) & ((1U << part.texel_bits) - 1U);
  }
  /// Precondition: cell < 6 part.bound_cells^2.
  BoundCell bound(const PartRecord& part, std::uint32_t cell) const noexcept {
    return load<BoundCell>(part.curves_at + kCurveBytes +
                           cell * static_cast<std::uint32_t>(sizeof(BoundCell)));
  }
  /// StartTable: what the k-th of the boxes around p, straight frame, names, or kNone. k = kOwn: the one p is
  /// in.
  std::uint32_t start(const PartRecord& part, const Vec3f& p, int k) const noexcept {
    const StartTable& starts = part.starts;
    std::uint32_t box = 0;
    for (int axis = 2; axis >= 0; --axis) {
      const auto count = static_cast<float>(starts.boxes[axis]);
      const float place =
          (p[axis] * part.inverse_extents[axis] + 1.0F) * (0.5F * count) + StartTable::shift(k, axis);
      box = box * starts.boxes[axis] + static_cast<std::uint32_t>(lesser(greater(place, 0.0F), count - 1.0F));
    }
    const std::uint32_t bit = StartTable::kBits * box;
    return load<std::uint32_t>(starts.at + bit / 8) >> (bit % 8) & StartTable::kNone;
  }
  /// Position of the first entry of a list with key >= `key`, or `count`, without a search where its block is
  /// empty.
  std::uint32_t find(const PartRecord& part, const SideList& list, std::uint32_t key) const noexcept;
  std::uint32_t key(const PartRecord& part, const SideList& list, std::uint32_t position) const noexcept {
    return part.wide_keys ? load<std::uint32_t>(list.keys_at + 4 * position)
                          : load<std::uint16_t>(list.keys_at + 2 * position);
  }
  std::uint16_t sheet_code(const PartRecord& part, std::uint32_t position) const noexcept {
    return load<std::uint16_t>(part.sheets.values_at + 2 * position);
  }
  /// Low byte: row, high byte: column, in 1/256 of a cell.
  std::uint16_t fan_place(const PartRecord& part, std::uint32_t position) const noexcept {
    return load<std::uint16_t>(part.fans.values_at + 4 * position);
  }
  std::uint16_t fan_code(const PartRecord& part, std::uint32_t position) const noexcept {
    return load<std::uint16_t>(part.fans.values_at + 4 * position + 2);
  }
  /// Position of the vertex sample in the cell of that lowest corner; fans.count where there is none.
  std::uint32_t find_fan(const PartRecord& part, std::uint32_t texel) const noexcept {
    const std::uint32_t position = find(part, part.fans, texel);
    return position < part.fans.count && key(part, part.fans, position) == texel ? position : part.fans.count;
  }
  /// fan_depth() of the vertex sample at a position of the list.
  float fan_depth_at(const PartRecord& part, std::uint32_t position, const float (&corner)[4], float s,
                     float t) const noexcept {
    const std::uint32_t where = fan_place(part, position);
    return fan_depth(corner, s, t, static_cast<float>(where & 255U) * (1 / 256.0F),
                     static_cast<float>(where >> 8U) * (1 / 256.0F), part.depth_of(fan_code(part, position)));
  }
  /// The part's curves, unpacked.
  void unpack(const PartRecord& part, ShapeTable<float>& table) const noexcept;

 private:
  /// Of one part whose texels are there.
  void fill_starts(const PartRecord& part);
  template <class T>
  T load(std::uint32_t at) const noexcept {
    T value;
    std::memcpy(&value, bytes_.get() + at, sizeof value);
    return value;
  }

  std::unique_ptr<std::uint8_t[]> bytes_;
  std::size_t size_{};
  std::uint32_t part_count_{};
  float unit_m_{1};
  Vec3f origin_m_;
  Vec3f sphere_centre_;
  float sphere_radius_{}, sphere_square_{};
};

/// The sphere of the asset, or a larger one where a superquadric reaches beyond it: FORMAT.md's rule 56 is
/// not checked by readers.
BoundingSphere sphere_around(const Asset& asset) noexcept;

/// The next float at or above a double.
float rounded_up(double value) noexcept;

}  // namespace sqmap::runtime
