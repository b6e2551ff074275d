// SPDX-License-Identifier: GPL-3.0-or-later
#include "refine.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <tbb/parallel_for.h>

#include "measure.hpp"
#include "part_builder.hpp"

namespace sqmap::bake {

namespace {

constexpr std::uint32_t kDraftQuadrantCells = 16;
constexpr std::uint32_t kShellPoints = 4000;
// Half width of the shell the partition is judged in, and the cap of one point's error, as shares of R_max.
constexpr double kShellWidth = 0.01;
constexpr double kWorstError = 0.02;
// Parts with at least this share of the worst part's error are split in the same round.
constexpr double kRoundShare = 0.7;

Result<Piece> make_piece(const SolidSet& set, Cell cell, const MeshQueries& queries,
                         const FitOptions& options) {
  auto part = fit_part(set, cell, options);
  if (!part) return part.error();
  Piece piece{std::move(cell), std::move(part).value()};
  draft_map(piece.part, queries, kDraftQuadrantCells);
  return piece;
}

std::vector<std::uint32_t> part_of_face(const std::vector<Piece>& pieces, std::size_t face_count) {
  std::vector<std::uint32_t> owner(face_count, 0);
  for (std::uint32_t k = 0; k < pieces.size(); ++k) {
    for (const std::uint32_t face : pieces[k].cell.solid.face) {
      if (face != kNewFace) owner[face] = k;
    }
  }
  return owner;
}

/// Error that each part adds to the sum over the shell [m].
Result<std::vector<double>> judge(const std::vector<Piece>& pieces, const ShellPoints& shell,
                                  std::size_t face_count, double r_max_m) {
  Asset asset;
  asset.r_max_m = r_max_m;
  for (const Piece& piece : pieces) asset.parts.push_back(piece.part);
  asset.sphere = enclosing_sphere(asset.parts);
  auto object = runtime::Object::build(asset);
  if (!object) return object.error();
  std::vector<std::uint32_t> share;
  auto error = error_by_part(object.value(), shell, part_of_face(pieces, face_count),
                             static_cast<std::uint32_t>(pieces.size()), kWorstError * r_max_m, share);
  for (std::size_t k = 0; k < error.size(); ++k) error[k] *= share[k];
  return error;
}

}  // namespace

BoundingSphere enclosing_sphere(const std::vector<Part>& parts) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Vec3d low{kInfinity, kInfinity, kInfinity}, high = -low;
  for (const Part& part : parts) {
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], part.sphere.centre_m[axis] - part.sphere.radius_m);
      high[axis] = std::max(high[axis], part.sphere.centre_m[axis] + part.sphere.radius_m);
    }
  }
  BoundingSphere sphere{0.5 * (low + high), 0};
  for (const Part& part : parts) {
    sphere.radius_m =
        std::max(sphere.radius_m, norm(part.sphere.centre_m - sphere.centre_m) + part.sphere.radius_m);
  }
  sphere.radius_m *= 1 + kBoundMargin;
  return sphere;
}

Result<Refinement> refine(SolidSet& set, std::vector<Cell> cells, const MeshQueries& queries, double r_max_m,
                          const BakeOptions& options, const Progress& progress) {
  const std::size_t face_count = queries.mesh.faces.size();
  const ShellPoints shell = sample_shell(queries, kShellWidth * r_max_m, kShellPoints, options.seed);
  std::vector<Piece> pieces(cells.size());
  std::vector<std::optional<Error>> errors(cells.size());
  tbb::parallel_for(std::size_t{0}, cells.size(), [&](std::size_t k) {
    auto piece = make_piece(set, std::move(cells[k]), queries, options.fit);
    if (piece) {
      pieces[k] = std::move(piece).value();
    } else {
      errors[k] = piece.error();
    }
  });
  for (const auto& error : errors) {
    if (error) return *error;
  }

  std::vector<bool> atomic(pieces.size());  // no plane cuts the piece further
  for (;;) {
    if (progress.stop()) return Error{Status::kCancelled, "cancelled while refining parts", ""};
    progress.at("refine", static_cast<double>(pieces.size()) / options.max_parts);
    auto judged = judge(pieces, shell, face_count, r_max_m);
    if (!judged) return judged.error();
    const std::vector<double>& error = judged.value();
    double sum = 0, worst = 0;
    for (std::size_t k = 0; k < error.size(); ++k) {
      sum += error[k];
      if (!atomic[k]) worst = std::max(worst, error[k]);
    }
    if (sum <= kShellPoints * options.max_error_percent / 100 * r_max_m)
      return Refinement{std::move(pieces), "target"};
    if (pieces.size() >= options.max_parts || worst == 0) return Refinement{std::move(pieces), "parts"};

    std::vector<std::size_t> order;
    for (std::size_t k = 0; k < error.size(); ++k) {
      if (!atomic[k] && error[k] >= kRoundShare * worst) order.push_back(k);
    }
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return error[a] != error[b] ? error[a] > error[b] : a < b;
    });
    for (const std::size_t k : order) {
      if (pieces.size() >= options.max_parts) break;
      const auto cut = best_plane_cut(set, pieces[k].cell.solid);
      if (!cut) {
        atomic[k] = true;
        continue;
      }
      Cell first, second;
      first.segment = second.segment = pieces[k].cell.segment;
      first.reason = second.reason = CutReason::kErrorTarget;
      std::tie(first.solid, second.solid) =
          set.split(pieces[k].cell.solid, [&](std::size_t t) { return (*cut)[t]; });
      auto a = make_piece(set, std::move(first), queries, options.fit);
      auto b = make_piece(set, std::move(second), queries, options.fit);
      if (!a) return a.error();
      if (!b) return b.error();
      pieces[k] = std::move(a).value();
      pieces.push_back(std::move(b).value());
      atomic.push_back(false);
    }
  }
}

}  // namespace sqmap::bake
