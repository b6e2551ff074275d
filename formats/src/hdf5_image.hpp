// SPDX-License-Identifier: Apache-2.0
//
// The part of the HDF5 file format that a bundle uses (FORMAT.md section 4), read without the HDF5 library:
// version 1.10 crashes on damaged metadata, and whoever makes a bundle to harm can give damage a correct
// checksum. All views point into the bundle; nothing is read beyond it, and no size that it declares is
// allocated by.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sqmap/asset/result.hpp"

#include "tables.hpp"

namespace sqmap::io {

using ByteView = std::span<const std::uint8_t>;

/// Largest object header, all its blocks together: twice what the texts that rule 4 allows can take.
inline constexpr std::uint64_t kMaxHeaderBytes = std::uint64_t{128} * 1024;

/// Address of the root group. Errors: kInvalidAsset for a superblock other than FORMAT.md section 4's.
Result<std::uint64_t> root_address(ByteView bundle);

/// One object header: a group or a dataset.
class ObjectHeader {
 public:
  /// Reads version 2 headers with their continuation blocks. Errors: kInvalidAsset, beginning with `where`,
  /// for blocks that do not lie in the file or exceed kMaxHeaderBytes, and for messages that a bundle does
  /// not use.
  static Result<ObjectHeader> read(ByteView bundle, std::uint64_t address, const std::string& where);

  enum class LinkKind : std::uint8_t { kNone, kHard, kOther };
  struct Link {
    LinkKind kind = LinkKind::kNone;
    std::uint64_t address{};  ///< of the object's header, where kHard
  };
  /// kOther also for a name that is there twice.
  Link link(std::string_view name) const noexcept;

  /// Type, shape and bytes of a value as messages encode them.
  struct Value {
    ByteView type, space, data;
  };
  /// Nothing where the attribute is not there, is there twice or is not encoded as a bundle's are.
  std::optional<Value> attribute(std::string_view name) const noexcept;
  bool has_attribute(std::string_view name) const noexcept;

  /// The one message of a kind, of which a dataset has each; nothing where there is none or there are
  /// several.
  enum class Kind : std::uint8_t { kSpace = 0x01, kType = 0x03, kLayout = 0x08, kFilters = 0x0B };
  std::optional<ByteView> message(Kind kind) const noexcept;

 private:
  struct Message {
    std::uint8_t type;
    ByteView body;
  };
  std::vector<Message> messages_;
};

/// Whether an encoded type is the one that FORMAT.md gives an element.
bool is_type(ByteView type, Element element) noexcept;
/// Bytes of a null-padded UTF-8 string; nothing for any other type.
std::optional<std::uint32_t> text_bytes(ByteView type) noexcept;

struct Shape {
  std::size_t rank{};  ///< at most 2; 0: a scalar
  std::array<std::uint64_t, 2> size{1, 1};
  friend bool operator==(const Shape&, const Shape&) = default;
};
/// Nothing for more than two dimensions and for null spaces.
std::optional<Shape> shape_of(ByteView space) noexcept;

/// A dataset stored as one chunk of its own shape.
struct SingleChunk {
  std::uint64_t address{}, stored_bytes{};
  std::uint32_t skipped_filters{};
};
/// Nothing for any other storage.
std::optional<SingleChunk> single_chunk(ByteView layout, const Shape& shape, Element element) noexcept;

/// Whether an encoded pipeline is shuffle (not for single bytes), deflate, fletcher32.
bool has_required_filters(ByteView filters, Element element) noexcept;

/// `size` bytes at an HDF5 address; nothing where they do not lie in the file.
std::optional<ByteView> bytes_at(ByteView bundle, std::uint64_t address, std::uint64_t size) noexcept;

}  // namespace sqmap::io
