// SPDX-License-Identifier: Apache-2.0
#include "tables.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <span>
#include <utility>

#include "sqmap/asset/version.hpp"

#include "map_codec.hpp"

namespace sqmap::io {
namespace {

static_assert(std::endian::native == std::endian::little, "arrays are copied as the file stores them");

constexpr const char* kRebake = "bake the asset again";

template <class T>
void put(Bytes& bytes, T value) {
  const std::size_t end = bytes.size();
  bytes.resize(end + sizeof(T));
  std::memcpy(bytes.data() + end, &value, sizeof(T));
}

template <class T>
void put(Bytes& bytes, const Vec3<T>& v) {
  put(bytes, v.x);
  put(bytes, v.y);
  put(bytes, v.z);
}

void put(Bytes& bytes, const BoundingSphere& sphere) {
  put(bytes, sphere.centre_m);
  put(bytes, sphere.radius_m);
}

template <class T>
T get(const Bytes& bytes, std::size_t index) {
  T value;
  std::memcpy(&value, bytes.data() + index * sizeof(T), sizeof(T));
  return value;
}

Vec3d get_vec3(const Bytes& bytes, std::size_t index) {
  return {get<double>(bytes, index), get<double>(bytes, index + 1), get<double>(bytes, index + 2)};
}

BoundingSphere get_sphere(const Bytes& bytes, std::size_t index) {
  return {get_vec3(bytes, index), get<double>(bytes, index + 3)};
}

// The counts of a mesh record, in the order of kNumbers. One list for both directions.
template <class Record>
auto mesh_counts(Record& mesh) {
  return std::array{
      &mesh.source_vertices, &mesh.source_faces,    &mesh.vertices,         &mesh.faces,
      &mesh.components,      &mesh.welded_vertices, &mesh.degenerate_faces, &mesh.duplicate_faces,
      &mesh.flipped_faces,   &mesh.filled_holes,    &mesh.boundary_edges,   &mesh.non_manifold_edges};
}

// The texts that a provenance holds, in the order of kTexts.
template <class Record>
auto provenance_texts(Record& provenance) {
  return std::array{std::pair{kGenerator, &provenance.generator},
                    std::pair{kGeneratorVersion, &provenance.generator_version},
                    std::pair{kSourceName, &provenance.source_name},
                    std::pair{kSourceHash, &provenance.source_hash},
                    std::pair{kOptions, &provenance.options_json},
                    std::pair{kUpAxis, &provenance.up_axis}};
}

// Texts of which this version knows one value only.
constexpr std::array kFixedTexts{std::pair{kFormat, "sqmap"}, std::pair{kLengthUnit, "m"},
                                 std::pair{kHandedness, "right"}};

void put_map(Document& document, const DistanceMap& map) {
  auto& tables = document.tables;
  Bytes& layout = tables[kLayout];
  for (const std::uint32_t value : {map.rows, map.cols, map.level_count, map.bits}) put(layout, value);
  put(layout, static_cast<std::uint32_t>(map.start_inside.empty() ? 0 : 1));
  put(layout, static_cast<std::uint32_t>(map.crossings.size()));
  put(layout, static_cast<std::uint32_t>(map.vertex_samples.size()));
  put(tables[kDepth], map.depth_min_m);
  put(tables[kDepth], map.depth_step_m);

  std::vector<std::uint16_t> folded(map.code.size());
  fold_codes(map.code, map.cols, map.bits, folded);
  for (const std::uint16_t value : folded) put(tables[kCode], value);
  tables[kStartInside].insert(tables[kStartInside].end(), map.start_inside.begin(), map.start_inside.end());

  std::uint32_t previous = 0;
  for (const DistanceMap::Crossing& crossing : map.crossings) {
    put(tables[kCrossingTexel], crossing.texel - previous);
    put(tables[kCrossingCode], crossing.code);
    previous = crossing.texel;
  }
  previous = 0;
  for (const DistanceMap::VertexSample& sample : map.vertex_samples) {
    put(tables[kVertexCell], sample.cell - previous);
    put(tables[kVertexPosition], sample.row_256ths);
    put(tables[kVertexPosition], sample.col_256ths);
    put(tables[kVertexCode], sample.code);
    previous = sample.cell;
  }
}

bool has_bounds(const Asset& asset) {
  return std::any_of(asset.parts.begin(), asset.parts.end(),
                     [](const Part& part) { return part.bounds.cells > 0; });
}

bool has_tapers(const Asset& asset) {
  return std::any_of(asset.parts.begin(), asset.parts.end(),
                     [](const Part& part) { return part.shape.taper != 0; });
}

bool has_bends(const Asset& asset) {
  return std::any_of(asset.parts.begin(), asset.parts.end(),
                     [](const Part& part) { return !part.shape.bend.is_none(); });
}

void put_bounds(Document& document, const SurfaceBounds& bounds) {
  put(document.tables[kBoundCells], bounds.cells);
  put(document.tables[kBoundTolerance], bounds.tolerance_m);
  for (const BoundCell& cell : bounds.cell)
    for (const std::uint8_t value :
         {cell.tilt_u, cell.tilt_v, cell.outer, cell.upper, cell.lower, cell.sides})
      put(document.tables[kBounds], value);
}

std::size_t row_count(const Document& document, TableId id) {
  return document.tables[id].size() / (element_bytes(kTables[id].element) * kTables[id].columns);
}

Error damaged(std::string finding) { return {Status::kInvalidAsset, std::move(finding), kRebake}; }

Outcome require_rows(const Document& document, TableId id, std::uint64_t required, const char* source) {
  const std::size_t found = row_count(document, id);
  if (found == required) return Done{};
  return damaged("dataset \"" + path_of(kTables[id]) + "\": " + std::to_string(found) + " rows, " + source +
                 " requires " + std::to_string(required));
}

// One row of /maps/layout.
struct Layout {
  std::uint32_t rows, cols, level_count, bits, has_start_inside, crossing_count, vertex_count;
  std::uint64_t texels() const { return std::uint64_t{rows} * cols; }
  std::uint64_t start_bytes() const { return has_start_inside != 0 ? (texels() + 7) / 8 : 0; }
};

Layout layout_of(const Document& document, std::size_t part) {
  const auto value = [&](std::size_t column) {
    return get<std::uint32_t>(document.tables[kLayout], part * kTables[kLayout].columns + column);
  };
  return {value(0), value(1), value(2), value(3), value(4), value(5), value(6)};
}

/// Rows of /maps/bounds that a part has; 2^32 squared would wrap.
std::uint64_t bound_rows(std::uint32_t cells) {
  const std::uint64_t side = cells;
  return side > 0xFFFF ? std::uint64_t{0xFFFFFFFF} : 6 * side * side;
}

// The part tables agree on the number of parts, and the maps add up to the map tables.
Outcome check_shapes(const Document& document) {
  const std::size_t part_count = row_count(document, kSemiAxes);
  if (part_count > kMaxParts)
    return damaged("dataset \"/parts/semi_axes_m\": " + std::to_string(part_count) + " parts, at most " +
                   std::to_string(kMaxParts) + " are allowed");
  for (std::size_t id = kSemiAxes; id <= kDepth; ++id)
    if (Outcome same = require_rows(document, static_cast<TableId>(id), part_count, "/parts/semi_axes_m");
        !same)
      return same;

  std::uint64_t texels = 0, start_bytes = 0, crossings = 0, samples = 0;
  for (std::size_t part = 0; part < part_count; ++part) {
    const Layout layout = layout_of(document, part);
    if (layout.bits < 1 || layout.bits > 16 || layout.has_start_inside > 1 || layout.rows > 0xFFFF ||
        layout.cols > 0xFFFF)
      return damaged("dataset \"/maps/layout\": row " + std::to_string(part) + " asks for " +
                     std::to_string(layout.rows) + " x " + std::to_string(layout.cols) + " texels of " +
                     std::to_string(layout.bits) + " bits, start_inside = " +
                     std::to_string(layout.has_start_inside) + "; that is outside of what the format has");
    texels += layout.texels();
    start_bytes += layout.start_bytes();
    crossings += layout.crossing_count;
    samples += layout.vertex_count;
  }
  const bool bounded = row_count(document, kBoundCells) > 0;
  std::uint64_t bound_cells = 0;
  for (std::size_t part = 0; bounded && part < std::min(part_count, row_count(document, kBoundCells)); ++part)
    bound_cells += bound_rows(get<std::uint32_t>(document.tables[kBoundCells], part));
  const std::size_t bounded_parts = bounded ? part_count : 0;
  for (const TableId id : {kBoundCells, kBoundTolerance})
    if (Outcome same = require_rows(document, id, bounded_parts, "/maps/bound_cells"); !same) return same;
  if (Outcome same = require_rows(document, kBounds, bound_cells, "/maps/bound_cells"); !same) return same;
  for (const TableId id : {kTaper, kBend}) {
    const std::size_t rows = row_count(document, id) > 0 ? part_count : 0;
    if (Outcome same = require_rows(document, id, rows, "/parts/semi_axes_m"); !same) return same;
  }

  const std::pair<TableId, std::uint64_t> required[] = {{kCode, texels},
                                                        {kStartInside, start_bytes},
                                                        {kCrossingTexel, crossings},
                                                        {kCrossingCode, crossings},
                                                        {kVertexCell, samples},
                                                        {kVertexPosition, samples},
                                                        {kVertexCode, samples}};
  for (const auto& [id, rows] : required)
    if (Outcome same = require_rows(document, id, rows, "/maps/layout"); !same) return same;
  return Done{};
}

// Where the next part's share of each concatenated map table begins.
struct Cursor {
  std::size_t texel{}, start_byte{}, crossing{}, sample{}, bound{};
};

Outcome get_map(const Document& document, std::size_t part, Cursor& at, DistanceMap& map) {
  const auto& tables = document.tables;
  const Layout layout = layout_of(document, part);
  map.rows = layout.rows;
  map.cols = layout.cols;
  map.level_count = layout.level_count;
  map.bits = layout.bits;
  map.depth_min_m = get<double>(tables[kDepth], 2 * part);
  map.depth_step_m = get<double>(tables[kDepth], 2 * part + 1);

  const std::size_t texels = layout.texels();
  std::vector<std::uint16_t> folded(texels);
  if (texels > 0) std::memcpy(folded.data(), tables[kCode].data() + 2 * at.texel, 2 * texels);
  map.code.resize(texels);
  if (!unfold_codes(folded, map.cols, map.bits, map.code))
    return damaged("dataset \"/maps/code\": part " + std::to_string(part) + " has a value of more than " +
                   std::to_string(map.bits) + " bits");
  const std::uint8_t* start = tables[kStartInside].data() + at.start_byte;
  map.start_inside.assign(start, start + layout.start_bytes());

  std::uint32_t texel = 0;
  map.crossings.reserve(layout.crossing_count);
  for (std::size_t i = at.crossing; i < at.crossing + layout.crossing_count; ++i) {
    texel += get<std::uint32_t>(tables[kCrossingTexel], i);  // wraps on damage; validate() then finds it
    map.crossings.push_back({texel, get<std::uint16_t>(tables[kCrossingCode], i)});
  }
  std::uint32_t cell = 0;
  map.vertex_samples.reserve(layout.vertex_count);
  for (std::size_t i = at.sample; i < at.sample + layout.vertex_count; ++i) {
    cell += get<std::uint32_t>(tables[kVertexCell], i);
    map.vertex_samples.push_back({cell, tables[kVertexPosition][2 * i], tables[kVertexPosition][2 * i + 1],
                                  get<std::uint16_t>(tables[kVertexCode], i)});
  }
  at.texel += texels;
  at.start_byte += layout.start_bytes();
  at.crossing += layout.crossing_count;
  at.sample += layout.vertex_count;
  return Done{};
}

SurfaceBounds get_bounds(const Document& document, std::size_t part, Cursor& at) {
  SurfaceBounds bounds;
  if (document.tables[kBoundCells].empty()) return bounds;
  bounds.cells = get<std::uint32_t>(document.tables[kBoundCells], part);
  bounds.tolerance_m = get<double>(document.tables[kBoundTolerance], part);
  const std::size_t rows = bound_rows(bounds.cells);
  bounds.cell.reserve(rows);
  for (std::size_t i = at.bound; i < at.bound + rows; ++i) {
    const std::uint8_t* row = &document.tables[kBounds][i * kTables[kBounds].columns];
    bounds.cell.push_back({row[0], row[1], row[2], row[3], row[4], row[5]});
  }
  at.bound += rows;
  return bounds;
}

Part get_part(const Document& document, std::size_t index) {
  const auto& tables = document.tables;
  Part part;
  part.shape.semi_axes_m = get_vec3(tables[kSemiAxes], 3 * index);
  part.shape.e1 = get<double>(tables[kExponents], 2 * index);
  part.shape.e2 = get<double>(tables[kExponents], 2 * index + 1);
  if (!tables[kTaper].empty()) part.shape.taper = get<double>(tables[kTaper], index);
  if (!tables[kBend].empty())
    part.shape.bend = {get<double>(tables[kBend], 2 * index), get<double>(tables[kBend], 2 * index + 1)};
  const auto q = [&](std::size_t i) { return get<double>(tables[kOrientation], 4 * index + i); };
  part.object_from_part = {{q(0), q(1), q(2), q(3)}, get_vec3(tables[kTranslation], 3 * index)};
  part.sphere = get_sphere(tables[kPartSphere], 4 * index);
  part.volume_m3 = get<double>(tables[kPartVolume], index);
  part.segment = get<std::uint32_t>(tables[kSegment], index);
  part.reason = static_cast<CutReason>(tables[kReason][index]);
  part.vertex_count = get<std::uint32_t>(tables[kVertexCount], index);
  part.face_count = get<std::uint32_t>(tables[kFaceCount], index);
  return part;
}

Outcome get_errors(const Document& document, std::vector<ErrorRow>& errors) {
  const Bytes& table = document.tables[kErrors];
  const std::size_t columns = kTables[kErrors].columns;
  for (std::size_t row = 0; row < row_count(document, kErrors); ++row) {
    const auto value = [&](std::size_t column) { return get<double>(table, row * columns + column); };
    std::array<std::uint32_t, 5> counts;
    constexpr std::array<std::size_t, 5> kCountColumns{0, 1, 7, 8, 9};
    for (std::size_t i = 0; i < counts.size(); ++i) {
      const double number = value(kCountColumns[i]);
      if (!(number >= 0 && number <= 0xFFFFFFFFp0 && number == std::floor(number)))  // NaN: refused
        return damaged("dataset \"/errors\": row " + std::to_string(row) + ", column " +
                       std::to_string(kCountColumns[i]) + " is " + std::to_string(number) +
                       ", must be a whole number below 2^32");
      counts[i] = static_cast<std::uint32_t>(number);
    }
    errors.push_back({counts[0], counts[1], value(2), value(3), value(4), value(5), value(6), counts[2],
                      counts[3], counts[4]});
  }
  return Done{};
}

}  // namespace

std::size_t element_bytes(Element element) noexcept {
  switch (element) {
    case Element::kU8:
      return 1;
    case Element::kU16:
      return 2;
    case Element::kU32:
      return 4;
    case Element::kF64:
      return 8;
  }
  return 1;
}

std::string path_of(const ArraySpec& spec) {
  std::string path = "/";
  if (*spec.group != '\0') path += std::string(spec.group) + "/";
  return path + spec.name;
}

std::uint32_t minor_version(const Asset& asset) noexcept {
  return has_bends(asset) ? 3 : has_tapers(asset) ? 2 : has_bounds(asset) ? 1 : 0;
}

Document to_document(const Asset& asset) {
  Document document;
  for (const auto& [id, text] : kFixedTexts) document.text[id] = text;
  for (const auto& [id, text] : provenance_texts(asset.provenance)) document.text[id] = *text;

  auto& numbers = document.numbers;
  put(numbers[kVersionPair], kFormatMajor);
  put(numbers[kVersionPair], minor_version(asset));
  put(numbers[kMetresPerUnit], asset.provenance.metres_per_unit);
  put(numbers[kRMax], asset.r_max_m);
  put(numbers[kAssetSphere], asset.sphere);
  const auto counts = mesh_counts(asset.mesh);
  for (std::size_t i = 0; i < counts.size(); ++i) put(numbers[kMeshFirstCount + i], *counts[i]);
  put(numbers[kMeshClosed], static_cast<std::uint8_t>(asset.mesh.is_closed ? 1 : 0));
  put(numbers[kMeshVolume], asset.mesh.volume_m3);

  auto& tables = document.tables;
  const bool bounded = has_bounds(asset), tapered = has_tapers(asset), bent = has_bends(asset);
  for (const Part& part : asset.parts) {
    put(tables[kSemiAxes], part.shape.semi_axes_m);
    put(tables[kExponents], part.shape.e1);
    put(tables[kExponents], part.shape.e2);
    const Quaternion& q = part.object_from_part.orientation;
    for (const double value : {q.w, q.x, q.y, q.z}) put(tables[kOrientation], value);
    put(tables[kTranslation], part.object_from_part.translation_m);
    put(tables[kPartSphere], part.sphere);
    put(tables[kPartVolume], part.volume_m3);
    put(tables[kSegment], part.segment);
    put(tables[kReason], static_cast<std::uint8_t>(part.reason));
    put(tables[kVertexCount], part.vertex_count);
    put(tables[kFaceCount], part.face_count);
    put_map(document, part.map);
    if (bounded) put_bounds(document, part.bounds);
    if (tapered) put(tables[kTaper], part.shape.taper);
    if (bent) put(tables[kBend], part.shape.bend.x);
    if (bent) put(tables[kBend], part.shape.bend.y);
  }
  for (const std::uint16_t label : asset.face_labels) put(tables[kFaceLabels], label);
  for (const ErrorRow& row : asset.errors)
    for (const double value :
         {double(row.level), double(row.layer), row.eq35_percent, row.depth_mean_percent,
          row.depth_p95_percent, row.misclassified_3_percent, row.misclassified_05_percent,
          double(row.samples_3), double(row.samples_05), double(row.samples_depth)})
      put(tables[kErrors], value);
  return document;
}

Result<Asset> to_asset(const Document& document) {
  for (const auto& [id, text] : kFixedTexts)
    if (document.text[id] != text)
      return damaged(std::string("attribute \"") + kTexts[id] + "\" is \"" + document.text[id] +
                     "\", must be \"" + text + "\"");
  const auto major = get<std::uint32_t>(document.numbers[kVersionPair], 0);
  const auto minor = get<std::uint32_t>(document.numbers[kVersionPair], 1);
  if (major != kFormatMajor || minor > kFormatMinor)
    return Error{Status::kUnsupportedVersion,
                 "attribute \"format_version\" is " + std::to_string(major) + "." + std::to_string(minor) +
                     ", this reader knows " + std::to_string(kFormatMajor) + ".0 to " +
                     std::to_string(kFormatMajor) + "." + std::to_string(kFormatMinor),
                 "use a newer sqmap"};
  if (Outcome shapes = check_shapes(document); !shapes) return shapes.error();

  Asset asset;
  for (const auto& [id, text] : provenance_texts(asset.provenance)) *text = document.text[id];
  const auto& numbers = document.numbers;
  asset.provenance.metres_per_unit = get<double>(numbers[kMetresPerUnit], 0);
  asset.r_max_m = get<double>(numbers[kRMax], 0);
  asset.sphere = get_sphere(numbers[kAssetSphere], 0);
  const auto counts = mesh_counts(asset.mesh);
  for (std::size_t i = 0; i < counts.size(); ++i)
    *counts[i] = get<std::uint32_t>(numbers[kMeshFirstCount + i], 0);
  if (numbers[kMeshClosed][0] > 1)
    return damaged("attribute \"/mesh/is_closed\" is " + std::to_string(numbers[kMeshClosed][0]) +
                   ", must be 0 or 1");
  asset.mesh.is_closed = numbers[kMeshClosed][0] == 1;
  asset.mesh.volume_m3 = get<double>(numbers[kMeshVolume], 0);

  Cursor cursor;
  for (std::size_t i = 0; i < row_count(document, kSemiAxes); ++i) {
    asset.parts.push_back(get_part(document, i));
    if (Outcome map = get_map(document, i, cursor, asset.parts.back().map); !map) return map.error();
    asset.parts.back().bounds = get_bounds(document, i, cursor);
  }
  const Bytes& labels = document.tables[kFaceLabels];
  asset.face_labels.resize(labels.size() / 2);
  if (!labels.empty()) std::memcpy(asset.face_labels.data(), labels.data(), labels.size());
  if (Outcome errors = get_errors(document, asset.errors); !errors) return errors.error();
  return asset;
}

}  // namespace sqmap::io
