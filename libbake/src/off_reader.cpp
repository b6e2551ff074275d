// SPDX-License-Identifier: GPL-3.0-or-later
// An own reader because assimp's knows neither the prefixes of OFF (COFF, NOFF, STOFF) nor comments, and
// keeps coordinates in float. Format: http://www.geomview.org/docs/html/OFF.html
#include <limits>
#include <string>
#include <utility>

#include "polygon_mesh.hpp"
#include "words.hpp"

namespace sqmap::bake {
namespace {

class OffParser {
 public:
  OffParser(std::string_view text, std::string_view name) : words_(text), name_(name) {}

  Result<PolygonMesh> parse() {
    if (Outcome header = read_header(); !header) return header.error();
    if (Outcome vertices = read_vertices(); !vertices) return vertices.error();
    if (Outcome faces = read_faces(); !faces) return faces.error();
    return std::move(mesh_);
  }

 private:
  Error damaged(const std::string& what, const std::string& remedy = "export the mesh again") const {
    return {Status::kInvalidMesh, "\"" + name_ + "\", line " + std::to_string(words_.line()) + ": " + what,
            remedy};
  }
  Error unexpected(std::string_view word, const std::string& where, const std::string& wanted) const {
    if (word.empty())
      return damaged("the file ends within " + where,
                     "the file is cut short, or has more than one vertex or face a line: export it again");
    return damaged(where + ": found " + quoted(word) + ", need " + wanted);
  }

  Outcome read_header() {
    const std::string_view keyword = words_.next();
    std::string_view prefix = keyword;
    if (!prefix.ends_with("OFF"))
      return damaged("found " + quoted(keyword) + ", an OFF file begins with OFF");
    prefix.remove_suffix(3);
    for (const std::string_view known : {"ST", "C", "N"})
      if (prefix.starts_with(known)) prefix.remove_prefix(known.size());
    if (!prefix.empty())
      return damaged(quoted(keyword) + " files are not read, only OFF with the prefixes ST, C and N",
                     "export with three coordinates a vertex");
    std::string_view word = words_.next();
    if (word == "BINARY") return damaged("binary OFF is not read", "export it as text");
    if (!parse_integer(word, vertex_count_) || vertex_count_ < 0)
      return unexpected(word, "the vertex count", "a count");
    word = words_.next();
    if (!parse_integer(word, face_count_) || face_count_ < 0)
      return unexpected(word, "the face count", "a count");
    words_.skip_line();  // the edge count, which some writers leave out

    // Counts are believed only as far as the bytes that follow could hold them, so that none of them makes us
    // allocate more than a few times the file: "0 0 0\n" is the shortest vertex, "0\n" the shortest face.
    const std::size_t bytes = words_.bytes_left() + 1;
    const auto vertices = static_cast<std::size_t>(vertex_count_),
               faces = static_cast<std::size_t>(face_count_);
    if (vertices > bytes / 6 || faces > (bytes - 6 * vertices) / 2)
      return damaged("declares " + std::to_string(vertices) + " vertices and " + std::to_string(faces) +
                         " faces, but only " + std::to_string(bytes - 1) + " bytes follow",
                     "the file is cut short: copy or export it again");
    if (vertices >= std::numeric_limits<std::uint32_t>::max() ||
        faces >= std::numeric_limits<std::uint32_t>::max())
      return damaged("declares " + std::to_string(vertices) + " vertices and " + std::to_string(faces) +
                         " faces, must each be below 2^32 - 1",
                     "simplify the mesh");
    return Done{};
  }

  Outcome read_vertices() {
    mesh_.vertices.resize(static_cast<std::size_t>(vertex_count_));
    for (std::size_t v = 0; v < mesh_.vertices.size(); ++v) {
      for (int axis = 0; axis < 3; ++axis) {
        const std::string_view word = words_.next();
        if (!parse_number(word, mesh_.vertices[v][axis]))
          return unexpected(word, "vertex " + std::to_string(v) + " of " + std::to_string(vertex_count_),
                            "a number");
      }
      words_.skip_line();  // normal, colour, texture coordinates
    }
    return Done{};
  }

  Outcome read_faces() {
    mesh_.polygon_end.reserve(static_cast<std::size_t>(face_count_));
    for (std::int64_t f = 0; f < face_count_; ++f) {
      const auto where = [&] { return "face " + std::to_string(f) + " of " + std::to_string(face_count_); };
      std::string_view word = words_.next();
      std::int64_t corner_count = 0;
      if (!parse_integer(word, corner_count) || corner_count < 0)
        return unexpected(word, where(), "the number of its corners");
      for (std::int64_t i = 0; i < corner_count; ++i) {
        std::int64_t vertex = 0;
        word = words_.next();
        if (!parse_integer(word, vertex)) return unexpected(word, where(), "a vertex index");
        if (vertex < 0 || vertex >= vertex_count_)
          return damaged(where() + ": vertex index " + std::to_string(vertex) + ", must be in [0, " +
                         std::to_string(vertex_count_) + ")");
        mesh_.corners.push_back(static_cast<std::uint32_t>(vertex));
      }
      mesh_.polygon_end.push_back(mesh_.corners.size());
      words_.skip_line();  // colour
    }
    return Done{};
  }

  Words words_;
  std::string name_;
  std::int64_t vertex_count_ = 0, face_count_ = 0;
  PolygonMesh mesh_;
};

}  // namespace

Result<PolygonMesh> parse_off(std::string_view text, std::string_view name) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);  // byte order mark of UTF-8
  return OffParser(text, name).parse();
}

}  // namespace sqmap::bake
