// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "sqmap/asset/result.hpp"
#include "sqmap/asset/vec.hpp"

#include "part_surface.hpp"

namespace sqmap::apps {

/// A scene of named groups of named, coloured meshes, written as binary glTF 2.0. The object frame has z up;
/// a root node turns it to glTF's y up.
class GlbScene {
 public:
  /// Linear red, green, blue in [0, 1] and opacity; below 1 is drawn translucent.
  using Color = std::array<float, 4>;

  GlbScene();
  ~GlbScene();
  GlbScene(GlbScene&&) = delete;

  /// A node below the root; returns its number.
  std::size_t add_group(const std::string& name);
  /// A mesh below a group, or below the root for kRoot. A surface without triangles adds nothing: glTF has no
  /// empty mesh.
  void add_mesh(std::size_t group, const std::string& name, const TriangleSurface& surface,
                const Color& color, const Pose& pose = {});
  static constexpr std::size_t kRoot = 0;

  /// The file. Errors: kFileUnwritable beyond 4 GiB, the format's limit.
  Result<std::vector<std::uint8_t>> bytes() const;

 private:
  struct Document;
  std::unique_ptr<Document> document_;
};

/// Colours that neighbours in number do not share: hues a golden angle apart.
GlbScene::Color part_color(std::size_t part, float opacity);

}  // namespace sqmap::apps
