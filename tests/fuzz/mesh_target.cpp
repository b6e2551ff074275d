// SPDX-License-Identifier: GPL-3.0-or-later
//
// A mesh file of the two formats that libbake reads itself, then check and repair. The first byte of the
// input chooses the format and the policy.
#include <cmath>
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
  return {{kOff.begin(), kOff.end()}, {kPly.begin(), kPly.end()}, binary_ply()};
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sqmap;
  if (size < 1) return 0;
  static const test::TemporaryFolder kFolder;
  const std::string path = kFolder.path() + (data[0] % 2 == 0 ? "/mesh.off" : "/mesh.ply");
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
  options.policy = static_cast<bake::Repair>((data[0] / 2) % 3);
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
