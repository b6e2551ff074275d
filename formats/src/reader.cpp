// SPDX-License-Identifier: Apache-2.0
//
// Bundles come from strangers. Accidental damage ends at the envelope's digest. Against a bundle made with
// intent to harm, hdf5_image.cpp parses the little of HDF5 that bundles use, names come from a fixed list,
// everything that points out of the file or asks for more than this format uses is refused, every size is
// checked before it is allocated by, and chunk.cpp unpacks exactly what was declared. The HDF5 library has no
// part in it.
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "sqmap/asset/validate.hpp"
#include "sqmap/io/bundle.hpp"

#include "chunk.hpp"
#include "envelope.hpp"
#include "file_bytes.hpp"
#include "hdf5_image.hpp"
#include "tables.hpp"

namespace sqmap::io {
namespace {

constexpr std::size_t kMaxTextBytes = std::size_t{64} * 1024;  // of one attribute; rule 4 allows less
constexpr const char* kRebake = "bake the asset again";

Error refused(std::string where, const std::string& what) {
  return {Status::kInvalidAsset, std::move(where) + " " + what, kRebake};
}

Result<ObjectHeader> open_group(std::span<const std::uint8_t> bundle, const ObjectHeader& root,
                                const char* name) {
  const std::string where = std::string("group \"/") + name + "\":";
  const ObjectHeader::Link link = root.link(name);
  if (link.kind != ObjectHeader::LinkKind::kHard) return refused(where, "missing, or a link out of the file");
  return ObjectHeader::read(bundle, link.address, where);
}

Result<std::string> read_text(const ObjectHeader& root, const char* name) {
  const std::string where = std::string("attribute \"") + name + "\":";
  if (!root.has_attribute(name)) return refused(where, "missing");
  const auto value = root.attribute(name);
  const auto size = value ? text_bytes(value->type) : std::nullopt;
  if (!size || *size > kMaxTextBytes || shape_of(value->space) != Shape{} || value->data.size() != *size)
    return refused(where, "must be one string of fixed length, null-padded UTF-8, at most " +
                              std::to_string(kMaxTextBytes) + " bytes");
  std::string text(value->data.begin(), value->data.end());
  text.resize(text.find_last_not_of('\0') + 1);  // padding; npos + 1 is 0
  return text;
}

Result<Bytes> read_number(const ObjectHeader& object, const ArraySpec& spec) {
  const std::string where = "attribute \"" + path_of(spec) + "\":";
  if (!object.has_attribute(spec.name)) return refused(where, "missing");
  const auto value = object.attribute(spec.name);
  const auto shape = value ? shape_of(value->space) : std::nullopt;
  if (!shape || shape->rank > 1 || shape->size[0] != spec.columns || !is_type(value->type, spec.element) ||
      value->data.size() != element_bytes(spec.element) * spec.columns)
    return refused(where, "is not of the type and size that FORMAT.md section 5 requires");
  return Bytes(value->data.begin(), value->data.end());
}

/// One dataset; an absent one is empty. Takes its declared bytes from `budget`.
Result<Bytes> read_table(std::span<const std::uint8_t> bundle, const ObjectHeader& group,
                         const ArraySpec& spec, std::uint64_t& budget, std::uint64_t& stored_size) {
  stored_size = 0;
  const ObjectHeader::Link link = group.link(spec.name);
  if (link.kind == ObjectHeader::LinkKind::kNone) return Bytes{};
  const std::string where = "dataset \"" + path_of(spec) + "\":";
  if (link.kind != ObjectHeader::LinkKind::kHard)
    return refused(where, "is a soft, external or user-defined link");
  const auto dataset = ObjectHeader::read(bundle, link.address, where);
  if (!dataset) return dataset.error();

  const auto type = dataset.value().message(ObjectHeader::Kind::kType),
             space = dataset.value().message(ObjectHeader::Kind::kSpace),
             layout = dataset.value().message(ObjectHeader::Kind::kLayout),
             filters = dataset.value().message(ObjectHeader::Kind::kFilters);
  if (!type || !is_type(*type, spec.element))
    return refused(where, "is not of the type that FORMAT.md section 6 requires");
  const std::size_t rank = spec.columns == 1 ? 1 : 2;
  const auto shape = space ? shape_of(*space) : std::nullopt;
  if (!shape || shape->rank != rank || shape->size[0] == 0 || shape->size[1] != spec.columns)
    return refused(where, "must have the shape [rows" +
                              (rank == 1 ? std::string("]") : ", " + std::to_string(spec.columns) + "]"));
  const auto chunk = layout ? single_chunk(*layout, *shape, spec.element) : std::nullopt;
  if (!chunk) return refused(where, "must be stored inside the file, as one chunk of its own shape");
  if (!filters || !has_required_filters(*filters, spec.element))
    return refused(where, "must have the filters shuffle, deflate, fletcher32 and no others");
  const auto stored = bytes_at(bundle, chunk->address, chunk->stored_bytes);
  if (!stored || stored->empty()) return refused(where, "declares a chunk that is not in the file");
  if (chunk->skipped_filters != 0) return refused(where, "has a chunk that went past a filter");

  const std::uint64_t rows = shape->size[0];
  const std::uint64_t row_bytes = element_bytes(spec.element) * spec.columns;
  if (rows > budget / row_bytes)
    return refused(where, "declares " + std::to_string(rows) + " rows, which exceeds the limit of " +
                              std::to_string(budget) + " bytes left to decode");
  const std::uint64_t declared = rows * row_bytes;
  if (declared > stored->size() * kMaxDeflateRatio || declared > std::numeric_limits<std::uint32_t>::max())
    return refused(where, "declares " + std::to_string(declared) + " bytes, more than its " +
                              std::to_string(stored->size()) + " stored bytes can hold");
  budget -= declared;
  auto bytes = unpack_chunk(*stored, static_cast<std::uint32_t>(declared), element_bytes(spec.element));
  if (!bytes)
    return refused(where, "does not inflate to the " + std::to_string(declared) + " bytes it declares");
  stored_size = stored->size();
  return std::move(*bytes);
}

Result<Document> read_document(std::span<const std::uint8_t> bundle, const ReadLimits& limits,
                               std::vector<StoredBytes>* sizes) {
  if (bundle.size() > limits.max_file_bytes)
    return refused("bundle:", std::to_string(bundle.size()) + " bytes, at most " +
                                  std::to_string(limits.max_file_bytes) + " are read");
  if (Outcome envelope = check_envelope(bundle); !envelope) return envelope.error();
  const auto root_at = root_address(bundle);
  if (!root_at) return root_at.error();
  const auto root = ObjectHeader::read(bundle, root_at.value(), "root group:");
  if (!root) return root.error();
  const auto mesh = open_group(bundle, root.value(), "mesh"),
             parts = open_group(bundle, root.value(), "parts"),
             maps = open_group(bundle, root.value(), "maps");
  for (const auto* group : {&mesh, &parts, &maps})
    if (!*group) return group->error();
  const auto owner = [&](const ArraySpec& spec) -> const ObjectHeader& {
    const std::string group = spec.group;
    return group == "mesh"    ? mesh.value()
           : group == "parts" ? parts.value()
           : group == "maps"  ? maps.value()
                              : root.value();
  };

  Document document;
  for (std::size_t id = 0; id < kTextCount; ++id) {
    auto text = read_text(root.value(), kTexts[id]);
    if (!text) return text.error();
    document.text[id] = std::move(text).value();
  }
  for (std::size_t id = 0; id < kNumberCount; ++id) {
    auto number = read_number(owner(kNumbers[id]), kNumbers[id]);
    if (!number) return number.error();
    document.numbers[id] = std::move(number).value();
  }
  std::uint64_t budget = limits.max_decoded_bytes;
  for (std::size_t id = 0; id < kTableCount; ++id) {
    std::uint64_t stored = 0;
    auto table = read_table(bundle, owner(kTables[id]), kTables[id], budget, stored);
    if (!table) return table.error();
    if (id <= kCode && table.value().empty())
      return refused("dataset \"" + path_of(kTables[id]) + "\":", "missing");
    document.tables[id] = std::move(table).value();
    if (sizes != nullptr && stored > 0)
      sizes->push_back({path_of(kTables[id]), stored, document.tables[id].size()});
  }
  const auto hash = read_text(root.value(), kContentHashName);
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
