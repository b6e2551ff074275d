// SPDX-License-Identifier: Apache-2.0
#include "resident.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>
#include <vector>

#include "sqmap/asset/miss_run.hpp"

namespace sqmap::runtime {

namespace {

constexpr int kCells = CurveTable<float>::kCells;
constexpr std::uint32_t kTail = 4;  // a texel is read as four bytes, wherever it begins

/// Bytes appended one object after another; its first pass only counts.
class Layout {
 public:
  explicit Layout(std::uint8_t* out) : out_(out) {}
  /// Offset of the next byte. Wraps only where size() shows that nothing will be kept.
  std::uint32_t at() const noexcept { return static_cast<std::uint32_t>(size_); }
  std::size_t size() const noexcept { return size_; }
  void put(const void* data, std::size_t size) {
    if (out_ != nullptr && size > 0) std::memcpy(out_ + size_, data, size);
    size_ += size;
  }
  template <class T>
  void put(T value) {
    put(&value, sizeof value);
  }

 private:
  std::uint8_t* out_;
  std::size_t size_ = 0;
};

/// Appends values of a fixed number of bits, least significant first.
class BitPacker {
 public:
  explicit BitPacker(Layout& out) : out_(out) {}
  void put(std::uint32_t value, unsigned bits) {
    pending_ |= std::uint64_t{value} << count_;
    for (count_ += bits; count_ >= 8; count_ -= 8, pending_ >>= 8)
      out_.put(static_cast<std::uint8_t>(pending_));
  }
  void flush() {
    if (count_ > 0) out_.put(static_cast<std::uint8_t>(pending_));
    count_ = 0;
  }

 private:
  Layout& out_;
  std::uint64_t pending_ = 0;
  unsigned count_ = 0;
};

constexpr std::size_t kNarrowTexels = 65536;  // more have wide keys

template <class Entry, class Key, class Value>
SideList put_list(Layout& out, std::vector<Entry> entries, std::size_t texels, Key key, Value value) {
  // The quick validation does not look at the entries; what names no texel can never be asked for.
  std::erase_if(entries, [&](const Entry& entry) { return key(entry) >= texels; });
  SideList list;
  list.count = static_cast<std::uint32_t>(entries.size());
  if (entries.empty()) return list;
  std::vector<std::uint8_t> blocks((texels + std::size_t{8} * Resident::kBlock - 1) /
                                   (std::size_t{8} * Resident::kBlock));
  for (const Entry& entry : entries) {
    const std::uint32_t block = key(entry) / Resident::kBlock;
    blocks[block / 8] = static_cast<std::uint8_t>(blocks[block / 8] | (1U << (block % 8)));
  }
  list.blocks_at = out.at();
  out.put(blocks.data(), blocks.size());
  list.keys_at = out.at();
  for (const Entry& entry : entries) {
    if (texels > kNarrowTexels) {
      out.put<std::uint32_t>(key(entry));
    } else {
      out.put(static_cast<std::uint16_t>(key(entry)));
    }
  }
  list.values_at = out.at();
  for (const Entry& entry : entries) value(entry);
  return list;
}

/// What is held of the rows of a map: MapRow with `at` unknown.
std::vector<MapRow> rows_of(const DistanceMap& map) {
  std::vector<MapRow> rows(map.rows);
  for (std::uint32_t row = 0; row < map.rows; ++row) {
    const MissRun run = longest_miss_run(map, row);
    rows[row] = run.count < 2 ? MapRow{0, 0, map.cols + 1, false}
                              : MapRow{0, (run.end + map.cols - 1) % map.cols, map.cols - run.count + 1,
                                       run.kind == RayKind::kInnerMiss};
  }
  return rows;
}

/// The rows of a map and its texels.
void put_texels(Layout& out, const DistanceMap& map, const std::vector<MapRow>& rows, PartRecord& record) {
  const std::uint32_t place_bits = record.row_place_bits();
  const auto units_of = [&](const MapRow& row) {
    return (row.count + (1U << record.row_shift) - 1) >> record.row_shift;
  };
  const auto units = [&] {
    std::uint64_t sum = 0;
    for (const MapRow& row : rows) sum += units_of(row);
    return sum;
  };
  while (units() >> place_bits != 0) ++record.row_shift;
  std::uint32_t at = 0;
  for (const MapRow& row : rows) {
    const std::uint32_t word = at | ((row.first << 1U) | (row.inside ? 1U : 0U)) << place_bits;
    out.put(&word, record.row_word_bytes());  // little-endian, as all that is held
    at += units_of(row);
  }
  out.put(&at, record.row_word_bytes());
  record.texels_at = out.at();
  BitPacker packer(out);
  for (std::uint32_t row = 0; row < map.rows; ++row) {
    for (std::uint32_t k = 0; k < units_of(rows[row]) << record.row_shift; ++k) {
      const std::uint32_t texel = row * map.cols + (rows[row].first + k) % map.cols;
      packer.put((map.code[texel] & map.miss_code()) | (map.starts_inside(texel) ? 1U << map.bits : 0U),
                 record.texel_bits);
    }
  }
  packer.flush();
}

constexpr double kMostPacked = 65535;

std::uint16_t packed(double value, double unit) {
  return static_cast<std::uint16_t>(std::clamp(std::round(value / unit), 0.0, kMostPacked));
}

float unit_for(double most) { return rounded_up(most / kMostPacked); }

struct PackedCurve {
  /// turn: tan(phi / 2), phi from 0 to pi/2 the angle from the direction of s to the tangent of the curve
  /// that is not tapered, in metres.
  std::uint16_t c_fall[kCells], s_rise[kCells], turn[kCells + 1];
};

static_assert(2 * sizeof(PackedCurve) == Resident::kCurveBytes);
static_assert(sizeof(BoundCell) == 6 && std::is_trivially_copyable_v<BoundCell>);
static_assert(SurfaceBounds::kMostCells <= 255);

/// Differences of `sums`, which ascend from 0, rounded so that their own sums stay within half a unit.
void pack_differences(const double* sums, double unit, std::uint16_t* out) {
  double packed_sum = 0;
  for (int k = 0; k < kCells; ++k) {
    out[k] = packed(sums[k + 1] - packed_sum, unit);
    packed_sum += out[k] * unit;
  }
}

/// A curve as the object holds it.
struct StoredCurve {
  PackedCurve packed;
  CurveUnits units;
};

StoredCurve pack(double alpha_m, double beta_m, double e, double taper = 0) {
  const auto curve = CurveTable<double>::of(alpha_m, beta_m, e, taper);
  double c_fallen[kCells + 1], c_fall = 0, s_rise = 0;
  for (int k = 0; k <= kCells; ++k) {
    c_fallen[kCells - k] = curve.c[k];  // from the end, where c is exactly 0
    if (k == 0) continue;
    c_fall = std::max(c_fall, curve.c[k - 1] - curve.c[k]);
    s_rise = std::max(s_rise, curve.s[k] - curve.s[k - 1]);
  }
  // The tangents of the tapered curve are all of one length.
  const double step_m = std::hypot(alpha_m * curve.tapered(taper).c_step[0], beta_m * curve.s_step[0]);
  const CurveUnits units{unit_for(c_fall), unit_for(s_rise), static_cast<float>(step_m / alpha_m),
                         static_cast<float>(step_m / beta_m)};
  PackedCurve result{};
  pack_differences(c_fallen, double{units.c}, result.c_fall);
  pack_differences(curve.s, double{units.s}, result.s_rise);
  for (int k = 0; k <= kCells; ++k) {
    const double phi = std::atan2(-alpha_m * curve.c_step[k], beta_m * curve.s_step[k]);
    result.turn[k] = packed(std::tan(phi / 2), 1 / kMostPacked);
  }
  return {result, units};
}

/// What is laid out of a part that takes most time to find.
struct Prepared {
  explicit Prepared(const Part& part)
      : eta(meridian(part.shape, part.shape.taper)),
        omega(pack(part.shape.semi_axes_m.x, part.shape.semi_axes_m.y, part.shape.e2)),
        rows(rows_of(part.map)) {
    if (part.shape.taper != 0) eta_below = meridian(part.shape, -part.shape.taper);
  }
  StoredCurve eta, omega, eta_below{};
  std::vector<MapRow> rows;

 private:
  static StoredCurve meridian(const Superquadric& shape, double taper) {
    return pack(std::sqrt(shape.semi_axes_m.x * shape.semi_axes_m.y), shape.semi_axes_m.z, shape.e1, taper);
  }
};
static_assert(sizeof(StoredCurve) == Resident::kBelowBytes);

/// taper: of the curve on whose arcs the nodes lie; `out` is without.
void unpack_curve(const PackedCurve& curve, const CurveUnits& units, float taper,
                  CurveTable<float>& out) noexcept {
  // Sums first, then loops that the compiler turns into vectors.
  std::int32_t c[kCells + 1], s[kCells + 1];
  c[kCells] = s[0] = 0;
  for (int k = 0; k < kCells; ++k) {
    c[kCells - 1 - k] = c[kCells - k] + curve.c_fall[k];
    s[k + 1] = s[k] + curve.s_rise[k];
  }
  for (int k = 0; k <= kCells; ++k) out.c[k] = units.c * static_cast<float>(c[k]);
  for (int k = 0; k <= kCells; ++k) out.s[k] = units.s * static_cast<float>(s[k]);
  constexpr float kTurnUnit = 1 / static_cast<float>(kMostPacked);
  for (int k = 0; k <= kCells; ++k) {
    const float half = kTurnUnit * static_cast<float>(std::int32_t{curve.turn[k]}), square = half * half;
    const float share = 1.0F / (1.0F + square);
    out.c_step[k] = -units.c_step * ((half + half) * share);
    out.s_step[k] = units.s_step * ((1.0F - square) * share);
  }
  if (taper == 0) return;
  // As yet the straight tangents have the length that the tapered ones shall have.
  const float c_share = 1.0F / units.c_step, s_share = 1.0F / units.s_step;
  for (int k = 0; k <= kCells; ++k) {
    const float c_way =
        c_share * (out.c_step[k] * (1.0F + taper * out.s[k]) + taper * (out.c[k] * out.s_step[k]));
    const float s_way = s_share * out.s_step[k];
    const float scale = 1.0F / std::sqrt(c_way * c_way + s_way * s_way);
    out.c_step[k] *= scale;
    out.s_step[k] *= scale;
  }
}

/// A little more than the squared radius: whatever rounding does to it and to layer 1, no point of the
/// superquadrics within lies beyond.
float square_of_ball(const BoundingSphere& sphere, double units_per_m) {
  const double radius = units_per_m * (sphere.radius_m * (1 + 1e-5) + 1e-6 * norm(sphere.centre_m));
  return rounded_up(radius * radius);
}

}  // namespace

BoundingSphere sphere_around(const Asset& asset) noexcept {
  BoundingSphere sphere = asset.sphere;
  for (const Part& part : asset.parts) {
    const BoundingSphere held = bounding_sphere(part.shape, part.object_from_part);
    sphere.radius_m = std::max(sphere.radius_m, norm(held.centre_m - sphere.centre_m) + held.radius_m);
  }
  return sphere;
}

namespace {

BoundingSphere seen_from(const Vec3f& origin_m, const BoundingSphere& sphere) {
  return {sphere.centre_m - cast<double>(origin_m), sphere.radius_m};
}

PartRecord put_part(Layout& out, const Part& part, const Prepared& prepared, const Vec3f& origin_m,
                    double units_per_m) {
  // Not the stored sphere: readers do not check that it holds the superquadric, and points would then be
  // dropped with one block and kept with another.
  const BoundingSphere sphere = seen_from(origin_m, bounding_sphere(part.shape, part.object_from_part));
  const DistanceMap& map = part.map;
  PartRecord record;
  record.semi_axes = cast<float>(units_per_m * part.shape.semi_axes_m);
  record.taper = static_cast<float>(part.shape.taper);
  record.bend = PartBend::of(part.shape, units_per_m);
  const Vec3f half_extents = cast<float>(units_per_m * half_extents_m(part.shape));
  record.inverse_extents = {1 / half_extents.x, 1 / half_extents.y, 1 / half_extents.z};
  record.power_1 = static_cast<float>(2 / part.shape.e1);
  record.power_2 = static_cast<float>(2 / part.shape.e2);
  record.power_ratio = static_cast<float>(part.shape.e2 / part.shape.e1);
  record.slabs = Slabs::of(record.inverse_extents, part.shape.e1, part.shape.e2, part.shape.taper);
  record.object_from_part = rotation<float>(part.object_from_part.orientation);
  record.translation =
      cast<float>(units_per_m * (part.object_from_part.translation_m - cast<double>(origin_m)));
  record.sphere_centre = cast<float>(units_per_m * sphere.centre_m);
  record.sphere_radius = rounded_up(units_per_m * sphere.radius_m);
  record.sphere_square = square_of_ball(sphere, units_per_m);
  record.depth_min = static_cast<float>(units_per_m * map.depth_min_m);
  record.depth_step = static_cast<float>(units_per_m * map.depth_step_m);
  record.rows = static_cast<std::uint16_t>(map.rows);
  record.cols = static_cast<std::uint16_t>(map.cols);
  record.wide_keys = map.code.size() > kNarrowTexels;
  record.vertex_count = part.vertex_count;
  record.level_count = static_cast<std::uint8_t>(map.level_count);
  record.code_bits = static_cast<std::uint8_t>(map.bits);
  const bool has_seam = std::any_of(map.start_inside.begin(), map.start_inside.end(),
                                    [](std::uint8_t bits) { return bits != 0; });
  record.texel_bits = static_cast<std::uint8_t>(map.bits + (has_seam ? 1 : 0));

  if (record.taper != 0) out.put(prepared.eta_below);
  record.curves_at = out.at();
  out.put(prepared.eta.packed);
  out.put(prepared.omega.packed);
  record.eta_units = prepared.eta.units;
  record.omega_units = prepared.omega.units;

  record.bound_cells = static_cast<std::uint8_t>(part.bounds.cells);
  out.put(part.bounds.cell.data(), part.bounds.cell.size() * sizeof(BoundCell));

  record.starts = StartTable::of(record.rows, record.cols, half_extents);
  record.starts.at = out.at();
  const std::vector<std::uint8_t> no_starts(record.starts.bytes(), 0xFF);
  out.put(no_starts.data(), no_starts.size());

  put_texels(out, map, prepared.rows, record);

  record.sheets = put_list(
      out, map.crossings, map.code.size(), [](const DistanceMap::Crossing& c) { return c.texel; },
      [&](const DistanceMap::Crossing& c) { out.put(c.code); });
  record.fans = put_list(
      out, map.vertex_samples, map.code.size(), [](const DistanceMap::VertexSample& s) { return s.cell; },
      [&](const DistanceMap::VertexSample& s) {
        out.put(s.row_256ths);
        out.put(s.col_256ths);
        out.put(s.code);
      });
  return record;
}

}  // namespace

Slabs Slabs::of(const Vec3f& inverse_extents, double e1, double e2, double taper) noexcept {
  constexpr double kSlack = 1 + 1e-4;
  // Dual to the norm with p = 2/e is that with q = 2/(2 - e): |(u, v)|_q, the larger of the two for e = 2.
  const auto dual = [](double u, double v, double e) {
    const double most = std::max(u, v), least = std::min(u, v), k = (2 - e) / 2;
    return k > 0 ? most * std::pow(1 + std::pow(least / most, 1 / k), k) : most;
  };
  double across = dual(1, 1, e2), up = dual(1, 1, e1), diagonal = dual(across, 1, e1);
  if (taper != 0) {
    const double widest = 1 + std::abs(taper);
    const auto along = [&](double wide, double high) {
      return largest_over_heights(taper, e1,
                                  [=](double width, double w) { return wide * width / widest + high * w; });
    };
    up = along(1, 1);
    diagonal = along(across, 1);
    across = along(across, 0);
  }
  const auto b = cast<double>(inverse_extents);
  const auto reach = [](const Vec3d& direction) { return rounded_up(kSlack * norm(direction)); };
  return {rounded_up(kSlack * across),
          rounded_up(kSlack * up),
          rounded_up(kSlack * diagonal),
          reach({b.x, b.y, 0}),
          reach({b.x, 0, b.z}),
          reach({0, b.y, b.z}),
          reach(b)};
}

float rounded_up(double value) noexcept {
  const float rounded = static_cast<float>(value);
  return rounded < value ? std::nextafter(rounded, std::numeric_limits<float>::infinity()) : rounded;
}

Resident::Resident(const Asset& asset) : part_count_(static_cast<std::uint32_t>(asset.parts.size())) {
  static_assert(std::is_trivially_copyable_v<PartRecord>);
  int exponent = 0;
  std::frexp(asset.sphere.radius_m, &exponent);
  unit_m_ = std::ldexp(1.0F, std::clamp(exponent, -126, 126));
  const double units_per_m = 1 / double{unit_m_};
  // From farther off the object's parts and the points asked for would lose digits to where it lies.
  constexpr double kFarRadii = 8;
  if (norm(asset.sphere.centre_m) > kFarRadii * asset.sphere.radius_m)
    origin_m_ = cast<float>(asset.sphere.centre_m);
  const BoundingSphere sphere = seen_from(origin_m_, sphere_around(asset));
  sphere_centre_ = cast<float>(units_per_m * sphere.centre_m);
  sphere_radius_ = rounded_up(units_per_m * sphere.radius_m);
  sphere_square_ = square_of_ball(sphere, units_per_m);
  const std::vector<PartRecord> blank(part_count_);
  std::vector<Prepared> prepared;
  for (const Part& part : asset.parts) prepared.emplace_back(part);
  const auto lay_out = [&](Layout& out) {
    out.put(blank.data(), blank.size() * sizeof(PartRecord));
    for (std::uint32_t k = 0; k < part_count_; ++k) {
      const PartRecord record = put_part(out, asset.parts[k], prepared[k], origin_m_, units_per_m);
      if (bytes_) std::memcpy(bytes_.get() + k * sizeof(PartRecord), &record, sizeof record);
    }
    out.put(std::uint32_t{0});
    static_assert(kTail == sizeof(std::uint32_t));
  };
  Layout count(nullptr);
  lay_out(count);
  if (count.size() > std::numeric_limits<std::uint32_t>::max()) return;
  size_ = count.size();
  bytes_ = std::make_unique<std::uint8_t[]>(size_);
  Layout out(bytes_.get());
  lay_out(out);
  for (std::uint32_t k = 0; k < part_count_; ++k) fill_starts(part(k));
}

std::uint32_t Resident::find(const PartRecord& part, const SideList& list,
                             std::uint32_t key_wanted) const noexcept {
  if (list.count == 0) return 0;
  const std::uint32_t block = key_wanted / kBlock;
  if (((bytes_[list.blocks_at + block / 8] >> (block % 8)) & 1U) == 0) return list.count;
  std::uint32_t low = 0, high = list.count;
  while (low < high) {
    const std::uint32_t middle = low + (high - low) / 2;
    if (key(part, list, middle) < key_wanted) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low;
}

void Resident::unpack(const PartRecord& part, ShapeTable<float>& table) const noexcept {
  PackedCurve curves[2];
  std::memcpy(curves, bytes_.get() + part.curves_at, sizeof curves);
  unpack_curve(curves[0], part.eta_units, part.taper, table.eta);
  unpack_curve(curves[1], part.omega_units, 0, table.omega);
  if (part.taper != 0) {
    StoredCurve below;
    std::memcpy(&below, bytes_.get() + part.curves_at - kBelowBytes, sizeof below);
    unpack_curve(below.packed, below.units, -part.taper, table.eta_below);
  }
  table.prepare(part.semi_axes, part.taper, part.rows, part.cols);
}

}  // namespace sqmap::runtime
