// SPDX-License-Identifier: GPL-3.0-or-later
#include "refine.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <optional>
#include <tuple>

#include <tbb/parallel_for.h>

#include "measure.hpp"
#include "part_builder.hpp"

namespace sqmap::bake {

namespace {

constexpr std::uint32_t kDraftQuadrantCells = 32;
constexpr std::uint32_t kShellPoints = 4000;
// Half width of the shell the partition is judged in, and the cap of one point's error, as shares of R_max.
constexpr double kShellWidth = 0.03;
constexpr double kWorstError = 0.02;
// Parts with at least this share of the worst part's error are split in the same round.
constexpr double kRoundShare = 0.7;
// The final maps are coarser than the drafts that pieces are judged by, and take the rest of the target.
constexpr double kRefineShare = 0.7;
// A split pays if it lowers the error by more than this share of what each part of a full count may err.
constexpr double kPartPrice = 0.3;

/// A cell with a quick fit and a draft map, enough to judge it by.
Result<Piece> draft_piece(const SolidSet& set, Cell cell, const MeshQueries& queries, FitOptions options) {
  options.quick = true;
  auto part = fit_part(set, cell, options);
  if (!part) return part.error();
  Piece piece{std::move(cell), std::move(part).value(), {}, 0};
  draft_map(piece.part, queries, kDraftQuadrantCells);
  return piece;
}

/// Gives every piece the fit it deserves.
Outcome fit_pieces(const SolidSet& set, std::vector<Piece>& pieces, const FitOptions& options) {
  std::vector<std::optional<Error>> errors(pieces.size());
  tbb::parallel_for(std::size_t{0}, pieces.size(), [&](std::size_t k) {
    auto part = fit_part(set, pieces[k].cell, options);
    if (part) {
      pieces[k].part = std::move(part).value();
    } else {
      errors[k] = part.error();
    }
  });
  for (const auto& error : errors) {
    if (error) return *error;
  }
  return Done{};
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

namespace {

/// The partition while it is refined, with what each piece adds to the error.
class Refiner {
 public:
  Refiner(SolidSet& set, const MeshQueries& queries, double r_max_m, const BakeOptions& options)
      : set_(set),
        queries_(queries),
        r_max_m_(r_max_m),
        options_(options),
        target_m_(kRefineShare * kShellPoints * options.max_error_percent / 100 * r_max_m),
        shell_(sample_shell(queries, kShellWidth * r_max_m, kShellPoints, options.seed)) {}

  Outcome start(std::vector<Cell> cells) {
    pieces.resize(cells.size());
    std::vector<std::optional<Error>> errors(cells.size());
    tbb::parallel_for(std::size_t{0}, cells.size(), [&](std::size_t k) {
      auto piece = draft_piece(set_, std::move(cells[k]), queries_, options_.fit);
      if (piece) {
        pieces[k] = std::move(piece).value();
      } else {
        errors[k] = piece.error();
      }
    });
    for (const auto& error : errors) {
      if (error) return *error;
    }
    return judge_pieces();
  }

  bool meets_target() const { return std::accumulate(error_m_.begin(), error_m_.end(), 0.0) <= target_m_; }

  /// Splits the pieces that add most to the error, as far as parts are left, and keeps the splits that pay.
  /// False: there was none to split.
  Result<bool> split_worst() {
    const std::vector<std::size_t> order = worst_pieces();
    if (order.empty()) return false;
    std::vector<Split> splits;
    for (const std::size_t k : order) {
      if (pieces.size() >= options_.max_parts) break;
      if (auto outcome = split(k, splits); !outcome) return outcome.error();
    }
    if (auto outcome = judge_pieces(); !outcome) return outcome.error();
    // Halves appended last come off first, so the places of the others stay.
    for (auto it = splits.rbegin(); it != splits.rend(); ++it) {
      const double saved_m = it->error_before_m - error_m_[it->first] - error_m_[it->second];
      if (!(saved_m > kPartPrice * target_m_ / options_.max_parts)) undo(*it);
    }
    return true;
  }

  std::vector<Piece> pieces;

 private:
  struct Split {
    std::size_t first, second;  ///< where the halves stand
    Piece before;
    double error_before_m;
  };

  Outcome judge_pieces() {
    auto judged = judge(pieces, shell_, queries_.mesh.faces.size(), r_max_m_);
    if (!judged) return judged.error();
    error_m_ = std::move(judged).value();
    return Done{};
  }

  /// Looks for the cuts of a piece when they are first asked for.
  bool can_split(Piece& piece) const {
    if (!piece.cuts) piece.cuts = plane_cuts_by_merit(set_, piece.cell.solid);
    return piece.cuts_tried < piece.cuts->size();
  }

  std::vector<std::size_t> worst_pieces() {
    std::vector<std::size_t> order(pieces.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return error_m_[a] != error_m_[b] ? error_m_[a] > error_m_[b] : a < b;
    });
    std::vector<std::size_t> worst;
    for (const std::size_t k : order) {
      if (!(error_m_[k] > 0)) break;
      if (!worst.empty() && error_m_[k] < kRoundShare * error_m_[worst.front()]) break;
      if (can_split(pieces[k])) worst.push_back(k);
    }
    return worst;
  }

  Outcome split(std::size_t k, std::vector<Split>& splits) {
    const Cell& whole = pieces[k].cell;
    const std::vector<bool>& cut = (*pieces[k].cuts)[pieces[k].cuts_tried];
    Cell first{{}, whole.segment, CutReason::kErrorTarget}, second = first;
    std::tie(first.solid, second.solid) = set_.split(whole.solid, [&](std::size_t t) { return cut[t]; });
    auto a = draft_piece(set_, std::move(first), queries_, options_.fit);
    auto b = draft_piece(set_, std::move(second), queries_, options_.fit);
    if (!a) return a.error();
    if (!b) return b.error();
    splits.push_back({k, pieces.size(), std::move(pieces[k]), error_m_[k]});
    pieces[k] = std::move(a).value();
    pieces.push_back(std::move(b).value());
    return Done{};
  }

  /// Puts the whole piece back; the next best cut across it will be tried.
  void undo(Split& split) {
    pieces[split.first] = std::move(split.before);
    ++pieces[split.first].cuts_tried;
    error_m_[split.first] = split.error_before_m;
    pieces.erase(pieces.begin() + static_cast<std::ptrdiff_t>(split.second));
    error_m_.erase(error_m_.begin() + static_cast<std::ptrdiff_t>(split.second));
  }

  SolidSet& set_;
  const MeshQueries& queries_;
  double r_max_m_;
  const BakeOptions& options_;
  double target_m_;  ///< the error that all shell points together may have
  ShellPoints shell_;
  std::vector<double> error_m_;  ///< that each piece adds to the sum over the shell
};

}  // namespace

Result<Refinement> refine(SolidSet& set, std::vector<Cell> cells, const MeshQueries& queries, double r_max_m,
                          const BakeOptions& options, const Progress& progress) {
  Refiner refiner(set, queries, r_max_m, options);
  if (auto outcome = refiner.start(std::move(cells)); !outcome) return outcome.error();
  bool can_gain = true;
  while (can_gain && !refiner.meets_target() && refiner.pieces.size() < options.max_parts) {
    if (progress.stop()) return Error{Status::kCancelled, "cancelled while refining parts", ""};
    progress.at("refine", static_cast<double>(refiner.pieces.size()) / options.max_parts);
    auto split = refiner.split_worst();
    if (!split) return split.error();
    can_gain = split.value();
  }
  Refinement result{std::move(refiner.pieces), refiner.meets_target() ? "target"
                                               : can_gain             ? "parts"
                                                                      : "gain"};
  if (auto outcome = fit_pieces(set, result.pieces, options.fit); !outcome) return outcome.error();
  return result;
}

}  // namespace sqmap::bake
