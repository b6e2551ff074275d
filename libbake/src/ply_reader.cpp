// SPDX-License-Identifier: GPL-3.0-or-later
// An own reader because assimp's invents the faces a truncated file lacks, allocates what the header claims
// and keeps coordinates in float. Format: G. Turk, The PLY Polygon File Format, 1994.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "polygon_mesh.hpp"
#include "words.hpp"

namespace sqmap::bake {
namespace {

struct Scalar {
  std::string_view name, other_name;
  char kind;  ///< i: signed, u: unsigned, f: floating point
  std::size_t bytes;
};
constexpr std::array<Scalar, 8> kScalars{{{"char", "int8", 'i', 1},
                                          {"uchar", "uint8", 'u', 1},
                                          {"short", "int16", 'i', 2},
                                          {"ushort", "uint16", 'u', 2},
                                          {"int", "int32", 'i', 4},
                                          {"uint", "uint32", 'u', 4},
                                          {"float", "float32", 'f', 4},
                                          {"double", "float64", 'f', 8}}};

struct Property {
  std::string_view name;
  std::optional<Scalar> count;  ///< type of a list's length; none: a single value
  Scalar value;
};

struct Element {
  std::string_view name;
  std::int64_t count = 0;
  std::vector<Property> properties;
};

enum class Encoding { kText, kLittleEndian, kBigEndian };

class PlyParser {
 public:
  PlyParser(std::string_view bytes, std::string_view name) : words_(bytes), name_(name) {}

  Result<PolygonMesh> parse() {
    if (Outcome header = read_header(); !header) return header.error();
    data_ = words_.rest();
    for (const Element& element : elements_)
      if (Outcome outcome = read_element(element); !outcome) return outcome.error();
    for (std::size_t p = 0; p < mesh_.polygon_end.size(); ++p)
      for (const std::uint32_t v : mesh_.polygon(p))
        if (v >= mesh_.vertices.size())
          return damaged("face " + std::to_string(p) + ": vertex index " + std::to_string(v) +
                         ", must be below " + std::to_string(mesh_.vertices.size()));
    return std::move(mesh_);
  }

 private:
  Error damaged(const std::string& what, const std::string& remedy = "export the mesh again") const {
    return {Status::kInvalidMesh, "\"" + name_ + "\": " + what, remedy};
  }
  Error cut_short(const std::string& what) const {
    return damaged(what, "the file is cut short: copy or export it again");
  }

  Outcome read_header() {
    if (words_.next_line() != "ply") return damaged("does not begin with a line \"ply\"");
    bool has_format = false;
    while (words_.bytes_left() > 0) {
      const std::string where = "header line " + std::to_string(words_.line()) + ": ";
      Words line(words_.next_line());
      const std::string_view keyword = line.next();
      if (keyword == "end_header")
        return has_format ? Outcome(Done{}) : Outcome(damaged("the header has no line \"format\""));
      if (keyword == "format") {
        const std::string_view encoding = line.next();
        if (encoding != "ascii" && encoding != "binary_little_endian" && encoding != "binary_big_endian")
          return damaged(where + "found format " + quoted(encoding) +
                         ", need ascii, binary_little_endian or binary_big_endian");
        encoding_ = encoding == "ascii"                  ? Encoding::kText
                    : encoding == "binary_little_endian" ? Encoding::kLittleEndian
                                                         : Encoding::kBigEndian;
        has_format = true;
      } else if (keyword == "element") {
        Element& element = elements_.emplace_back();
        element.name = line.next();
        if (!parse_integer(line.next(), element.count) || element.count < 0 ||
            element.count >= std::numeric_limits<std::uint32_t>::max())
          return damaged(where + "need a name and a count below 2^32 - 1 after \"element\"");
      } else if (keyword == "property") {
        if (elements_.empty()) return damaged(where + "a property before the first element");
        const std::optional<Property> property = parse_property(line);
        if (!property) return damaged(where + "need a type such as float or list uchar int, and a name");
        elements_.back().properties.push_back(*property);
      }  // comment, obj_info and what else writers have thought of
    }
    return cut_short("the file ends within the header");
  }

  static std::optional<Scalar> parse_scalar(std::string_view word) {
    for (const Scalar& scalar : kScalars)
      if (word == scalar.name || word == scalar.other_name) return scalar;
    return std::nullopt;
  }
  static std::optional<Property> parse_property(Words& line) {
    Property property{};
    std::string_view type = line.next();
    if (type == "list") {
      property.count = parse_scalar(line.next());
      if (!property.count || property.count->kind == 'f') return std::nullopt;
      type = line.next();
    }
    const std::optional<Scalar> value = parse_scalar(type);
    property.name = line.next();
    if (!value || property.name.empty()) return std::nullopt;
    property.value = *value;
    return property;
  }

  Outcome read_element(const Element& element) {
    if (element.properties.empty()) return Done{};
    // As for OFF, a count is believed only as far as the bytes that are left could hold it.
    std::size_t least_bytes = 0;
    for (const Property& property : element.properties)
      least_bytes += encoding_ == Encoding::kText ? 2
                     : property.count             ? property.count->bytes
                                                  : property.value.bytes;
    if (static_cast<std::size_t>(element.count) > (data_.size() + 1) / least_bytes)
      return cut_short("declares " + std::to_string(element.count) + " elements \"" +
                       std::string(element.name) + "\", but only " + std::to_string(data_.size()) +
                       " bytes follow");
    const bool is_vertex = element.name == "vertex", is_face = element.name == "face";
    if (is_vertex)
      for (const std::string_view axis : {"x", "y", "z"})
        if (std::ranges::none_of(element.properties,
                                 [&](const Property& p) { return p.name == axis && !p.count; }))
          return damaged("vertices have no property " + std::string(axis));

    for (std::int64_t i = 0; i < element.count; ++i) {
      const auto where = [&] { return std::string(element.name) + " " + std::to_string(i); };
      Vec3d position;
      for (const Property& property : element.properties) {
        double count = 1, value = 0;
        if (property.count && !read(*property.count, count)) return ended(where(), element);
        if (!(count >= 0) || count != std::floor(count))
          return damaged(where() + ": a list of length " + std::to_string(count));
        const bool is_polygon = is_face && property.count &&
                                (property.name == "vertex_indices" || property.name == "vertex_index");
        for (double k = 0; k < count; ++k) {
          if (!read(property.value, value)) return ended(where(), element);
          if (!is_polygon) continue;
          if (!(value >= 0) || value != std::floor(value) ||
              value >= std::numeric_limits<std::uint32_t>::max())
            return damaged(where() + ": vertex index " + std::to_string(value) +
                           ", must be a whole number >= 0");
          mesh_.corners.push_back(static_cast<std::uint32_t>(value));
        }
        if (is_polygon) mesh_.polygon_end.push_back(mesh_.corners.size());
        if (is_vertex && property.name.size() == 1 && property.name[0] >= 'x' && property.name[0] <= 'z')
          position[property.name[0] - 'x'] = value;
      }
      if (is_vertex) mesh_.vertices.push_back(position);
    }
    return Done{};
  }

  Error ended(const std::string& where, const Element& element) const {
    return cut_short(
        (bad_word_.empty() ? "the file ends within " : "found " + quoted(bad_word_) + " for a number in ") +
        where + " of " + std::to_string(element.count));
  }

  /// The next value; false at the end of the data, or for a word that is no number.
  bool read(const Scalar& type, double& value) {
    if (encoding_ == Encoding::kText) {
      Words words(data_);
      const std::string_view word = words.next();
      data_ = words.rest();
      if (!word.empty() && parse_number(word, value)) return true;
      bad_word_ = word;
      return false;
    }
    if (data_.size() < type.bytes) return false;
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < type.bytes; ++i) {
      const std::size_t at = encoding_ == Encoding::kBigEndian ? i : type.bytes - 1 - i;
      bits = bits << 8 | static_cast<unsigned char>(data_[at]);
    }
    data_.remove_prefix(type.bytes);
    if (type.kind == 'f') {
      value = type.bytes == 8 ? std::bit_cast<double>(bits)
                              : static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
      return true;
    }
    const bool is_negative = type.kind == 'i' && (bits >> (8 * type.bytes - 1) & 1) != 0;
    value = static_cast<double>(bits) - (is_negative ? std::exp2(8.0 * static_cast<double>(type.bytes)) : 0);
    return true;
  }

  Words words_;
  std::string name_;
  Encoding encoding_ = Encoding::kText;
  std::vector<Element> elements_;
  std::string_view data_;
  std::string_view bad_word_;
  PolygonMesh mesh_;
};

}  // namespace

Result<PolygonMesh> parse_ply(std::string_view bytes, std::string_view name) {
  return PlyParser(bytes, name).parse();
}

}  // namespace sqmap::bake
