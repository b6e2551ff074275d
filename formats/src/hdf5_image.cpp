// SPDX-License-Identifier: Apache-2.0
//
// Numbers of messages and fields are those of the HDF5 File Format Specification, version 3.0: superblock
// II.A, object headers IV.A.1.b, messages IV.A.2.
#include "hdf5_image.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "envelope.hpp"

namespace sqmap::io {
namespace {

constexpr std::size_t kSuperblockBytes = 48;
constexpr std::uint64_t kUndefinedAddress = ~std::uint64_t{0};
constexpr std::size_t kChecksumBytes = 4;

// Messages besides ObjectHeader::Kind.
constexpr std::uint8_t kNil = 0x00, kLinkInfo = 0x02, kFillValue = 0x05, kLink = 0x06, kGroupInfo = 0x0A,
                       kAttribute = 0x0C, kContinuation = 0x10, kAttributeInfo = 0x15;
// Flags of a message: it is constant; it is not to be shared. Shared ones lie elsewhere.
constexpr std::uint8_t kHarmlessMessageFlags = 0x01 | 0x04;

Error refused(const std::string& where, const std::string& what) {
  return {Status::kInvalidAsset, where + " " + what, "bake the asset again"};
}

/// Takes fields from the front of a view. Past its end all fields are 0 or empty, and ok() is false for good.
class Cursor {
 public:
  explicit Cursor(ByteView bytes) : bytes_(bytes) {}

  ByteView take(std::uint64_t size) noexcept {
    if (size > bytes_.size()) {
      bytes_ = {};
      ok_ = false;
      return {};
    }
    const ByteView front = bytes_.first(static_cast<std::size_t>(size));
    bytes_ = bytes_.subspan(static_cast<std::size_t>(size));
    return front;
  }
  /// A little-endian number of at most 8 bytes.
  std::uint64_t number(std::uint64_t size) noexcept {
    std::uint64_t value = 0;
    if (size > sizeof value) return take(bytes_.size() + 1), 0;
    const ByteView field = take(size);
    if (!field.empty()) std::memcpy(&value, field.data(), field.size());
    return value;
  }
  std::uint8_t byte() noexcept { return static_cast<std::uint8_t>(number(1)); }
  bool ok() const noexcept { return ok_; }
  /// All fields were there, and nothing is left.
  bool done() const noexcept { return ok_ && bytes_.empty(); }
  std::size_t left() const noexcept { return bytes_.size(); }

 private:
  ByteView bytes_;
  bool ok_ = true;
};

std::string_view as_text(ByteView bytes) noexcept {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

bool is_known(std::uint8_t type) noexcept {
  using Kind = ObjectHeader::Kind;
  constexpr std::array kKinds{Kind::kSpace, Kind::kType, Kind::kLayout, Kind::kFilters};
  constexpr std::array<std::uint8_t, 8> kOthers{kNil,       kLinkInfo,  kFillValue,    kLink,
                                                kGroupInfo, kAttribute, kContinuation, kAttributeInfo};
  return std::ranges::find(kKinds, static_cast<Kind>(type)) != kKinds.end() ||
         std::ranges::find(kOthers, type) != kOthers.end();
}

// Whether a link info or attribute info message says that all entries are in the header itself.
bool keeps_entries_in_header(ByteView info) noexcept {
  Cursor cursor(info);
  const std::uint8_t version = cursor.byte(), flags = cursor.byte();
  const std::uint64_t heap = cursor.number(8), names = cursor.number(8);
  return cursor.done() && version == 0 && flags == 0 && heap == kUndefinedAddress &&
         names == kUndefinedAddress;
}

struct LinkFields {
  std::string_view name;
  bool is_hard{};
  std::uint64_t address{};
};

std::optional<LinkFields> parse_link(ByteView body) noexcept {
  constexpr std::uint8_t kNameSizeBits = 0x03, kHasOrder = 0x04, kHasType = 0x08, kHasCharset = 0x10,
                         kAll = 0x1F;
  Cursor cursor(body);
  const std::uint8_t version = cursor.byte(), flags = cursor.byte();
  if (version != 1 || (flags & ~kAll) != 0) return std::nullopt;
  const std::uint8_t type = (flags & kHasType) != 0 ? cursor.byte() : 0;
  if ((flags & kHasOrder) != 0) cursor.number(8);
  if ((flags & kHasCharset) != 0) cursor.byte();
  LinkFields link;
  link.name = as_text(cursor.take(cursor.number(std::uint64_t{1} << (flags & kNameSizeBits))));
  if (!cursor.ok()) return std::nullopt;
  if (type != 0) return link;  // soft, external, user-defined: what follows leads away
  link.is_hard = true;
  link.address = cursor.number(8);
  if (!cursor.done()) return std::nullopt;
  return link;
}

struct AttributeFields {
  std::string_view name;
  ObjectHeader::Value value;
};

std::optional<AttributeFields> parse_attribute(ByteView body) noexcept {
  Cursor cursor(body);
  const std::uint8_t version = cursor.byte(), shared = cursor.byte();
  const std::uint64_t name_size = cursor.number(2), type_size = cursor.number(2),
                      space_size = cursor.number(2);
  cursor.byte();  // character set of the name
  AttributeFields fields;
  fields.name = as_text(cursor.take(name_size));
  fields.value.type = cursor.take(type_size);
  fields.value.space = cursor.take(space_size);
  fields.value.data = cursor.take(cursor.left());
  if (!cursor.ok() || version != 3 || shared != 0 || fields.name.empty() || fields.name.back() != '\0')
    return std::nullopt;
  fields.name.remove_suffix(1);
  return fields;
}

}  // namespace

Result<std::uint64_t> root_address(ByteView bundle) {
  constexpr std::array<std::uint8_t, 12> kStart{
      // signature, version 3, 8-byte offsets, 8-byte lengths, closed
      0x89, 'H', 'D', 'F', '\r', '\n', 0x1A, '\n', 3, 8, 8, 0};
  if (bundle.size() < kEnvelopeBytes + kSuperblockBytes) return refused("superblock:", "missing");
  Cursor cursor(bundle.subspan(kEnvelopeBytes, kSuperblockBytes));
  const ByteView start = cursor.take(kStart.size());
  const std::uint64_t base = cursor.number(8), extension = cursor.number(8), end = cursor.number(8);
  const std::uint64_t root = cursor.number(8);
  if (!std::equal(start.begin(), start.end(), kStart.begin()) || base != kEnvelopeBytes ||
      extension != kUndefinedAddress || end != bundle.size())
    return refused("superblock:", "not as FORMAT.md section 4 requires");
  return root;
}

std::optional<ByteView> bytes_at(ByteView bundle, std::uint64_t address, std::uint64_t size) noexcept {
  const std::uint64_t room = bundle.size() - kEnvelopeBytes;  // addresses count from behind the user block
  if (address > room || size > room - address) return std::nullopt;
  return bundle.subspan(static_cast<std::size_t>(kEnvelopeBytes + address), static_cast<std::size_t>(size));
}

Result<ObjectHeader> ObjectHeader::read(ByteView bundle, std::uint64_t address, const std::string& where) {
  constexpr std::uint8_t kSizeBits = 0x03, kHasPhaseChange = 0x10, kHasTimes = 0x20;
  const auto at = bytes_at(bundle, address, 0);
  if (!at) return refused(where, "has a header that is not in the file");
  const ByteView rest = bundle.subspan(static_cast<std::size_t>(kEnvelopeBytes + address));
  Cursor prefix(rest);
  const std::string_view signature = as_text(prefix.take(4));
  const std::uint8_t version = prefix.byte(), flags = prefix.byte();
  if (signature != "OHDR" || version != 2 || (flags & ~(kSizeBits | kHasPhaseChange | kHasTimes)) != 0)
    return refused(where, "has no header as FORMAT.md section 4 requires");
  if ((flags & kHasTimes) != 0) prefix.take(16);
  if ((flags & kHasPhaseChange) != 0) prefix.take(4);
  std::uint64_t budget = kMaxHeaderBytes;
  const std::uint64_t first_size = prefix.number(std::uint64_t{1} << (flags & kSizeBits));
  std::vector<ByteView> blocks{prefix.take(first_size)};
  if (!prefix.ok() || first_size > budget || prefix.left() < kChecksumBytes)
    return refused(where, "has a header that is not in the file");
  budget -= first_size;

  ObjectHeader header;
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    Cursor block(blocks[k]);
    constexpr std::size_t kMessageHead = 4;  // less than one of these at the end is a gap
    while (block.left() >= kMessageHead) {
      const std::uint8_t type = block.byte();
      const std::uint64_t size = block.number(2);
      const std::uint8_t message_flags = block.byte();
      const ByteView body = block.take(size);
      if (!block.ok()) return refused(where, "has a message that does not fit into its header");
      if (!is_known(type) || (message_flags & ~kHarmlessMessageFlags) != 0)
        return refused(where, "has a message of type " + std::to_string(type) + ", flags " +
                                  std::to_string(message_flags) +
                                  ", must be stored inside the file as FORMAT.md " + "section 4 says");
      if ((type == kLinkInfo || type == kAttributeInfo) && !keeps_entries_in_header(body))
        return refused(where, "keeps its links or attributes outside of its header");
      if (type == kContinuation) {
        Cursor cursor(body);
        const std::uint64_t next = cursor.number(8), next_size = cursor.number(8);
        // What every block takes from the budget also ends chains that come back on themselves.
        const auto bytes = next_size > budget ? std::nullopt : bytes_at(bundle, next, next_size);
        if (!cursor.done() || !bytes || next_size < 4 + kChecksumBytes || as_text(bytes->first(4)) != "OCHK")
          return refused(where, "continues in a block that is not in the file");
        budget -= next_size;
        blocks.push_back(bytes->subspan(4, bytes->size() - 4 - kChecksumBytes));
      } else if (type != kNil) {
        header.messages_.push_back({type, body});
      }
    }
  }
  return header;
}

ObjectHeader::Link ObjectHeader::link(std::string_view name) const noexcept {
  Link found;
  for (const Message& message : messages_) {
    if (message.type != kLink) continue;
    const auto fields = parse_link(message.body);
    if (!fields || fields->name != name) continue;
    const bool is_single = found.kind == LinkKind::kNone;
    found = {fields->is_hard && is_single ? LinkKind::kHard : LinkKind::kOther, fields->address};
  }
  return found;
}

std::optional<ObjectHeader::Value> ObjectHeader::attribute(std::string_view name) const noexcept {
  std::optional<Value> found;
  for (const Message& message : messages_) {
    if (message.type != kAttribute) continue;
    const auto fields = parse_attribute(message.body);
    if (!fields || fields->name != name) continue;
    if (found) return std::nullopt;
    found = fields->value;
  }
  return found;
}

bool ObjectHeader::has_attribute(std::string_view name) const noexcept {
  return std::any_of(messages_.begin(), messages_.end(), [&](const Message& message) {
    if (message.type != kAttribute) return false;
    const auto fields = parse_attribute(message.body);
    return fields && fields->name == name;
  });
}

std::optional<ByteView> ObjectHeader::message(Kind kind) const noexcept {
  std::optional<ByteView> found;
  for (const Message& message : messages_) {
    if (message.type != static_cast<std::uint8_t>(kind)) continue;
    if (found) return std::nullopt;
    found = message.body;
  }
  return found;
}

bool is_type(ByteView type, Element element) noexcept {
  const auto size = static_cast<std::uint32_t>(element_bytes(element));
  Cursor cursor(type);
  const std::uint8_t head = cursor.byte();
  const int version = head >> 4, kind = head & 0x0F;  // versions 1 to 3 encode these kinds alike
  if (version < 1 || version > 3) return false;
  const std::uint64_t bits = cursor.number(3), bytes = cursor.number(4);
  if (bytes != size) return false;
  if (element != Element::kF64) {  // fixed point: little-endian, unsigned, all bits in use
    const std::uint64_t offset = cursor.number(2), precision = cursor.number(2);
    return cursor.done() && kind == 0 && bits == 0 && offset == 0 && precision == std::uint64_t{8} * size;
  }
  // IEEE 754 binary64: little-endian, implied leading bit, sign at 63, exponent of 11 bits at 52, bias 1023.
  constexpr std::uint64_t kBits = 0x3F20;
  constexpr std::array<std::uint8_t, 12> kProperties{0, 0, 64, 0, 52, 11, 0, 52, 0xFF, 0x03, 0, 0};
  const ByteView properties = cursor.take(kProperties.size());
  return cursor.done() && kind == 1 && bits == kBits &&
         std::equal(properties.begin(), properties.end(), kProperties.begin());
}

std::optional<std::uint32_t> text_bytes(ByteView type) noexcept {
  constexpr std::uint64_t kNullPaddedUtf8 = 0x11;
  Cursor cursor(type);
  const std::uint8_t head = cursor.byte();
  const std::uint64_t bits = cursor.number(3), size = cursor.number(4);
  if (!cursor.done() || head >> 4 < 1 || head >> 4 > 3 || (head & 0x0F) != 3 || bits != kNullPaddedUtf8 ||
      size == 0)
    return std::nullopt;
  return static_cast<std::uint32_t>(size);
}

std::optional<Shape> shape_of(ByteView space) noexcept {
  constexpr std::uint8_t kHasMaximum = 0x01, kScalar = 0, kSimple = 1;
  Cursor cursor(space);
  const std::uint8_t version = cursor.byte(), rank = cursor.byte(), flags = cursor.byte(),
                     type = cursor.byte();
  if (version != 2 || rank > 2 || flags > kHasMaximum || type != (rank == 0 ? kScalar : kSimple))
    return std::nullopt;
  Shape shape;
  shape.rank = rank;
  for (std::size_t i = 0; i < rank; ++i) shape.size[i] = cursor.number(8);
  if (flags == kHasMaximum) cursor.take(std::uint64_t{8} * rank);
  if (!cursor.done()) return std::nullopt;
  return shape;
}

std::optional<SingleChunk> single_chunk(ByteView layout, const Shape& shape, Element element) noexcept {
  constexpr std::uint8_t kVersion = 4, kChunked = 2, kFilteredSingle = 0x02, kSingleChunkIndex = 1;
  Cursor cursor(layout);
  const std::uint8_t version = cursor.byte(), storage = cursor.byte();
  if (version != kVersion || storage != kChunked) return std::nullopt;
  const std::uint8_t flags = cursor.byte(), dimensions = cursor.byte(), number_size = cursor.byte();
  if (flags != kFilteredSingle || dimensions != shape.rank + 1) return std::nullopt;
  for (std::size_t i = 0; i < shape.rank; ++i)
    if (cursor.number(number_size) != shape.size[i]) return std::nullopt;
  if (cursor.number(number_size) != element_bytes(element) || cursor.byte() != kSingleChunkIndex)
    return std::nullopt;
  SingleChunk chunk;
  chunk.stored_bytes = cursor.number(8);
  chunk.skipped_filters = static_cast<std::uint32_t>(cursor.number(4));
  chunk.address = cursor.number(8);
  if (!cursor.done()) return std::nullopt;
  return chunk;
}

bool has_required_filters(ByteView filters, Element element) noexcept {
  constexpr std::array<std::uint64_t, 3> kIds{2, 1, 3};  // shuffle, deflate, fletcher32
  const std::size_t first = element_bytes(element) == 1 ? 1 : 0;
  Cursor cursor(filters);
  if (cursor.byte() != 2 || cursor.byte() != kIds.size() - first) return false;
  for (std::size_t i = first; i < kIds.size(); ++i) {
    if (cursor.number(2) != kIds[i]) return false;
    cursor.number(2);  // flags
    cursor.take(4 * cursor.number(2));
  }
  return cursor.done();
}

}  // namespace sqmap::io
