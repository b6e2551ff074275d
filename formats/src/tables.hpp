// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "sqmap/asset/asset.hpp"
#include "sqmap/asset/result.hpp"

namespace sqmap::io {

using Bytes = std::vector<std::uint8_t>;

/// Stored number types; little-endian in the file.
enum class Element : std::uint8_t { kU8, kU16, kU32, kF64 };
std::size_t element_bytes(Element element) noexcept;

/// A dataset, or an attribute of numbers, of FORMAT.md sections 5 and 6.
struct ArraySpec {
  const char* group;  ///< "" for the root
  const char* name;
  Element element;
  std::uint32_t
      columns;  ///< values a row; a dataset of one column has rank 1, an attribute of one value is scalar
};

/// Datasets in the order of the file and of the content hash. Stored; append only.
enum TableId : std::size_t {
  kSemiAxes,
  kExponents,
  kOrientation,
  kTranslation,
  kPartSphere,
  kPartVolume,
  kSegment,
  kReason,
  kVertexCount,
  kFaceCount,
  kLayout,
  kDepth,
  kCode,
  kStartInside,
  kCrossingTexel,
  kCrossingCode,
  kVertexCell,
  kVertexPosition,
  kVertexCode,
  kFaceLabels,
  kErrors,
  kBoundCells,
  kBoundTolerance,
  kBounds,
  kTaper,
  kBend,
  kTableCount
};
inline constexpr std::array<ArraySpec, kTableCount> kTables{{
    {"parts", "semi_axes_m", Element::kF64, 3},
    {"parts", "exponents", Element::kF64, 2},
    {"parts", "orientation", Element::kF64, 4},
    {"parts", "translation_m", Element::kF64, 3},
    {"parts", "sphere_m", Element::kF64, 4},
    {"parts", "volume_m3", Element::kF64, 1},
    {"parts", "segment", Element::kU32, 1},
    {"parts", "reason", Element::kU8, 1},
    {"parts", "vertex_count", Element::kU32, 1},
    {"parts", "face_count", Element::kU32, 1},
    {"maps", "layout", Element::kU32, 7},
    {"maps", "depth_m", Element::kF64, 2},
    {"maps", "code", Element::kU16, 1},
    {"maps", "start_inside", Element::kU8, 1},
    {"maps", "crossing_texel", Element::kU32, 1},
    {"maps", "crossing_code", Element::kU16, 1},
    {"maps", "vertex_cell", Element::kU32, 1},
    {"maps", "vertex_position", Element::kU8, 2},
    {"maps", "vertex_code", Element::kU16, 1},
    {"", "face_labels", Element::kU16, 1},
    {"", "errors", Element::kF64, 10},
    {"maps", "bound_cells", Element::kU32, 1},
    {"maps", "bound_tolerance_m", Element::kF64, 1},
    {"maps", "bounds", Element::kU8, 6},
    {"parts", "taper", Element::kF64, 1},
    {"parts", "bend_per_m", Element::kF64, 2},
}};

/// Attributes of numbers, in the order of the content hash.
enum NumberId : std::size_t {
  kVersionPair,
  kMetresPerUnit,
  kRMax,
  kAssetSphere,
  kMeshFirstCount,
  kMeshClosed = kMeshFirstCount + 12,
  kMeshVolume,
  kNumberCount
};
inline constexpr std::array<ArraySpec, kNumberCount> kNumbers{{
    {"", "format_version", Element::kU32, 2},
    {"", "metres_per_unit", Element::kF64, 1},
    {"", "r_max_m", Element::kF64, 1},
    {"", "sphere_m", Element::kF64, 4},
    {"mesh", "source_vertices", Element::kU32, 1},
    {"mesh", "source_faces", Element::kU32, 1},
    {"mesh", "vertices", Element::kU32, 1},
    {"mesh", "faces", Element::kU32, 1},
    {"mesh", "components", Element::kU32, 1},
    {"mesh", "welded_vertices", Element::kU32, 1},
    {"mesh", "degenerate_faces", Element::kU32, 1},
    {"mesh", "duplicate_faces", Element::kU32, 1},
    {"mesh", "flipped_faces", Element::kU32, 1},
    {"mesh", "filled_holes", Element::kU32, 1},
    {"mesh", "boundary_edges", Element::kU32, 1},
    {"mesh", "non_manifold_edges", Element::kU32, 1},
    {"mesh", "is_closed", Element::kU8, 1},
    {"mesh", "volume_m3", Element::kF64, 1},
}};

/// Root attributes of text, in the order of the content hash.
enum TextId : std::size_t {
  kFormat,
  kGenerator,
  kGeneratorVersion,
  kSourceName,
  kSourceHash,
  kOptions,
  kLengthUnit,
  kUpAxis,
  kHandedness,
  kTextCount
};
inline constexpr std::array<const char*, kTextCount> kTexts{"format",      "generator",   "generator_version",
                                                            "source_name", "source_hash", "options",
                                                            "length_unit", "up_axis",     "handedness"};
inline constexpr const char* kContentHashName = "content_hash";

/// An asset as the arrays that a bundle stores: what lies between Asset and HDF5.
struct Document {
  std::array<std::string, kTextCount> text;
  std::array<Bytes, kNumberCount> numbers;  ///< columns values each
  std::array<Bytes, kTableCount> tables;    ///< whole rows; empty: the dataset is absent
};

/// "/maps/code".
std::string path_of(const ArraySpec& spec);

/// The earliest minor version that has all that the asset holds (FORMAT.md section 9).
std::uint32_t minor_version(const Asset& asset) noexcept;

/// Precondition: the asset breaks no rule of validate(asset, kFull).
Document to_document(const Asset& asset);

/// Checks that all arrays fit together before it allocates; the asset has still to be validated.
/// Errors: kInvalidAsset with the dataset; kUnsupportedVersion.
Result<Asset> to_asset(const Document& document);

/// XXH3-128 over texts, numbers and tables in their order (FORMAT.md section 7), 32 hex digits.
std::string content_hash(const Document& document);

}  // namespace sqmap::io
