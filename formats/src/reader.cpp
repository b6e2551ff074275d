// SPDX-License-Identifier: Apache-2.0
//
// Bundles come from strangers. Damage never reaches HDF5: the envelope's digest is checked first. Against a
// bundle made with intent to harm, HDF5 is left to parse its metadata only, names come from a fixed list,
// everything that points out of the file or asks for more than this format uses is refused, and chunks are
// unpacked by chunk.cpp. HDF5's own parser remains: who opens bundles of unknown origin does so in a process
// that may die.
#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <string>
#include <utility>

#include <hdf5.h>

#include "sqmap/asset/validate.hpp"
#include "sqmap/io/bundle.hpp"

#include "chunk.hpp"
#include "envelope.hpp"
#include "file_bytes.hpp"
#include "hdf5_handle.hpp"
#include "tables.hpp"

namespace sqmap::io {
namespace {

constexpr std::size_t kMaxTextBytes = std::size_t{64} * 1024;  // of one attribute; rule 4 allows less
constexpr std::size_t kSuperblockBytes = 48;
constexpr std::size_t kImageGrowBytes = std::size_t{64} * 1024;
constexpr std::uint64_t kUndefinedAddress = ~std::uint64_t{0};
constexpr const char* kRebake = "bake the asset again";

Error refused(std::string where, const std::string& what) {
  return {Status::kInvalidAsset, std::move(where) + " " + what, kRebake};
}

std::string dataset_name(const ArraySpec& spec) { return "dataset \"" + path_of(spec) + "\""; }

// The superblock as the writer makes it. HDF5 checks more, but only after it has begun to trust it.
Outcome check_superblock(std::span<const std::uint8_t> bundle) {
  constexpr std::array<std::uint8_t, 8> kSignature{0x89, 'H', 'D', 'F', '\r', '\n', 0x1A, '\n'};
  if (bundle.size() < kEnvelopeBytes + kSuperblockBytes) return refused("superblock:", "missing");
  const auto block = bundle.subspan(kEnvelopeBytes, kSuperblockBytes);
  const auto address = [&](std::size_t at) {
    std::uint64_t value;
    std::memcpy(&value, block.data() + at, sizeof value);
    return value;
  };
  // Version 3, 8-byte offsets and lengths, not open for writing; base address, no extension, end of file.
  if (!std::equal(kSignature.begin(), kSignature.end(), block.begin()) || block[8] != 3 || block[9] != 8 ||
      block[10] != 8 || block[11] != 0 || address(12) != kEnvelopeBytes || address(20) != kUndefinedAddress ||
      address(28) != bundle.size())
    return refused("superblock:", "not as FORMAT.md section 4 requires");
  return Done{};
}

Hdf5Handle open_image(const std::string& name, std::span<const std::uint8_t> bundle) {
  const Hdf5Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  // HDF5 copies the image; its interface predates const.
  if (H5Pset_fapl_core(access.get(), kImageGrowBytes, false) < 0 ||
      H5Pset_fclose_degree(access.get(), H5F_CLOSE_STRONG) < 0 ||
      H5Pset_file_image(access.get(), const_cast<std::uint8_t*>(bundle.data()), bundle.size()) < 0)
    return {};
  return {H5Fopen(name.c_str(), H5F_ACC_RDONLY, access.get()), H5Fclose};
}

// True for a link that leads to an object of this very file.
bool is_hard_link(const Hdf5Handle& group, const char* name) {
  H5L_info_t info;
  return H5Lget_info(group.get(), name, &info, H5P_DEFAULT) >= 0 && info.type == H5L_TYPE_HARD;
}

Result<Hdf5Handle> open_group(const Hdf5Handle& file, const char* name) {
  const std::string where = std::string("group \"/") + name + "\":";
  if (!is_hard_link(file, name)) return refused(where, "missing, or a link out of the file");
  Hdf5Handle group(H5Gopen2(file.get(), name, H5P_DEFAULT), H5Gclose);
  if (!group) return refused(where, "cannot be opened as a group");
  return group;
}

Result<std::string> read_text(const Hdf5Handle& file, const char* name) {
  const std::string where = std::string("attribute \"") + name + "\":";
  if (H5Aexists(file.get(), name) <= 0) return refused(where, "missing");
  const Hdf5Handle attribute(H5Aopen(file.get(), name, H5P_DEFAULT), H5Aclose);
  if (!attribute) return refused(where, "cannot be opened");
  const Hdf5Handle type(H5Aget_type(attribute.get()), H5Tclose);
  const Hdf5Handle space(H5Aget_space(attribute.get()), H5Sclose);
  const std::size_t size = H5Tget_size(type.get());
  if (!type || !space || H5Tget_class(type.get()) != H5T_STRING || H5Tis_variable_str(type.get()) != 0 ||
      H5Sget_simple_extent_type(space.get()) != H5S_SCALAR || size == 0 || size > kMaxTextBytes)
    return refused(where,
                   "must be one string of fixed length, at most " + std::to_string(kMaxTextBytes) + " bytes");
  std::string text(size, '\0');
  if (H5Aread(attribute.get(), type.get(), text.data()) < 0) return refused(where, "cannot be read");
  text.resize(text.find_last_not_of('\0') + 1);  // padding; npos + 1 is 0
  return text;
}

Result<Bytes> read_number(const Hdf5Handle& object, const ArraySpec& spec) {
  const std::string where = "attribute \"" + path_of(spec) + "\":";
  if (H5Aexists(object.get(), spec.name) <= 0) return refused(where, "missing");
  const Hdf5Handle attribute(H5Aopen(object.get(), spec.name, H5P_DEFAULT), H5Aclose);
  if (!attribute) return refused(where, "cannot be opened");
  const Hdf5Handle type(H5Aget_type(attribute.get()), H5Tclose);
  const Hdf5Handle space(H5Aget_space(attribute.get()), H5Sclose);
  if (!type || !space || H5Tequal(type.get(), hdf5_type(spec.element)) <= 0 ||
      H5Sget_simple_extent_npoints(space.get()) != static_cast<hssize_t>(spec.columns))
    return refused(where, "is not of the type and size that FORMAT.md section 5 requires");
  Bytes bytes(element_bytes(spec.element) * spec.columns);
  if (H5Aread(attribute.get(), type.get(), bytes.data()) < 0) return refused(where, "cannot be read");
  return bytes;
}

// The filters of every dataset, in this order and no others: shuffle (not for single bytes), deflate,
// fletcher32.
bool has_required_filters(const Hdf5Handle& creation, Element element) {
  constexpr std::array<H5Z_filter_t, 3> kFilters{H5Z_FILTER_SHUFFLE, H5Z_FILTER_DEFLATE,
                                                 H5Z_FILTER_FLETCHER32};
  const std::size_t first = element_bytes(element) == 1 ? 1 : 0;
  if (H5Pget_nfilters(creation.get()) != static_cast<int>(kFilters.size() - first)) return false;
  for (std::size_t i = first; i < kFilters.size(); ++i) {
    unsigned flags = 0;
    std::size_t value_count = 0;
    if (H5Pget_filter2(creation.get(), static_cast<unsigned>(i - first), &flags, &value_count, nullptr, 0,
                       nullptr, nullptr) != kFilters[i])
      return false;
  }
  return true;
}

// Rows of the dataset, after everything about its shape, type and storage has been found as required.
Result<hsize_t> check_dataset(const Hdf5Handle& dataset, const ArraySpec& spec) {
  const std::string where = dataset_name(spec) + ":";
  const Hdf5Handle type(H5Dget_type(dataset.get()), H5Tclose);
  const Hdf5Handle space(H5Dget_space(dataset.get()), H5Sclose);
  const Hdf5Handle creation(H5Dget_create_plist(dataset.get()), H5Pclose);
  const int rank = spec.columns == 1 ? 1 : 2;
  if (!type || !space || !creation || H5Tequal(type.get(), hdf5_type(spec.element)) <= 0)
    return refused(where, "is not of the type that FORMAT.md section 6 requires");
  hsize_t shape[2] = {0, 1}, chunk[2] = {0, 1};
  if (H5Sget_simple_extent_type(space.get()) != H5S_SIMPLE ||
      H5Sget_simple_extent_ndims(space.get()) != rank ||
      H5Sget_simple_extent_dims(space.get(), shape, nullptr) != rank || shape[0] == 0 ||
      shape[1] != spec.columns)
    return refused(where, "must have the shape [rows" +
                              (rank == 1 ? std::string("]") : ", " + std::to_string(spec.columns) + "]"));
  // A virtual, contiguous, compact or external dataset is not chunked.
  if (H5Pget_layout(creation.get()) != H5D_CHUNKED || H5Pget_chunk(creation.get(), rank, chunk) != rank ||
      chunk[0] != shape[0] || chunk[1] != shape[1])
    return refused(where, "must be stored inside the file, as one chunk of its own shape");
  if (!has_required_filters(creation, spec.element))
    return refused(where, "must have the filters shuffle, deflate, fletcher32 and no others");
  return shape[0];
}

// What one read may still ask for.
struct Budget {
  std::uint64_t decoded_bytes;
  std::uint64_t file_bytes;
};

/// One dataset; an absent one is empty.
Result<Bytes> read_table(const Hdf5Handle& group, const ArraySpec& spec, Budget& budget,
                         std::uint64_t& stored_size) {
  stored_size = 0;
  if (const htri_t exists = H5Lexists(group.get(), spec.name, H5P_DEFAULT); exists == 0) return Bytes{};
  const std::string where = dataset_name(spec) + ":";
  if (!is_hard_link(group, spec.name)) return refused(where, "is a soft, external or user-defined link");
  const Hdf5Handle dataset(H5Dopen2(group.get(), spec.name, H5P_DEFAULT), H5Dclose);
  if (!dataset) return refused(where, "cannot be opened as a dataset");
  const auto rows = check_dataset(dataset, spec);
  if (!rows) return rows.error();

  const hsize_t origin[2] = {0, 0};
  hsize_t stored = 0;
  if (H5Dget_chunk_storage_size(dataset.get(), origin, &stored) < 0 || stored == 0 ||
      stored > budget.file_bytes)
    return refused(where, "declares a chunk that is not in the file");
  const std::uint64_t row_bytes = element_bytes(spec.element) * spec.columns;
  if (rows.value() > budget.decoded_bytes / row_bytes)
    return refused(where, "declares " + std::to_string(rows.value()) + " rows, which exceeds the limit of " +
                              std::to_string(budget.decoded_bytes) + " bytes left to decode");
  const std::uint64_t declared = rows.value() * row_bytes;
  if (declared > stored * kMaxDeflateRatio || declared > std::numeric_limits<std::uint32_t>::max())
    return refused(where, "declares " + std::to_string(declared) + " bytes, more than its " +
                              std::to_string(stored) + " stored bytes can hold");
  budget.decoded_bytes -= declared;

  Bytes packed(stored);
  std::uint32_t skipped_filters = 0;
  if (H5Dread_chunk(dataset.get(), H5P_DEFAULT, origin, &skipped_filters, packed.data()) < 0 ||
      skipped_filters != 0)
    return refused(where, "cannot be read");
  auto bytes = unpack_chunk(packed, static_cast<std::uint32_t>(declared), element_bytes(spec.element));
  if (!bytes)
    return refused(where, "does not inflate to the " + std::to_string(declared) + " bytes it declares");
  stored_size = stored;
  return std::move(*bytes);
}

Result<Document> read_document(std::span<const std::uint8_t> bundle, const ReadLimits& limits,
                               std::vector<StoredBytes>* sizes) {
  if (bundle.size() > limits.max_file_bytes)
    return refused("bundle:", std::to_string(bundle.size()) + " bytes, at most " +
                                  std::to_string(limits.max_file_bytes) + " are read");
  if (Outcome envelope = check_envelope(bundle); !envelope) return envelope.error();
  if (Outcome superblock = check_superblock(bundle); !superblock) return superblock.error();

  const Hdf5Session session;
  const Hdf5Handle file = open_image(session.unique_name(), bundle);
  if (!file) return refused("bundle:", "HDF5 cannot open it");
  const auto mesh = open_group(file, "mesh"), parts = open_group(file, "parts"),
             maps = open_group(file, "maps");
  for (const auto* group : {&mesh, &parts, &maps})
    if (!*group) return group->error();
  const auto owner = [&](const ArraySpec& spec) -> const Hdf5Handle& {
    const std::string group = spec.group;
    return group == "mesh"    ? mesh.value()
           : group == "parts" ? parts.value()
           : group == "maps"  ? maps.value()
                              : file;
  };

  Document document;
  for (std::size_t id = 0; id < kTextCount; ++id) {
    auto text = read_text(file, kTexts[id]);
    if (!text) return text.error();
    document.text[id] = std::move(text).value();
  }
  for (std::size_t id = 0; id < kNumberCount; ++id) {
    auto number = read_number(owner(kNumbers[id]), kNumbers[id]);
    if (!number) return number.error();
    document.numbers[id] = std::move(number).value();
  }
  Budget budget{limits.max_decoded_bytes, bundle.size()};
  for (std::size_t id = 0; id < kTableCount; ++id) {
    std::uint64_t stored = 0;
    auto table = read_table(owner(kTables[id]), kTables[id], budget, stored);
    if (!table) return table.error();
    if (id <= kCode && table.value().empty()) return refused(dataset_name(kTables[id]) + ":", "missing");
    document.tables[id] = std::move(table).value();
    if (sizes != nullptr && stored > 0)
      sizes->push_back({path_of(kTables[id]), stored, document.tables[id].size()});
  }
  const auto hash = read_text(file, kContentHashName);
  if (!hash) return hash.error();
  if (const std::string found = content_hash(document); found != hash.value())
    return refused("bundle:", "its content has the hash " + found + ", the attribute \"content_hash\" says " +
                                  hash.value());
  return document;
}

}  // namespace

Result<Asset> decode(std::span<const std::uint8_t> bytes, const ReadLimits& limits) {
  const auto document = read_document(bytes, limits, nullptr);
  if (!document) return document.error();
  auto asset = to_asset(document.value());
  if (!asset) return asset;
  if (const auto findings = validate(asset.value(), CheckLevel::kQuick); !findings.empty())
    return refused("rule " + std::to_string(findings.front().rule) + ":", findings.front().message);
  return asset;
}

Result<Asset> read(const std::filesystem::path& path, const ReadLimits& limits) {
  const auto bytes = read_file(path, limits.max_file_bytes);
  if (!bytes) return bytes.error();
  auto asset = decode(bytes.value(), limits);
  if (asset) return asset;
  Error error = asset.error();
  error.finding = "\"" + path.string() + "\": " + error.finding;
  return error;
}

Result<std::vector<StoredBytes>> stored_bytes(std::span<const std::uint8_t> bytes) {
  std::vector<StoredBytes> sizes;
  if (const auto document = read_document(bytes, {}, &sizes); !document) return document.error();
  return sizes;
}

}  // namespace sqmap::io
