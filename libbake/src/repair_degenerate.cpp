// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <utility>

#include "repair_steps.hpp"

namespace sqmap::bake {
namespace {

/// Turns edges in a mesh and keeps the neighbourhood of sides up to date.
class EdgeTurner {
 public:
  EdgeTurner(Mesh& mesh, const MeshScale& scale)
      : mesh_(mesh), scale_(scale), twin_(EdgeTable(mesh.faces, mesh.vertices_m.size()).twins(mesh.faces)) {}

  /// Removes the flat triangle A B M, M on its longest side A B, by turning that side in the quadrilateral it
  /// makes with the neighbour B A D: they become M A D and B M D, which cover the neighbour. False, and
  /// nothing done, where there is no neighbour or the outcome would be no better.
  bool dissolve(std::uint32_t face) {
    const std::uint32_t ab = longest_side(face), ba = twin_[ab];
    if (ba >= EdgeTable::kBlocked) return false;
    const std::uint32_t other = ba / 3;
    const std::uint32_t bm = next_side(ab), ma = previous_side(ab), ad = next_side(ba),
                        db = previous_side(ba);
    const std::uint32_t a = side_begin(mesh_.faces, ab), b = side_end(mesh_.faces, ab);
    const std::uint32_t m = side_begin(mesh_.faces, ma), d = side_begin(mesh_.faces, db);
    const Face mad{m, a, d}, bmd{b, m, d};
    if (m == d || are_joined(ma, d)) return false;
    if (has_no_area(mesh_, mad, scale_) || has_no_area(mesh_, bmd, scale_)) return false;

    const std::uint32_t beyond_bm = twin_[bm], beyond_ma = twin_[ma], beyond_ad = twin_[ad],
                        beyond_db = twin_[db];
    mesh_.faces[face] = mad;
    mesh_.faces[other] = bmd;
    mesh_.source_face[face] = mesh_.source_face[other];
    link(3 * face, beyond_ma);
    link(3 * face + 1, beyond_ad);
    link(3 * face + 2, 3 * other + 1);
    link(3 * other, beyond_bm);
    link(3 * other + 2, beyond_db);
    return true;
  }

 private:
  std::uint32_t longest_side(std::uint32_t face) const {
    const auto length = [&](std::uint32_t side) {
      return norm((1 / scale_.diagonal_m) * (mesh_.vertices_m[side_end(mesh_.faces, side)] -
                                             mesh_.vertices_m[side_begin(mesh_.faces, side)]));
    };
    std::uint32_t longest = 3 * face;
    for (const std::uint32_t side : {3 * face + 1, 3 * face + 2})
      if (length(side) > length(longest)) longest = side;
    return longest;
  }

  /// Whether an edge joins the first vertex of `side` with d, among the faces round that vertex.
  bool are_joined(std::uint32_t side, std::uint32_t d) const {
    for (const bool forward : {true, false}) {
      std::uint32_t at = side;  // always begins at the vertex
      do {
        if (side_end(mesh_.faces, at) == d || side_begin(mesh_.faces, previous_side(at)) == d) return true;
        const std::uint32_t across = forward ? twin_[previous_side(at)] : twin_[at];
        if (across >= EdgeTable::kBlocked) break;
        at = forward ? across : next_side(across);
      } while (at != side);
    }
    return false;
  }

  void link(std::uint32_t side, std::uint32_t other) {
    twin_[side] = other;
    if (other < EdgeTable::kBlocked) twin_[other] = side;
  }

  Mesh& mesh_;
  const MeshScale& scale_;
  std::vector<std::uint32_t> twin_;
};

}  // namespace

std::uint32_t remove_zero_area(Mesh& mesh, const MeshScale& scale) {
  std::vector<std::uint32_t> flat;
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f)
    if (has_no_area(mesh, mesh.faces[f], scale)) flat.push_back(f);
  if (flat.empty()) return 0;
  const auto from_file = static_cast<std::uint32_t>(
      std::ranges::count_if(flat, [&](std::uint32_t f) { return mesh.source_face[f] != kNewFace; }));

  // Rows of collinear points make rows of flat triangles, each of which can go once its neighbour has gone. A
  // turned edge leaves one flat triangle fewer, so this ends; the limit bounds the time for a hostile mesh.
  constexpr int kMaxPasses = 200;
  EdgeTurner turner(mesh, scale);
  for (int pass = 0; pass < kMaxPasses; ++pass)
    if (std::erase_if(flat, [&](std::uint32_t f) { return turner.dissolve(f); }) == 0) break;

  std::vector<bool> keep(mesh.faces.size(), true);
  for (const std::uint32_t f : flat) keep[f] = false;
  keep_faces(mesh, keep);
  return from_file;
}

}  // namespace sqmap::bake
