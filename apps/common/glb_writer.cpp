// SPDX-License-Identifier: Apache-2.0
#include "glb_writer.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include <nlohmann/json.hpp>

#include "sqmap/asset/version.hpp"

namespace sqmap::apps {
namespace {

using Json = nlohmann::ordered_json;

static_assert(std::endian::native == std::endian::little,
              "glTF buffers are little-endian and copied as they are");

// Constants of the glTF 2.0 specification.
constexpr std::uint32_t kMagic = 0x46546C67;      // "glTF"
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;  // "JSON"
constexpr std::uint32_t kBinChunk = 0x004E4942;   // "BIN"
constexpr int kFloat = 5126, kUnsignedInt = 5125, kArrayBuffer = 34962, kElementArrayBuffer = 34963;

void append_u32(std::vector<std::uint8_t>& bytes, std::uint32_t value) {
  for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<std::uint8_t>(value >> shift));
}

template <class T>
Json bounds(const std::vector<Vec3<T>>& points, bool upper) {
  Json result = Json::array();
  for (int axis = 0; axis < 3; ++axis) {
    const auto less = [axis](const Vec3<T>& a, const Vec3<T>& b) { return a[axis] < b[axis]; };
    const auto found =
        upper ? std::ranges::max_element(points, less) : std::ranges::min_element(points, less);
    result.push_back((*found)[axis]);
  }
  return result;
}

}  // namespace

struct GlbScene::Document {
  Json nodes = Json::array(), meshes = Json::array(), materials = Json::array();
  Json accessors = Json::array(), views = Json::array();
  std::vector<std::uint8_t> buffer;

  /// Appends an array to the buffer; returns its accessor.
  template <class T>
  std::size_t add_accessor(const std::vector<T>& values, int target, Json accessor) {
    const std::size_t offset = buffer.size(), size = values.size() * sizeof(T);
    buffer.resize(offset + size);
    std::memcpy(buffer.data() + offset, values.data(), size);
    accessor["bufferView"] = views.size();
    views.push_back({{"buffer", 0}, {"byteOffset", offset}, {"byteLength", size}, {"target", target}});
    accessors.push_back(std::move(accessor));
    return accessors.size() - 1;
  }

  std::size_t add_node(std::size_t parent, Json node) {
    nodes.push_back(std::move(node));
    nodes[parent]["children"].push_back(nodes.size() - 1);
    return nodes.size() - 1;
  }
};

GlbScene::GlbScene() : document_(std::make_unique<Document>()) {
  // A quarter turn about x takes z up to y up.
  const double half = std::sqrt(0.5);
  document_->nodes.push_back({{"name", "object (z up, metres)"}, {"rotation", {-half, 0.0, 0.0, half}}});
}
GlbScene::~GlbScene() = default;

std::size_t GlbScene::add_group(const std::string& name) {
  return document_->add_node(kRoot, {{"name", name}});
}

void GlbScene::add_mesh(std::size_t group, const std::string& name, const TriangleSurface& surface,
                        const Color& color, const Pose& pose) {
  if (surface.triangles.empty()) return;
  Document& d = *document_;
  Json material{{"name", name},
                {"pbrMetallicRoughness",
                 {{"baseColorFactor", color}, {"metallicFactor", 0.0}, {"roughnessFactor", 0.8}}},
                {"doubleSided", true}};
  if (color[3] < 1) material["alphaMode"] = "BLEND";
  d.materials.push_back(std::move(material));

  const std::size_t count = surface.points_m.size();
  Json attributes;
  attributes["POSITION"] = d.add_accessor(surface.points_m, kArrayBuffer,
                                          {{"componentType", kFloat},
                                           {"count", count},
                                           {"type", "VEC3"},
                                           {"min", bounds(surface.points_m, false)},
                                           {"max", bounds(surface.points_m, true)}});
  if (!surface.normals.empty())
    attributes["NORMAL"] = d.add_accessor(surface.normals, kArrayBuffer,
                                          {{"componentType", kFloat}, {"count", count}, {"type", "VEC3"}});
  const std::size_t indices = d.add_accessor(
      surface.triangles, kElementArrayBuffer,
      {{"componentType", kUnsignedInt}, {"count", 3 * surface.triangles.size()}, {"type", "SCALAR"}});
  Json primitive{{"attributes", attributes}, {"indices", indices}, {"material", d.materials.size() - 1}};
  d.meshes.push_back({{"name", name}, {"primitives", Json::array({primitive})}});

  const Quaternion& q = pose.orientation;
  const double length = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  Json node{{"name", name}, {"mesh", d.meshes.size() - 1}};
  if (pose != Pose{}) {
    node["rotation"] = {q.x / length, q.y / length, q.z / length, q.w / length};
    node["translation"] = {pose.translation_m.x, pose.translation_m.y, pose.translation_m.z};
  }
  d.add_node(group, std::move(node));
}

Result<std::vector<std::uint8_t>> GlbScene::bytes() const {
  const Document& d = *document_;
  Json json{{"asset", {{"version", "2.0"}, {"generator", std::string("sqmap ") + kVersion}}},
            {"scene", 0},
            {"scenes", Json::array({{{"nodes", Json::array({0})}}})},
            {"nodes", d.nodes}};
  if (!d.meshes.empty()) {
    json["meshes"] = d.meshes;
    json["materials"] = d.materials;
    json["accessors"] = d.accessors;
    json["bufferViews"] = d.views;
    json["buffers"] = Json::array({{{"byteLength", d.buffer.size()}}});
  }
  std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const std::size_t padded = (d.buffer.size() + 3) / 4 * 4;
  const std::size_t total = 12 + 8 + text.size() + (padded > 0 ? 8 + padded : 0);
  if (total > std::numeric_limits<std::uint32_t>::max())
    return Error{Status::kFileUnwritable, "the scene is larger than 4 GiB, the limit of GLB",
                 "export a coarser --map-level"};

  std::vector<std::uint8_t> bytes;
  bytes.reserve(total);
  append_u32(bytes, kMagic);
  append_u32(bytes, 2);
  append_u32(bytes, static_cast<std::uint32_t>(total));
  append_u32(bytes, static_cast<std::uint32_t>(text.size()));
  append_u32(bytes, kJsonChunk);
  bytes.insert(bytes.end(), text.begin(), text.end());
  if (padded > 0) {
    append_u32(bytes, static_cast<std::uint32_t>(padded));
    append_u32(bytes, kBinChunk);
    bytes.insert(bytes.end(), d.buffer.begin(), d.buffer.end());
    bytes.resize(total, 0);
  }
  return bytes;
}

GlbScene::Color part_color(std::size_t part, float opacity) {
  constexpr double kGoldenTurn = 0.6180339887498949;  // fraction of the colour circle between neighbours
  constexpr double kSaturation = 0.65, kValue = 0.9;
  const double hue = std::fmod(0.08 + kGoldenTurn * static_cast<double>(part), 1.0);
  GlbScene::Color color{0, 0, 0, opacity};
  for (std::size_t channel = 0; channel < 3; ++channel) {
    const double wave = std::abs(std::fmod(6 * hue + 6 - 2 * static_cast<double>(channel), 6.0) - 3) - 1;
    const double display = kValue * (1 - kSaturation + kSaturation * std::clamp(wave, 0.0, 1.0));
    color[channel] = static_cast<float>(std::pow(display, 2.2));  // glTF wants linear light
  }
  return color;
}

}  // namespace sqmap::apps
