// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <memory>
#include <span>

#include "model.hpp"

namespace sqmap::bench {

/// An OBB tree of the object against one of a mesh that changes its shape.
class SheetTree {
 public:
  virtual ~SheetTree() = default;
  /// Takes the new places of the mesh's vertices, object frame, and counts the pairs that cross.
  virtual std::size_t contacts(std::span<const Vec3d> places_m) const = 0;
};

enum class TreeUpdate { kRefit, kRebuild };  ///< fits the volumes again, or the whole tree
std::unique_ptr<SheetTree> make_fcl_sheet(const Model& model, const bake::Mesh& sheet, TreeUpdate update);

}  // namespace sqmap::bench
