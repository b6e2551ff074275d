// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "sqmap/bake/mesh.hpp"

#include "support/shapes.hpp"

namespace sqmap::bake {
namespace {

namespace fs = std::filesystem;
using namespace std::string_literals;

/// A folder of its own for each test.
class MeshIo : public testing::Test {
 protected:
  MeshIo() {
    folder_ = fs::path(testing::TempDir()) /
              ("sqmap_"s + testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~MeshIo() override { fs::remove_all(folder_); }

  fs::path write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return folder_ / name;
  }
  /// Reads a file that must be good.
  SourceMesh read(const std::string& name, const std::string& bytes, const ReadOptions& options = {}) const {
    Result<SourceMesh> source = read_mesh(write(name, bytes), options);
    EXPECT_TRUE(source.ok()) << source.error().finding;
    return source.ok() ? std::move(source).value() : SourceMesh{};
  }
  void expect_error(const fs::path& path, Status status, const std::string& finding) const {
    const Result<SourceMesh> source = read_mesh(path);
    ASSERT_FALSE(source.ok()) << path;
    EXPECT_EQ(source.error().status, status) << source.error().finding;
    EXPECT_NE(source.error().finding.find(finding), std::string::npos)
        << "found:  " << source.error().finding << "\nwanted: " << finding;
    EXPECT_FALSE(source.error().remedy.empty());
  }

  fs::path folder_;
};

const std::string kTetraOff = "OFF\n4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n";

/// A box of 2 x 4 x 6 with quadrilaterals.
const std::string kBoxOff =
    "OFF\n8 6 12\n-1 -2 -3\n1 -2 -3\n1 2 -3\n-1 2 -3\n-1 -2 3\n1 -2 3\n1 2 3\n-1 2 3\n"
    "4 0 3 2 1\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n";

template <class T>
std::string bytes_of(const T& value) {
  std::string bytes(sizeof value, '\0');
  std::memcpy(bytes.data(), &value, sizeof value);
  return bytes;
}

std::string binary_stl(const Mesh& mesh) {
  std::string bytes(80, ' ');
  bytes += bytes_of(static_cast<std::uint32_t>(mesh.faces.size()));
  for (const auto& face : mesh.faces) {
    bytes += std::string(12, '\0');
    for (const std::uint32_t v : face)
      for (int axis = 0; axis < 3; ++axis) bytes += bytes_of(static_cast<float>(mesh.vertices_m[v][axis]));
    bytes += std::string(2, '\0');
  }
  return bytes;
}

std::string gltf(const std::string& uri, const std::string& node) {
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[)" + node +
         R"(],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
"buffers":[{"uri":")" +
         uri + R"(","byteLength":72}],
"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":24}],
"accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,1]},
{"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}]})";
}

std::string tetra_buffer() {
  std::string bytes;
  for (const float x : {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}) bytes += bytes_of(x);
  for (const std::uint16_t i : {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3}) bytes += bytes_of(i);
  return bytes;
}

TEST_F(MeshIo, OffKeepsOrderNumbersAndDigits) {
  const std::string digits = "0.12345678901234567";
  const SourceMesh source = read("tetra.off", "OFF\n4 4 6\n" + digits + kTetraOff.substr(11));
  EXPECT_EQ(source.mesh.vertices_m[0].x, 0.12345678901234567);
  EXPECT_EQ(source.mesh.faces[2], (std::array<std::uint32_t, 3>{1, 2, 3}));
  EXPECT_EQ(source.mesh.source_face, (std::vector<std::uint32_t>{0, 1, 2, 3}));
  EXPECT_EQ(source.name, "tetra.off");
}

// The digits were printed by `xxhsum -H2`.
TEST_F(MeshIo, HashIsThatOfXxhsum) {
  EXPECT_EQ(read("tetra.off", kTetraOff).hash, "93859a5b90c2b231e5e91d0d6ae42898");
}

TEST_F(MeshIo, PolygonsKeepTheirNumber) {
  const SourceMesh source = read("box.off", kBoxOff);
  EXPECT_EQ(source.source_face_count, 6U);
  EXPECT_EQ(source.mesh.source_face, (std::vector<std::uint32_t>{0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5}));
  EXPECT_DOUBLE_EQ(test::signed_volume_m3(source.mesh), 48);
}

TEST_F(MeshIo, FaceRecordsWithoutAreaAreCountedButGiveNoTriangle) {
  const SourceMesh source = read("line.off", "OFF\n3 3 0\n0 0 0\n1 0 0\n0 1 0\n2 0 1\n3 0 1 2\n1 2\n");
  EXPECT_EQ(source.source_face_count, 3U);
  EXPECT_EQ(source.mesh.source_face, (std::vector<std::uint32_t>{1}));
}

// A star of ten corners in a tilted plane. All its triangles look the same way, as those of a fan would not,
// and together have the area of the outline.
TEST_F(MeshIo, ConcavePolygonsAreCutInside) {
  std::string vertices, face = "10";
  double area = 0, previous_x = 0, previous_y = 0;
  for (int i = 0; i <= 10; ++i) {
    const double angle_rad = i * 0.2 * 3.14159265358979, r = i % 2 == 0 ? 1 : 0.3;
    const double x = r * std::cos(angle_rad), y = r * std::sin(angle_rad);
    if (i > 0) area += 0.5 * (previous_x * y - previous_y * x);
    previous_x = x;
    previous_y = y;
    if (i == 10) break;
    vertices += std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(2 * x - y) + "\n";
    face += " " + std::to_string((i + 1) % 10);  // begins at an inner corner
  }
  const Mesh mesh = read("star.off", "OFF\n10 1 0\n" + vertices + face + "\n").mesh;
  ASSERT_EQ(mesh.faces.size(), 8U);
  double projected_area = 0;
  for (const auto& [a, b, c] : mesh.faces) {
    const double part =
        cross(mesh.vertices_m[b] - mesh.vertices_m[a], mesh.vertices_m[c] - mesh.vertices_m[a]).z / 2;
    EXPECT_GT(part, 0);
    projected_area += part;
  }
  EXPECT_NEAR(projected_area, area, 1e-5);  // to_string rounds to six digits
}

TEST_F(MeshIo, OffPrefixesCommentsColoursAndLineEndsChangeNothing) {
  const Mesh plain = read("plain.off", kTetraOff).mesh;
  const std::string faces = "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n";
  std::string cr_only = kTetraOff;
  std::ranges::replace(cr_only, '\n', '\r');
  const std::string variants[] = {
      "# made by hand\nOFF # here\n\n4 4 6\n# corners\n0 0 0\n1 0 0 # x\n0 1 0\n0 0 1\n" + faces,
      "COFF\n4 4 6\n0 0 0 255 0 0 255\n1 0 0 0 255 0 255\n0 1 0 0 0 255 255\n0 0 1 9 9 9 255\n" + faces,
      "NOFF\n4 4 6\n0 0 0 1 0 0\n1 0 0 1 0 0\n0 1 0 1 0 0\n0 0 1 1 0 0\n" + faces,
      "STCNOFF 4 4 6\n0 0 0 1 0 0 .1 .2 .3 1 0 1\n1 0 0\n0 1 0\n0 0 1\n" + faces,
      "\xEF\xBB\xBFOFF\n4 4\n0 0 0\n+1 0 0\n0 1e0 0\n0 0 1.\n3 0 2 1 255 0 0\n3 0 1 3 7\n3 1 2 3\n3 2 0 3",
      "OFF\r\n4 4 6\r\n0 0 0\r\n1 0 0\r\n0 1 0\r\n0 0 1\r\n3 0 2 1\r\n3 0 1 3\r\n3 1 2 3\r\n3 2 0 3\r\n",
      cr_only,
  };
  for (const std::string& text : variants) {
    const Mesh mesh = read("variant.off", text).mesh;
    EXPECT_EQ(mesh.vertices_m, plain.vertices_m) << text;
    EXPECT_EQ(mesh.faces, plain.faces) << text;
  }
}

TEST_F(MeshIo, PlyReadsTextAndBothByteOrders) {
  const std::string header =
      " 1.0\ncomment made by hand\nelement vertex 4\nproperty uchar red\nproperty float x\nproperty double "
      "y\n"
      "property float32 z\nelement edge 1\nproperty int vertex1\nelement face 4\nproperty list uchar int "
      "vertex_indices\n"
      "property short tag\nend_header\n";
  const std::string rows = "7 0 0 0\n7 1 0 0\n7 0 1 0\n7 0 0 1\n5\n";
  const SourceMesh text =
      read("text.ply", "ply\nformat ascii" + header + rows + "3 0 2 1 9\n3 0 1 3 9\n3 1 2 3 9\n3 2 0 3 9\n");
  EXPECT_DOUBLE_EQ(test::signed_volume_m3(text.mesh), 1.0 / 6);
  EXPECT_EQ(text.source_face_count, 4U);

  for (const bool is_big : {false, true}) {
    std::string data;
    const auto append = [&](auto value) {
      std::string bytes = bytes_of(value);
      if (is_big) std::ranges::reverse(bytes);
      data += bytes;
    };
    for (const Vec3d& p : text.mesh.vertices_m) {
      append(std::uint8_t{7});
      append(static_cast<float>(p.x));
      append(p.y);
      append(static_cast<float>(p.z));
    }
    append(std::int32_t{5});
    for (const auto& face : text.mesh.faces) {
      append(std::uint8_t{3});
      for (const std::uint32_t v : face) append(static_cast<std::int32_t>(v));
      append(std::int16_t{-9});
    }
    const std::string format = is_big ? "binary_big_endian" : "binary_little_endian";
    std::string file = "ply\nformat ";
    file.append(format).append(header).append(data);
    const Mesh mesh = read(format + ".ply", file).mesh;
    EXPECT_EQ(mesh.vertices_m, text.mesh.vertices_m);
    EXPECT_EQ(mesh.faces, text.mesh.faces);
  }
}

TEST_F(MeshIo, ObjKeepsPolygonsAndSkipsLines) {
  const SourceMesh source =
      read("box.obj",
           "v -1 -2 -3\nv 1 -2 -3\nv 1 2 -3\nv -1 2 -3\nv -1 -2 3\nv 1 -2 3\nv 1 2 3\nv -1 2 3\n"
           "l 1 7\nf 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n");
  EXPECT_EQ(source.source_face_count, 6U);
  EXPECT_EQ(source.mesh.faces.size(), 12U);
  EXPECT_DOUBLE_EQ(test::signed_volume_m3(source.mesh), 48);
}

TEST_F(MeshIo, StlReadsTextAndBinaryInTheOrderOfTheFile) {
  const Mesh tetra = read("tetra.off", kTetraOff).mesh;
  std::string text = "solid tetra\n";
  for (const auto& face : tetra.faces) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (const std::uint32_t v : face) {
      const Vec3d& p = tetra.vertices_m[v];
      text += "vertex " + std::to_string(p.x) + " " + std::to_string(p.y) + " " + std::to_string(p.z) + "\n";
    }
    text += "endloop\nendfacet\n";
  }
  text += "endsolid tetra\n";
  for (const SourceMesh& source : {read("text.stl", text), read("binary.stl", binary_stl(tetra))}) {
    ASSERT_EQ(source.source_face_count, 4U);
    for (std::size_t f = 0; f < 4; ++f)
      for (std::size_t k = 0; k < 3; ++k)
        EXPECT_EQ(source.mesh.vertices_m[source.mesh.faces[f][k]], tetra.vertices_m[tetra.faces[f][k]]);
  }
}

TEST_F(MeshIo, NodeTransformsAreAppliedAndMirrorsKeepTheOutside) {
  write("tetra.bin", tetra_buffer());
  const SourceMesh source =
      read("mirrored.gltf", gltf("tetra.bin", R"({"mesh":0,"scale":[-2,3,1],"translation":[10,0,0]})"));
  EXPECT_DOUBLE_EQ(test::signed_volume_m3(source.mesh), 1.0);
  for (const Vec3d& p_m : source.mesh.vertices_m) {
    EXPECT_LE(p_m.x, 10);
    EXPECT_GE(p_m.x, 8);
    EXPECT_LE(p_m.y, 3);
  }
}

TEST_F(MeshIo, ChildNodesAreChainedAndSharedMeshesRepeated) {
  write("tetra.bin", tetra_buffer());
  const SourceMesh source =
      read("instances.gltf",
           gltf("tetra.bin", R"({"scale":[2,2,2],"children":[1,2]},{"mesh":0,"translation":[1,0,0]},)"
                             R"({"mesh":0,"rotation":[0,0,1,0]})"));
  EXPECT_EQ(source.source_face_count, 8U);
  EXPECT_NEAR(test::signed_volume_m3(source.mesh), 2 * 8.0 / 6, 1e-12);
  double low_x = 0, high_x = 0;
  for (const Vec3d& p_m : source.mesh.vertices_m) {
    low_x = std::min(low_x, p_m.x);
    high_x = std::max(high_x, p_m.x);
  }
  EXPECT_NEAR(high_x, 4, 1e-6);  // 2 * (1 + 1)
  EXPECT_NEAR(low_x, -2, 1e-6);  // turned by half a turn about z
}

TEST_F(MeshIo, ScenesOpenNoFileOutsideTheirFolder) {
  write("secret.bin", tetra_buffer());
  fs::create_directories(folder_ / "scene");
  const fs::path path = write("scene/spy.gltf", gltf("../secret.bin", R"({"mesh":0})"));
  expect_error(path, Status::kInvalidMesh, "secret.bin");
  write("scene/secret.bin", tetra_buffer());
  EXPECT_TRUE(read_mesh(write("scene/good.gltf", gltf("secret.bin", R"({"mesh":0})"))).ok());
}

TEST_F(MeshIo, UpAxisIsTurnedToZWithoutMirroring) {
  for (const UpAxis up : {UpAxis::kX, UpAxis::kY, UpAxis::kZ}) {
    const int axis = static_cast<int>(up);
    const Mesh plain = read("box.off", kBoxOff).mesh;
    const SourceMesh source = read("box.off", kBoxOff, {.metres_per_unit = 0.5, .up = up});
    EXPECT_DOUBLE_EQ(test::signed_volume_m3(source.mesh), 48.0 / 8);
    for (std::size_t v = 0; v < 8; ++v)
      EXPECT_EQ(source.mesh.vertices_m[v].z, 0.5 * plain.vertices_m[v][axis]);
    EXPECT_EQ(source.up, up);
    EXPECT_EQ(source.metres_per_unit, 0.5);
  }
}

TEST_F(MeshIo, ErrorsNameWhatWasFound) {
  expect_error(folder_ / "none.off", Status::kFileMissing, "none.off\" does not exist");
  expect_error(folder_, Status::kFileUnreadable, "is a folder");
  ASSERT_EQ(mkfifo((folder_ / "pipe.off").c_str(), 0600), 0);
  expect_error(folder_ / "pipe.off", Status::kFileUnreadable, "is a pipe");
  expect_error(write("empty.ply", ""), Status::kInvalidMesh, "is empty");
  expect_error(write("mesh.xyz", "0 0 0"), Status::kUnknownFormat, "extension .xyz, need one of off obj ply");
  expect_error(write("mesh", "OFF"), Status::kUnknownFormat, "no extension");
  for (const char* name : {"r.obj", "r.stl", "r.gltf", "r.glb", "r.dae", "r.fbx", "r.3mf"})
    expect_error(write(name, "rubbish rubbish rubbish"), Status::kInvalidMesh, name);

  struct Case {
    std::string text, finding;
  };
  const std::string head = "OFF\n3 1 0\n0 0 0\n1 0 0\n";
  const Case cases[] = {
      {"rubbish", "line 1: found \"rubbish\", an OFF file begins with OFF"},
      {"4OFF 1 1 1\n", "\"4OFF\" files are not read"},
      {"OFF BINARY\n", "binary OFF is not read"},
      {"OFF\n-3 1 0\n", "line 2: the vertex count: found \"-3\""},
      {"OFF\n4000000000 1 0\n0 0 0\n", "declares 4000000000 vertices and 1 faces, but only 7 bytes follow"},
      {"OFF\n1 18446744073709551615 0\n0 0 0\n", "the face count: found"},
      {head + "0.000000000000 1.000000000000\n", "ends within vertex 2 of 3"},
      {head + "0 one 0\n3 0 1 2\n", "line 5: vertex 2 of 3: found \"one\", need a number"},
      {head + "0 nan 0\n3 0 1 2\n", "vertex 2 (counted from 0)"},
      {head + "0 1e999 0\n3 0 1 2\n", "that is infinite"},
      {head + "0 1e16 0\n3 0 1 2\n", "beyond 1e15 m"},
      {head + "0 1 0\n3 0 1 3\n", "line 6: face 0 of 1: vertex index 3, must be in [0, 3)"},
      {head + "0 1 0\n3 0 -1 2\n", "vertex index -1"},
      {head + "0 1 0\n3 0 1\n", "ends within face 0 of 1"},
      {head + "0 1 0\n999999999 0 1\n", "ends within face 0 of 1"},
      {"OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n", "has no faces (3 vertices)"},
  };
  for (const Case& c : cases) expect_error(write("bad.off", c.text), Status::kInvalidMesh, c.finding);

  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
  const std::string face = "element face 2\nproperty list uchar int vertex_indices\nend_header\n";
  const Case ply_cases[] = {
      {"plx\n", "does not begin"},
      {ply, "ends within the header"},
      {"ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\nproperty float "
       "z\n" +
           face,
       "declares 4000000000 elements \"vertex\""},
      {ply + face + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "ends within face 1 of 2"},
      {ply + face + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 7\n", "face 1: vertex index 7, must be below 3"},
      {ply + face + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 -7\n", "face 1: vertex index -7"},
      {ply + face + "0 0 0\n1 x 0\n0 1 0\n3 0 1 2\n3 0 1 2\n", "found \"x\" for a number in vertex 1"},
      {"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n", "no property y"},
  };
  for (const Case& c : ply_cases) expect_error(write("bad.ply", c.text), Status::kInvalidMesh, c.finding);
}

// assimp reads what the content says, and never ends on some PLY headers: its PLY reader is not asked.
TEST_F(MeshIo, PlyUnderAnotherNameIsNotReadByAssimp) {
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  EXPECT_TRUE(read_mesh(write("good.ply", ply)).ok());
  expect_error(write("good.glb", ply), Status::kInvalidMesh, "No suitable reader");
}

TEST_F(MeshIo, CutFilesAreRefusedNotHalfRead) {
  const std::string stl = binary_stl(test::sphere(1, 1));
  expect_error(write("cut.stl", stl.substr(0, stl.size() / 2)), Status::kInvalidMesh, "cut.stl");
  // Every beginning of an OFF file is refused, but for those that only lack the last line end or colours.
  const std::string whole = kTetraOff.substr(0, kTetraOff.size() - 1);
  for (std::size_t length = 1; length < whole.size(); ++length)
    EXPECT_FALSE(read_mesh(write("cut.off", whole.substr(0, length))).ok()) << length;
}

TEST_F(MeshIo, OptionsOutOfRangeAreRefused) {
  const fs::path path = write("tetra.off", kTetraOff);
  for (const double scale : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    const Result<SourceMesh> source = read_mesh(path, {.metres_per_unit = scale});
    ASSERT_FALSE(source.ok());
    EXPECT_EQ(source.error().status, Status::kBadOption);
  }
  const Result<SourceMesh> big = read_mesh(path, {.max_file_bytes = 10});
  ASSERT_FALSE(big.ok());
  EXPECT_EQ(big.error().status, Status::kFileUnreadable);
}

}  // namespace
}  // namespace sqmap::bake
