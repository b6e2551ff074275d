// SPDX-License-Identifier: GPL-3.0-or-later
//
// A mesh file, then check and repair: OFF and PLY, which libbake reads itself, and OBJ, STL and GLB, which
// assimp does. The first byte of the input chooses the format and the policy.
#include <array>
#include <cmath>
#include <cstring>
#include <string>
#include <string_view>

#include "sqmap/bake/mesh.hpp"

#include "formats/bundle_bytes.hpp"
#include "fuzz/target.hpp"

namespace {

constexpr std::string_view kOff =
    "0OFF\n# a comment\n5 6 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0\n"
    "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n4 0 1 2 3\n3 0 0 4\n";
constexpr std::string_view kPly =
    "1ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty double z\n"
    "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";

constexpr std::string_view kObj =
    "2# a tetrahedron\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 -1\nvt 0 0\ng a\n"
    "f 1/1/1 3/1/1 2/1/1\nf 1 2 4\nf 1//1 4//1 3//1\ns off\nf -3 -2 -1\n";
constexpr std::string_view kAsciiStl =
    "3solid a\nfacet normal 0 0 -1\nouter loop\nvertex 0 0 0\nvertex 0 1 0\nvertex 1 0 0\nendloop\nendfacet\n"
    "facet normal 0 -1 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 0 1\nendloop\nendfacet\n"
    "endsolid a\n";

using Triangle = std::array<std::array<float, 3>, 3>;
constexpr std::array<Triangle, 4> kTetrahedron{{{{{0, 0, 0}, {0, 1, 0}, {1, 0, 0}}},
                                                {{{0, 0, 0}, {1, 0, 0}, {0, 0, 1}}},
                                                {{{0, 0, 0}, {0, 0, 1}, {0, 1, 0}}},
                                                {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}}};

/// Appends a number as it lies in memory: little-endian.
template <class Number>
void append(std::string& bytes, Number number) {
  std::array<char, sizeof number> raw{};
  std::memcpy(raw.data(), &number, sizeof number);
  bytes.append(raw.data(), raw.size());
}

void append(std::string& bytes, const Triangle& corners) {
  for (const auto& corner : corners)
    for (const float x : corner) append(bytes, x);
}

sqmap::fuzz::Bytes binary_stl() {
  std::string bytes = "3";
  bytes.resize(1 + 80);
  append(bytes, static_cast<std::uint32_t>(kTetrahedron.size()));
  for (const Triangle& corners : kTetrahedron) {
    for (int k = 0; k < 3; ++k) append(bytes, 0.0F);  // normal
    append(bytes, corners);
    append(bytes, std::uint16_t{0});
  }
  return {bytes.begin(), bytes.end()};
}

/// One mesh of four triangles without indices.
sqmap::fuzz::Bytes glb() {
  std::string json =
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],)"
      R"("accessors":[{"bufferView":0,"componentType":5126,"count":12,"type":"VEC3","min":[0,0,0],"max":[1,1,1]}],)"
      R"("bufferViews":[{"buffer":0,"byteLength":144}],"buffers":[{"byteLength":144}]})";
  json.resize((json.size() + 3) / 4 * 4, ' ');
  constexpr std::uint32_t kHeader = 12, kChunkHeader = 8, kBinary = 144;
  const auto json_size = static_cast<std::uint32_t>(json.size());
  std::string bytes = "4glTF";
  append(bytes, std::uint32_t{2});
  append(bytes, kHeader + kChunkHeader + json_size + kChunkHeader + kBinary);
  append(bytes, json_size);
  bytes += "JSON" + json;
  append(bytes, kBinary);
  bytes.append("BIN\0", 4);
  for (const Triangle& corners : kTetrahedron) append(bytes, corners);
  return {bytes.begin(), bytes.end()};
}

/// By the first byte of the input.
constexpr std::array<const char*, 5> kFormats{"off", "ply", "obj", "stl", "glb"};

sqmap::fuzz::Bytes binary_ply() {
  constexpr std::string_view kHeader =
      "1ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property float z\nelement face 1\nproperty list uchar uint vertex_indices\nend_header\n";
  sqmap::fuzz::Bytes bytes(kHeader.begin(), kHeader.end());
  constexpr std::uint8_t kOne[] = {0, 0, 0x80, 0x3F};
  for (int k = 0; k < 9; ++k) {
    const bool is_one = k == 3 || k == 7;
    for (const std::uint8_t byte : kOne) bytes.push_back(is_one ? byte : 0);
  }
  bytes.push_back(3);
  for (std::uint8_t k = 0; k < 3; ++k) bytes.insert(bytes.end(), {k, 0, 0, 0});
  return bytes;
}

}  // namespace

std::vector<sqmap::fuzz::Bytes> sqmap::fuzz::seeds() {
  return {{kOff.begin(), kOff.end()},
          {kPly.begin(), kPly.end()},
          binary_ply(),
          {kObj.begin(), kObj.end()},
          {kAsciiStl.begin(), kAsciiStl.end()},
          binary_stl(),
          glb()};
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sqmap;
  if (size < 1) return 0;
  static const test::TemporaryFolder kFolder;
  // From '0' on, so that seeds begin with a digit.
  const std::size_t choice = data[0] >= '0' ? data[0] - std::size_t{'0'} : data[0];
  const std::string path = kFolder.path() + "/mesh." + kFormats[choice % kFormats.size()];
  test::store(path, fuzz::Bytes(data + 1, data + size));
  const auto source = bake::read_mesh(path);
  if (!source) {
    fuzz::require(!source.error().finding.empty(), "a refusal says what was found");
    return 0;
  }
  for (const auto& face : source.value().mesh.faces)
    for (const std::uint32_t v : face)
      fuzz::require(v < source.value().mesh.vertices_m.size(), "faces name vertices that there are");
  bake::RepairOptions options;
  options.policy = static_cast<bake::Repair>(choice / kFormats.size() % 3);
  const auto prepared = bake::check_and_repair(source.value(), options);
  if (!prepared) return 0;
  const bake::Mesh& mesh = prepared.value().mesh;
  fuzz::require(!mesh.faces.empty() && mesh.source_face.size() == mesh.faces.size() &&
                    prepared.value().component.size() == mesh.faces.size(),
                "a prepared mesh has faces, and knows where each comes from");
  for (const auto& face : mesh.faces) {
    for (const std::uint32_t v : face)
      fuzz::require(v < mesh.vertices_m.size(), "faces name vertices that there are");
    fuzz::require(face[0] != face[1] && face[1] != face[2] && face[2] != face[0], "no face repeats a vertex");
  }
  for (const Vec3d& v : mesh.vertices_m)
    fuzz::require(std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z), "vertices are finite");
  return 0;
}
