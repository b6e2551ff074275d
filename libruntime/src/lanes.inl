// SPDX-License-Identifier: Apache-2.0
//
// powers.hpp, shape_table.hpp and resident.hpp for a vector of points. Included by engine.cpp, once for each
// target. Only operations that IEEE 754 rounds exactly, in the order of the scalar code; no fused
// multiply-add.

const hn::ScalableTag<float> kD;
using D = decltype(kD);
const hn::RebindToSigned<D> kDI;
using DI = decltype(kDI);
const hn::RebindToUnsigned<D> kDU;
using DU = decltype(kDU);
using V = hn::Vec<D>;
using VI = hn::Vec<DI>;
using VU = hn::Vec<DU>;
using M = hn::Mask<D>;

HWY_INLINE std::uint32_t lane_count() { return static_cast<std::uint32_t>(hn::Lanes(kD)); }
HWY_INLINE V all(float value) { return hn::Set(kD, value); }
HWY_INLINE VI all_int(std::uint32_t value) { return hn::Set(kDI, static_cast<std::int32_t>(value)); }
HWY_INLINE V pick(M mask, V yes, V no) { return hn::IfThenElse(mask, yes, no); }
HWY_INLINE VI pick(M mask, VI yes, VI no) { return hn::IfThenElse(hn::RebindMask(kDI, mask), yes, no); }
HWY_INLINE M as_float(hn::Mask<DI> mask) { return hn::RebindMask(kD, mask); }
HWY_INLINE bool none(M mask) { return hn::AllFalse(kD, mask); }
HWY_INLINE V to_float(VI value) { return hn::ConvertTo(kD, value); }
HWY_INLINE VI to_int(V value) { return hn::ConvertTo(kDI, value); }
// lesser() and greater() of shape_table.hpp.
HWY_INLINE V least(V a, V b) { return hn::IfThenElse(hn::Lt(a, b), a, b); }
HWY_INLINE V most(V a, V b) { return hn::IfThenElse(hn::Gt(a, b), a, b); }
HWY_INLINE V limited(V value, V low, V high) { return least(most(value, low), high); }

struct V3 {
  V x, y, z;
};
HWY_INLINE V3 operator+(const V3& a, const V3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
HWY_INLINE V3 operator-(const V3& a, const V3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
HWY_INLINE V3 operator*(V s, const V3& a) { return {s * a.x, s * a.y, s * a.z}; }
HWY_INLINE V dot3(const V3& a, const V3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
HWY_INLINE V3 cross3(const V3& a, const V3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
HWY_INLINE V3 pick(M mask, const V3& yes, const V3& no) {
  return {pick(mask, yes.x, no.x), pick(mask, yes.y, no.y), pick(mask, yes.z, no.z)};
}
HWY_INLINE V3 load3(const float* x, const float* y, const float* z, std::uint32_t i) {
  return {hn::LoadU(kD, x + i), hn::LoadU(kD, y + i), hn::LoadU(kD, z + i)};
}
/// One bit a lane.
HWY_INLINE std::uint32_t bits_of(M mask) {
  HWY_ALIGN std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(kD, mask, bytes);
  std::uint32_t bits;
  std::memcpy(&bits, bytes, sizeof bits);
  return bits;
}
HWY_INLINE V3 all(const Vec3f& a) { return {all(a.x), all(a.y), all(a.z)}; }
/// 1/|a|, or 0 where |a| is zero.
HWY_INLINE V inverse_length(const V3& a) {
  const V length = hn::Sqrt(dot3(a, a));
  return hn::IfThenElseZero(hn::Gt(length, hn::Zero(kD)), all(1.0F) / length);
}
HWY_INLINE V3 normalized3(const V3& a) { return inverse_length(a) * a; }
/// direction_of() of chart.hpp.
HWY_INLINE V3 direction3(const V3& v) {
  const V longest = most(most(hn::Abs(v.x), hn::Abs(v.y)), hn::Abs(v.z));
  const V divisor = pick(hn::Gt(longest, hn::Zero(kD)), longest, all(1.0F));
  return normalized3({v.x / divisor, v.y / divisor, v.z / divisor});
}
/// outward_at() of chart.hpp.
HWY_INLINE V3 outward3(const V3& out, const V3& normal, float blur, M on_rim) {
  const V up = dot3(out, normal), square = dot3(out, out);
  const M back = hn::Lt(up, hn::Zero(kD));
  const M turns = hn::And(hn::Gt(up * up, all(0.25F) * square), hn::Gt(square, all(4.0F * (blur * blur))));
  const M holds = hn::Or(hn::AndNot(turns, back), hn::AndNot(back, on_rim));
  return pick(holds, normal, normalized3(out + all(blur) * normal));
}
HWY_INLINE V3 rotated(const Rotation<float>& r, const V3& v) {
  return {dot3(all(r.row[0]), v), dot3(all(r.row[1]), v), dot3(all(r.row[2]), v)};
}
HWY_INLINE V3 rotated_back(const Rotation<float>& r, const V3& v) {
  return v.x * all(r.row[0]) + v.y * all(r.row[1]) + v.z * all(r.row[2]);
}

SQMAP_KERNEL V log2_of(V x) {
  const VI bits = hn::BitCast(kDI, most(x, all(kLeastNormal)));
  const VI exponent = hn::ShiftRight<23>(bits - hn::Set(kDI, kHalfRootBits));
  const V m = hn::BitCast(kD, bits - hn::ShiftLeft<23>(exponent));
  const V s = (m - all(1.0F)) / (m + all(1.0F)), q = s * s;
  V series = all(kLog2Series[4]);
  for (int k = 3; k >= 0; --k) series = all(kLog2Series[k]) + q * series;
  return to_float(exponent) + s * series;
}
SQMAP_KERNEL V exp2_of(V x) {
  const V inner = limited(x, all(-126.0F), all(126.0F));
  const V shifted = inner + all(kRounder);
  const V f = inner - (shifted - all(kRounder));
  const VI n = hn::BitCast(kDI, shifted) - hn::BitCast(kDI, all(kRounder));
  V series = all(kExp2Series[7]);
  for (int k = 6; k >= 0; --k) series = all(kExp2Series[k]) + f * series;
  return hn::BitCast(kD, hn::BitCast(kDI, series) + hn::ShiftLeft<23>(n));
}
HWY_INLINE V power_of(V x, float k) { return exp2_of(all(k) * log2_of(x)); }

/// narrowing_at() of part_shape.hpp.
HWY_INLINE V narrowing_of(const PartRecord& part, V z) {
  return all(1.0F + std::abs(part.taper)) / (all(1.0F) + all(part.taper) * (z * all(part.inverse_extents.z)));
}
/// Four bytes from base + offset, wherever they begin.
HWY_INLINE VU gather_bytes(const std::uint8_t* base, VI offset) {
#if HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX2
  return hn::BitCast(kDU, hn::GatherOffset(kDI, reinterpret_cast<const std::int32_t*>(base), offset));
#else
  HWY_ALIGN std::int32_t offsets[kMostLanes];
  HWY_ALIGN std::uint32_t values[kMostLanes];
  hn::Store(offset, kDI, offsets);
  for (std::uint32_t lane = 0; lane < lane_count(); ++lane)
    std::memcpy(&values[lane], base + offsets[lane], 4);
  return hn::Load(kDU, values);
#endif
}

/// The cells of a curve, each as two cubics of the place t in it, c and s = k_0 + t (k_1 + t (k_2 + t k_3)).
/// A vector's lanes lie in as many cells. With AVX-512 each of the eight coefficients is picked from a table
/// that fits two registers; elsewhere each lane loads its cell, and the cells are transposed: gathers of the
/// coefficients would take several times as long.
struct CurveCells {
  static constexpr int kCells = CurveTable<float>::kCells, kCubics = 4;
  static constexpr bool kByCoefficient = HWY_TARGET == HWY_AVX3;

  alignas(64) float of[2 * kCubics * kCells];

  void set(const CurveTable<float>& curve) noexcept {
    for (int k = 0; k < kCells; ++k) {
      set(k, 0, curve.c[k], curve.c[k + 1], curve.c_step[k], curve.c_step[k + 1]);
      set(k, kCubics, curve.s[k], curve.s[k + 1], curve.s_step[k], curve.s_step[k + 1]);
    }
  }

 private:
  /// CurveTable::hermite.
  void set(int cell, int first, float a, float b, float a_step, float b_step) noexcept {
    const float rise = b - a;
    const float cubic = (a_step + b_step) - (rise + rise);
    const float values[kCubics] = {a, a_step, (rise - a_step) - cubic, cubic};
    for (int i = 0; i < kCubics; ++i)
      of[kByCoefficient ? (first + i) * kCells + cell : 2 * kCubics * cell + first + i] = values[i];
  }
};

/// What queries of one part read of its superquadric.
struct Tables {
  ShapeTable<float> shape;
  CurveCells eta, omega;
  CurveCells eta_below;  ///< of a tapered part only

  bool is_tapered() const noexcept { return shape.taper != 0; }
  /// Once `shape` is there.
  void set_cells() noexcept {
    eta.set(shape.eta);
    omega.set(shape.omega);
    if (is_tapered()) eta_below.set(shape.eta_below);
  }
};

/// The coefficients of c (first = 0) or s (4) of the lanes' cells.
HWY_INLINE void cubics_of(const CurveCells& cells, const std::int32_t* cell, VI k, int first, V (&cubic)[4]) {
#if HWY_TARGET == HWY_AVX3
  static_assert(CurveCells::kCells == 32);
  (void)cell;
  for (int i = 0; i < 4; ++i) {
    const float* table = cells.of + (first + i) * CurveCells::kCells;
    cubic[i] = V{_mm512_permutex2var_ps(_mm512_load_ps(table), k.raw, _mm512_load_ps(table + 16))};
  }
#elif HWY_TARGET == HWY_SCALAR
  (void)k;
  for (int i = 0; i < 4; ++i) cubic[i] = all(cells.of[std::ptrdiff_t{8} * cell[0] + first + i]);
#else
  (void)k;
  const auto row = [&](int lane) HWY_ATTR { return cells.of + std::ptrdiff_t{8} * cell[lane] + first; };
  V rows[4];  // of lanes i, i + 4, ..: a block of four each
  for (int i = 0; i < 4; ++i) {
#if HWY_TARGET == HWY_AVX2
    const hn::Half<D> half;
    rows[i] = hn::Combine(kD, hn::Load(half, row(i + 4)), hn::Load(half, row(i)));
#else
    rows[i] = hn::Load(kD, row(i));
#endif
  }
  const hn::Repartition<double, D> pairs;
  const auto low = hn::BitCast(pairs, hn::InterleaveLower(kD, rows[0], rows[1]));
  const auto low_next = hn::BitCast(pairs, hn::InterleaveLower(kD, rows[2], rows[3]));
  const auto high = hn::BitCast(pairs, hn::InterleaveUpper(kD, rows[0], rows[1]));
  const auto high_next = hn::BitCast(pairs, hn::InterleaveUpper(kD, rows[2], rows[3]));
  cubic[0] = hn::BitCast(kD, hn::InterleaveLower(pairs, low, low_next));
  cubic[1] = hn::BitCast(kD, hn::InterleaveUpper(pairs, low, low_next));
  cubic[2] = hn::BitCast(kD, hn::InterleaveLower(pairs, high, high_next));
  cubic[3] = hn::BitCast(kD, hn::InterleaveUpper(pairs, high, high_next));
#endif
}

struct Place {
  V c, s, c_1, s_1, c_2, s_2;
};
HWY_INLINE void hermite(const V (&cubic)[4], V t, V& value, V& first, V& second) {
  const V twice = cubic[2] + cubic[2];
  value = cubic[0] + t * (cubic[1] + t * (cubic[2] + t * cubic[3]));
  first = cubic[1] + t * (twice + t * (all(3.0F) * cubic[3]));
  second = twice + t * (all(6.0F) * cubic[3]);
}
SQMAP_KERNEL Place place_at(const CurveCells& curve, V position) {
  const VI k = hn::Min(hn::Max(to_int(position), hn::Zero(kDI)), hn::Set(kDI, CurveCells::kCells - 1));
  const V t = position - to_float(k);
  HWY_ALIGN std::int32_t cell[kMostLanes];
  if (!CurveCells::kByCoefficient) hn::Store(k, kDI, cell);
  V cubic[4];
  Place place;
  cubics_of(curve, cell, k, 0, cubic);
  hermite(cubic, t, place.c, place.c_1, place.c_2);
  cubics_of(curve, cell, k, CurveCells::kCubics, cubic);
  hermite(cubic, t, place.s, place.s_1, place.s_2);
  return place;
}
/// Of places `along` the meridian of a tapered part, the lanes `below` the equator.
HWY_NOINLINE void turn_below(const Tables& tables, V along, M below, Place& place) {
  const Place down = place_at(tables.eta_below, along);
  place = {pick(below, down.c, place.c),     pick(below, down.s, place.s),
           pick(below, down.c_1, place.c_1), pick(below, down.s_1, place.s_1),
           pick(below, down.c_2, place.c_2), pick(below, down.s_2, place.s_2)};
}
/// ShapeTable::eta_at of a tapered part.
HWY_NOINLINE void tapered_eta_at(const Tables& tables, V u, Place& place) {
  const M below = hn::Lt(u, hn::Zero(kD));
  place = place_at(tables.eta, hn::Abs(u));
  turn_below(tables, hn::Abs(u), below, place);
  const auto turned = [&](V value) HWY_ATTR { return pick(below, hn::Neg(value), value); };
  place = {place.c, turned(place.s), turned(place.c_1), place.s_1, place.c_2, turned(place.s_2)};
}
HWY_INLINE Place eta_at(const Tables& tables, V u) {
  Place place;
  if (tables.is_tapered()) [[unlikely]] {
    tapered_eta_at(tables, u, place);
  } else {
    place = place_at(tables.eta, u);
  }
  return place;
}
HWY_INLINE V3 gradient(const ShapeTable<float>& table, const Place& e, const Place& o) {
  const V w = o.c * o.s_1 - o.s * o.c_1;
  return {(e.s_1 * o.s_1) * all(table.inverse_axes.x), (e.s_1 * hn::Neg(o.c_1)) * all(table.inverse_axes.y),
          (hn::Neg(e.c_1) * w) * all(table.inverse_axes.z)};
}

struct VFoot {
  V row, col, depth, cell;
};

SQMAP_KERNEL void newton_step(const Tables& tables, const V3& m, V& u, V& v) {
  using Table = ShapeTable<float>;
  const Table& table = tables.shape;
  const Place e = eta_at(tables, u), o = place_at(tables.omega, v);
  const V ax = all(table.axes_m.x), ay = all(table.axes_m.y), az = all(table.axes_m.z);
  const V x = ax * o.c, y = ay * o.s, x_1 = ax * o.c_1, y_1 = ay * o.s_1, x_2 = ax * o.c_2, y_2 = ay * o.s_2;
  const V z_1 = az * e.s_1, z_2 = az * e.s_2;
  const V dx = x * e.c - m.x, dy = y * e.c - m.y, dz = az * e.s - m.z;
  const V along = dx * x + dy * y, along_1 = dx * x_1 + dy * y_1, along_2 = dx * x_2 + dy * y_2;
  const V g_u = e.c_1 * along + dz * z_1;
  const V g_v = e.c * along_1;
  const V t_uu = (e.c_1 * e.c_1) * (x * x + y * y) + z_1 * z_1;
  const V t_vv = (e.c * e.c) * (x_1 * x_1 + y_1 * y_1);
  const V floor = all(Table::kLeastCurvature);
  const V h_uu = most(t_uu + (e.c_2 * along + dz * z_2), floor * t_uu);
  const V raw_vv = most(t_vv + e.c * along_2, floor * t_vv);
  const V h_vv = pick(hn::Gt(raw_vv, hn::Zero(kD)), raw_vv, all(1.0F));
  const V h_uv = e.c_1 * (e.c * (x * x_1 + y * y_1) + along_1);
  const V product = h_uu * h_vv;
  const V determinant = product - h_uv * h_uv;
  const M regular = hn::Gt(determinant, all(Table::kLeastDeterminant) * product);
  const V coupling = hn::IfThenElseZero(regular, h_uv);
  const V inverse = all(1.0F) / pick(regular, determinant, product);
  const V du = (coupling * g_v - h_vv * g_u) * inverse;
  const V dv = (coupling * g_u - h_uu * g_v) * inverse;
  const V step = all(Table::kMostStep), back = all(-Table::kMostStep), end = all(float{Table::kCells});
  const V lowest = all(tables.is_tapered() ? -float{Table::kCells} : 0.0F);
  u = limited(u + limited(du, back, step), lowest, end);
  v = limited(v + limited(dv, back, step), hn::Zero(kD), end);
}

/// ShapeTable::choose_start.
SQMAP_KERNEL void choose_start(const ShapeTable<float>::Scan& scan, const V3& m, V& u, V& v, V& greatest) {
  using Table = ShapeTable<float>;
  V along[Table::kScan];
  for (int j = 0; j < Table::kScan; ++j) along[j] = all(scan.x_m[j]) * m.x + all(scan.y_m[j]) * m.y;
  for (int i = 0; i < Table::kScan; ++i) {
    V row_most = along[0] - all(scan.half_square_m2[i][0]);
    V row_v = all(static_cast<float>(Table::scan_node(0)));
    for (int j = 1; j < Table::kScan; ++j) {
      const V here = along[j] - all(scan.half_square_m2[i][j]);
      row_v = pick(hn::Gt(here, row_most), all(static_cast<float>(Table::scan_node(j))), row_v);
      row_most = most(here, row_most);
    }
    const V here = all(scan.c[i]) * row_most + (all(scan.z_m[i]) * m.z - all(scan.half_z_square_m2[i]));
    const M better = hn::Gt(here, greatest);
    u = pick(better, all(static_cast<float>(Table::scan_node(i))), u);
    v = pick(better, row_v, v);
    greatest = most(here, greatest);
  }
}

/// ShapeTable::foot.
SQMAP_KERNEL VFoot foot_of(const Tables& tables, const V3& point) {
  using Table = ShapeTable<float>;
  const Table& table = tables.shape;
  const bool tapered = tables.is_tapered();
  const V3 m{hn::Abs(point.x), hn::Abs(point.y), tapered ? point.z : hn::Abs(point.z)};
  V u = hn::Zero(kD), v = hn::Zero(kD), greatest = all(-std::numeric_limits<float>::infinity());
  choose_start(table.scan, m, u, v, greatest);
  if (tapered) [[unlikely]] {
    const V above = greatest;
    V u_below = u;
    choose_start(table.scan_below, {m.x, m.y, hn::Neg(m.z)}, u_below, v, greatest);
    u = pick(hn::Gt(greatest, above), hn::Neg(u_below), u);
  }
  for (int step = 0; step < Table::kNewtonSteps; ++step) newton_step(tables, m, u, v);

  const Place e = eta_at(tables, u), o = place_at(tables.omega, v);
  const V ax = all(table.axes_m.x), ay = all(table.axes_m.y), az = all(table.axes_m.z);
  const V x = ax * o.c, y = ay * o.s;
  const V dx = x * e.c - m.x, dy = y * e.c - m.y, dz = az * e.s - m.z;
  const V3 n = normalized3(gradient(table, e, o));
  VFoot foot;
  foot.depth = n.x * dx + n.y * dy + n.z * dz;
  const V x_1 = ax * o.c_1, y_1 = ay * o.s_1, z_1 = az * e.s_1;
  foot.cell = hn::Sqrt((e.c_1 * e.c_1) * (x * x + y * y) + z_1 * z_1) * all(table.eta_per_row) +
              (e.c * hn::Sqrt(x_1 * x_1 + y_1 * y_1)) * all(table.omega_per_col);
  const V du = u * all(table.row_per_eta), dv = v * all(table.col_per_omega);
  const V zero = hn::Zero(kD), half_rows = all(table.half_rows);
  foot.row = tapered ? half_rows + du : pick(hn::Lt(point.z, zero), half_rows - du, half_rows + du);
  const V turn = all(4.0F * table.quarter_cols), half_turn = all(2.0F * table.quarter_cols);
  const M left = hn::Lt(point.x, zero);
  const V before = pick(left, dv, half_turn - dv);
  const V after = pick(left, turn - dv, half_turn + dv);
  foot.col = pick(hn::Lt(point.y, zero), before, hn::IfThenElseZero(hn::Lt(after, turn), after));
  return foot;
}

struct Sample {
  V3 point, normal, point_row, point_col, normal_row, normal_col;
};

/// ShapeTable::sample.
SQMAP_KERNEL Sample sample_at(const Tables& tables, V row, V col) {
  const ShapeTable<float>& table = tables.shape;
  const V zero = hn::Zero(kD), one = all(1.0F), minus = all(-1.0F);
  const V up = row - all(table.half_rows);
  const M below = hn::Lt(up, zero);
  const V z_sign = pick(below, minus, one);
  const V from_equator = hn::Abs(up) * all(table.eta_per_row);
  Place e = place_at(tables.eta, from_equator);
  if (tables.is_tapered()) [[unlikely]]
    turn_below(tables, from_equator, below, e);

  const V turn = all(4.0F * table.quarter_cols), half_turn = all(2.0F * table.quarter_cols);
  const V raised = pick(hn::Lt(col, zero), col + turn, col);
  const V wrapped = pick(hn::Lt(raised, turn), raised, raised - turn);
  const V around = wrapped - half_turn;
  const V y_sign = pick(hn::Lt(around, zero), minus, one);
  const V along = hn::Abs(around);
  const M beyond = hn::Gt(along, all(table.quarter_cols));
  const V x_sign = pick(beyond, minus, one);
  const Place o = place_at(tables.omega, pick(beyond, half_turn - along, along) * all(table.omega_per_col));

  const V row_scale = z_sign * all(table.eta_per_row),
          col_scale = (x_sign * y_sign) * all(table.omega_per_col);
  const V ax = all(table.axes_m.x), ay = all(table.axes_m.y), az = all(table.axes_m.z);
  const V x = ax * o.c, y = ay * o.s;
  Sample out;
  out.point = {x_sign * (x * e.c), y_sign * (y * e.c), z_sign * (az * e.s)};
  out.point_row = {(x_sign * row_scale) * (x * e.c_1), (y_sign * row_scale) * (y * e.c_1),
                   (z_sign * row_scale) * (az * e.s_1)};
  out.point_col = {(x_sign * col_scale) * ((ax * o.c_1) * e.c), (y_sign * col_scale) * ((ay * o.s_1) * e.c),
                   zero};

  const V w = o.c * o.s_1 - o.s * o.c_1, w_1 = o.c * o.s_2 - o.s * o.c_2;
  const V bx = all(table.inverse_axes.x), by = all(table.inverse_axes.y), bz = all(table.inverse_axes.z);
  const V3 g = gradient(table, e, o);
  const V3 g_row{(e.s_2 * o.s_1) * bx, (e.s_2 * hn::Neg(o.c_1)) * by, (hn::Neg(e.c_2) * w) * bz};
  const V3 g_col{(e.s_1 * o.s_2) * bx, (e.s_1 * hn::Neg(o.c_2)) * by, (hn::Neg(e.c_1) * w_1) * bz};
  const V inverse = inverse_length(g);
  const V3 n = inverse * g;
  const V3 n_row = inverse * (g_row - dot3(n, g_row) * n);
  const V3 n_col = inverse * (g_col - dot3(n, g_col) * n);
  out.normal = {x_sign * n.x, y_sign * n.y, z_sign * n.z};
  out.normal_row = {(x_sign * row_scale) * n_row.x, (y_sign * row_scale) * n_row.y,
                    (z_sign * row_scale) * n_row.z};
  out.normal_col = {(x_sign * col_scale) * n_col.x, (y_sign * col_scale) * n_col.y,
                    (z_sign * col_scale) * n_col.z};
  return out;
}
