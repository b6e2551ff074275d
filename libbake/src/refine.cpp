// SPDX-License-Identifier: GPL-3.0-or-later
#include "refine.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <optional>
#include <tuple>
#include <utility>

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include "sqmap/asset/miss_run.hpp"

#include "measure.hpp"
#include "part_builder.hpp"
#include "shed.hpp"

namespace sqmap::bake {

namespace {

constexpr std::uint32_t kDraftQuadrantCells = 32;
constexpr std::uint32_t kShellPoints = 4000;
// Half width of the shell the partition is judged in, and the cap of one point's error, as shares of R_max.
constexpr double kShellWidth = 0.03;
constexpr double kWorstError = 0.2;
// The final maps are coarser than the drafts that pieces are judged by, and take the rest of the target.
constexpr double kRefineShare = 0.7;
// A split pays if it lowers the error by more than this share of what each part of a full count may err.
constexpr double kPartPrice = 0.3;
// Few splits take off more than half of what their piece errs: one that errs by less than this many prices is
// left alone.
constexpr double kWorthSplitting = 2;
// Which piece is split goes by its share of the error and, this much, by its share of the volume that
// superquadrics enclose beside the mesh: where that is large maps see the surface from far off and at a
// slant.
constexpr double kVolumeShare = 0.3;
// Bytes that a target of what drafts lose asks for in all: 4,200 to 8,300 of eleven meshes; and those of a
// part itself, with as many again for the time it takes at run time. The best partition counts more for a
// part: where a few parts do, drafts foretell too little of what more would save.
constexpr double kDraftBytes = 5000;
constexpr double kPartBytes = 2500, kBestPartBytes = 5000;
// So many splits that do not pay are kept on trial, one after another, before the search ends.
constexpr int kMostTrials = 4;
// Of those that only save bytes: the least share they must save, and how many in a row may not.
constexpr double kWorthSaving = 0.01;
constexpr int kMostVainSplits = 8;
// Of the partitions on the way to the last, so many are offered, their counts of parts in equal ratios.
constexpr std::size_t kMostOnTheWay = 8;

/// Of the texels of a map, those that a loaded object holds.
double held_share(const DistanceMap& map) {
  double held = 0;
  for (std::uint32_t row = 0; row < map.rows; ++row) held += map.cols - longest_miss_run(map, row).count;
  return held / (1.0 * map.rows * map.cols);
}

/// A cell with a quick fit and a draft map, enough to judge it by.
Result<Piece> draft_piece(const SolidSet& set, Cell cell, const MeshQueries& queries, FitOptions options) {
  options.quick = true;
  options.taper = false;
  auto fitted = fit_part(set, cell.solid, options);
  if (!fitted) return fitted.error();
  Piece piece{
      std::move(cell), {}, std::move(fitted.value().part), fitted.value().fit, 0, 0, 0, {}, {}, {}, 0, {}};
  piece.label();
  piece.loss_m = draft_map(piece.part, queries, kDraftQuadrantCells);
  piece.held_share = held_share(piece.part.map);
  for (const std::uint32_t face : piece.cell.solid.face)
    if (face != kNewFace) piece.area_m2 += area_m2(queries.mesh, face);
  return piece;
}

/// The full fits of a solid.
struct FullFits {
  std::vector<Vec3d> corners_m;  ///< of the solid's triangles
  FittedPart rigid;
  std::vector<FittedPart> others;
};

Result<FullFits> fit_fully(const SolidSet& set, const Solid& solid, std::vector<Vec3d> corners_m,
                           const FitOptions& options) {
  FitOptions rigid = options;
  rigid.taper = false;
  auto fitted = fit_part(set, solid, rigid);
  if (!fitted) return fitted.error();
  FullFits fits{std::move(corners_m), std::move(fitted).value(), {}};
  if (options.taper) {
    if (auto tapered = fit_part(set, solid, options)) fits.others.push_back(std::move(tapered).value());
  }
  if (options.bend) {
    if (auto bent = bend_part(set, solid, fits.rigid, options)) fits.others.push_back(std::move(*bent));
  }
  return fits;
}

/// Gives every piece the fit it deserves. `known`: those of the last partition; then of this one.
Outcome fit_pieces(const SolidSet& set, std::vector<Piece>& pieces, const FitOptions& options,
                   std::vector<std::shared_ptr<const FullFits>>& known) {
  std::vector<std::optional<Error>> errors(pieces.size());
  std::vector<std::shared_ptr<const FullFits>> fits(pieces.size());
  tbb::parallel_for(std::size_t{0}, pieces.size(), [&](std::size_t k) {
    Piece& piece = pieces[k];
    std::vector<Vec3d> corners_m;
    for (const auto& triangle : piece.held.triangles)
      for (const std::uint32_t v : triangle) corners_m.push_back(set.vertices_m[v]);
    const auto same =
        std::ranges::find_if(known, [&](const auto& fit) { return fit->corners_m == corners_m; });
    if (same != known.end()) {
      fits[k] = *same;
    } else {
      auto fitted = fit_fully(set, piece.held, std::move(corners_m), options);
      if (!fitted) {
        errors[k] = fitted.error();
        return;
      }
      fits[k] = std::make_shared<const FullFits>(std::move(fitted).value());
    }
    piece.quick = FittedPart{std::move(piece.part), piece.fit};
    piece.quick->part.map = {};
    piece.part = fits[k]->rigid.part;
    piece.fit = fits[k]->rigid.fit;
    piece.others = fits[k]->others;
    piece.quick->part.volume_m3 = piece.part.volume_m3;  // of the same solid
    piece.label();
  });
  for (const auto& error : errors) {
    if (error) return *error;
  }
  known = std::move(fits);
  return Done{};
}

/// Pieces of partitions, each once: those of neighbours on the way differ in few. Of a piece that is shared
/// only the cuts are ever set.
using SharedPieces = std::vector<std::shared_ptr<Piece>>;

std::vector<std::uint32_t> part_of_face(const SharedPieces& pieces, std::size_t face_count) {
  std::vector<std::uint32_t> owner(face_count, 0);
  for (std::uint32_t k = 0; k < pieces.size(); ++k) {
    for (const std::uint32_t face : pieces[k]->cell.solid.face) {
      if (face != kNewFace) owner[face] = k;
    }
  }
  return owner;
}

/// Error that each part adds to the sum over the shell [m].
Result<std::vector<double>> judge(const SharedPieces& pieces, const ShellPoints& shell,
                                  std::size_t face_count, double r_max_m) {
  Asset asset;
  asset.r_max_m = r_max_m;
  for (const auto& piece : pieces) asset.parts.push_back(piece->part);
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
        pieces[k] = std::make_shared<Piece>(std::move(piece).value());
      } else {
        errors[k] = piece.error();
      }
    });
    for (const auto& error : errors) {
      if (error) return *error;
    }
    return judge_pieces();
  }

  bool meets_target() const { return error_m() <= target_m_; }
  /// What final maps must reach, too.
  bool is_within_target() const { return kRefineShare * error_m() <= target_m_; }

  /// Splits the worst piece of those with a cut left to try, and keeps the split if it pays. False: no piece
  /// has one.
  Result<bool> split_worst() {
    const std::optional<std::size_t> worst =
        worst_of(kWorthSplitting * price_m(), [&](Piece& piece) { return can_split(piece); });
    if (!worst) return false;
    const auto before = std::make_shared<Piece>(*pieces[*worst]);
    const std::vector<double> error_before_m = error_m_;
    const double sum_before_m = error_m();
    if (auto outcome = split(*worst, before->cuts_tried); !outcome) return outcome.error();
    const double saved_m = sum_before_m - error_m();
    if (saved_m > price_m()) return true;
    // The whole piece comes back; the next best cut across it will be tried.
    if (!before->spare || -saved_m < before->spare->loss_m)
      before->spare = Spare{before->cuts_tried, -saved_m};
    ++before->cuts_tried;
    pieces[*worst] = before;
    pieces.pop_back();
    error_m_ = error_before_m;
    return true;
  }

  /// Where no split pays: splits the worst piece all the same. False: there is none, or it was tried often
  /// enough.
  Result<bool> split_on_trial() {
    if (trials_ == kMostTrials) return false;
    const std::optional<std::size_t> worst =
        worst_of(0, [](Piece& piece) { return piece.spare.has_value(); });
    if (!worst) return false;
    ++trials_;
    if (auto outcome = split(*worst, pieces[*worst]->spare->cut); !outcome) return outcome.error();
    return true;
  }

  /// Splits the worst piece of those with a cut left to try, and keeps the split if maps need fewer bytes for
  /// it and the error is no greater beyond its target. False: no piece has one, or too many in a row did not
  /// pay.
  Result<bool> split_to_save() {
    if (trials_ == kMostVainSplits) return false;
    const std::optional<std::size_t> worst = worst_of(0, [&](Piece& piece) { return can_split(piece); });
    if (!worst) return false;
    const auto before = std::make_shared<Piece>(*pieces[*worst]);
    const std::vector<double> error_before_m = error_m_;
    const double cost_before = cost(kPartBytes);
    if (auto outcome = split(*worst, before->cuts_tried); !outcome) return outcome.error();
    if (cost(kPartBytes) < (1 - kWorthSaving) * cost_before) {
      trials_ = 0;
      return true;
    }
    ++trials_;
    ++before->cuts_tried;
    pieces[*worst] = before;
    pieces.pop_back();
    error_m_ = error_before_m;
    return true;
  }

  void remember_best() {
    const auto remember = [&](Snapshot& best, double cost_now) {
      if (!best.pieces.empty() && !(cost_now < best.cost)) return false;  // it may not be finite
      best = {pieces, error_m_, cost_now};
      return true;
    };
    if (on_the_way_.empty() || on_the_way_.back().pieces.size() != pieces.size())
      on_the_way_.push_back({pieces, error_m_, 0});
    if (remember(best_, cost(kBestPartBytes))) trials_ = 0;
    if (is_within_target()) remember(smallest_, bytes(kPartBytes));
  }

  /// Goes back to the best partition there was.
  void end() {
    remember_best();
    go_to(best_);
  }
  /// Goes to that of fewest bytes which errs no more than final maps may. False: it is the best.
  bool go_to_smallest() {
    if (smallest_.pieces.empty() || smallest_.pieces.size() == best_.pieces.size()) return false;
    go_to(smallest_);
    return true;
  }
  void go_to_best() { go_to(best_); }
  /// Goes to the next of those on the way that are offered. False: there is none left.
  bool go_to_next_on_the_way() {
    if (on_the_way_.empty()) return false;
    const auto least = static_cast<double>(on_the_way_.front().pieces.size());
    const auto most = static_cast<double>(on_the_way_.back().pieces.size());
    for (; next_ < kMostOnTheWay; ++next_) {
      const double share = 1 - static_cast<double>(next_) / (kMostOnTheWay - 1);
      const double parts = least * std::pow(most / least, share);
      const auto nearest = std::ranges::min_element(on_the_way_, {}, [&](const Snapshot& s) {
        return std::abs(static_cast<double>(s.pieces.size()) - parts);
      });
      const std::size_t size = nearest->pieces.size();
      if (size == pieces.size() || size == best_.pieces.size() || size == smallest_.pieces.size()) continue;
      ++next_;
      go_to(*nearest);
      return true;
    }
    return false;
  }

  SharedPieces pieces;

 private:
  struct Snapshot {
    SharedPieces pieces;
    std::vector<double> error_m;
    double cost{};
  };

  void go_to(const Snapshot& snapshot) {
    pieces = snapshot.pieces;
    error_m_ = snapshot.error_m;
    trials_ = 0;
  }
  double error_m() const { return std::accumulate(error_m_.begin(), error_m_.end(), 0.0); }
  /// Bytes in memory that maps of the target's error will need, about. A map errs in inverse proportion to
  /// the root of its texels: so maps that lose e_k at some resolution and count by their areas w_k meet a
  /// mean error T with fewest texels together, of which they hold the shares h_k, at
  /// (sum (w_k e_k)^(2/3) h_k^(1/3))^3 / T^2 times those of that resolution.
  double bytes(double part_bytes) const {
    double sum = 0, all_m2 = 0;
    for (const auto& piece : pieces) {
      sum += std::cbrt(std::pow(piece->area_m2 * piece->loss_m, 2) * piece->held_share);
      all_m2 += piece->area_m2;
    }
    const double mean_m = options_.max_error_percent / 100 * r_max_m_;
    const double drafts = std::pow(sum, 3) / std::pow(all_m2 * mean_m, 2);
    return kDraftBytes * drafts + part_bytes * static_cast<double>(pieces.size());
  }
  /// What the best partition has least of: bytes, times the square of what the error exceeds its target by,
  /// since the bytes of maps grow like that.
  double cost(double part_bytes) const {
    return bytes(part_bytes) * std::pow(std::max(error_m() / target_m_, 1.0), 2);
  }

  double price_m() const { return kPartPrice * target_m_ / options_.max_parts; }

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

  /// What each piece has of the error and of the volume beside the mesh (kVolumeShare).
  std::vector<double> burdens() const {
    std::vector<double> beside_m3;
    for (const auto& piece : pieces)
      beside_m3.push_back(std::max(0.0, volume_m3(piece->part.shape) - piece->part.volume_m3));
    const double all_m3 = std::accumulate(beside_m3.begin(), beside_m3.end(), 0.0), all_m = error_m();
    std::vector<double> burden(pieces.size());
    for (std::size_t k = 0; k < burden.size(); ++k)
      burden[k] = (1 - kVolumeShare) * (all_m > 0 ? error_m_[k] / all_m : 0) +
                  kVolumeShare * (all_m3 > 0 ? beside_m3[k] / all_m3 : 0);
    return burden;
  }

  /// The piece with the greatest burden of those that err by more than `least_m` and `may` be split.
  template <class May>
  std::optional<std::size_t> worst_of(double least_m, const May& may) {
    const std::vector<double> burden = burdens();
    std::vector<std::size_t> order(pieces.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return burden[a] > burden[b]; });
    for (const std::size_t k : order)
      if (error_m_[k] > least_m && may(*pieces[k])) return k;
    return std::nullopt;
  }

  /// Puts the halves of piece k in its place and at the end.
  Outcome split(std::size_t k, std::size_t which) {
    const Cell& whole = pieces[k]->cell;
    Cell first{{}, whole.segment, CutReason::kErrorTarget}, second = first;
    std::tie(first.solid, second.solid) = set_.split(whole.solid, (*pieces[k]->cuts)[which]);
    std::optional<Result<Piece>> a, b;
    tbb::parallel_invoke([&] { a = draft_piece(set_, std::move(first), queries_, options_.fit); },
                         [&] { b = draft_piece(set_, std::move(second), queries_, options_.fit); });
    if (!*a) return a->error();
    if (!*b) return b->error();
    pieces[k] = std::make_shared<Piece>(std::move(*a).value());
    pieces.push_back(std::make_shared<Piece>(std::move(*b).value()));
    return judge_pieces();
  }

  SolidSet& set_;
  MeshQueries queries_;
  double r_max_m_;
  const BakeOptions& options_;
  double target_m_;  ///< the error that all shell points together may have
  ShellPoints shell_;
  std::vector<double> error_m_;  ///< that each piece adds to the sum over the shell
  int trials_ = 0;               ///< since the best partition
  Snapshot best_, smallest_;
  std::vector<Snapshot> on_the_way_;  ///< one of each count of parts, ascending
  std::size_t next_ = 0;              ///< of those of them that are offered
};

}  // namespace

struct PartitionSearch::Impl {
  Impl(SolidSet& set_of, const MeshQueries& queries, double r_max_m, const BakeOptions& baked_by)
      : set(set_of), options(baked_by), refiner(set_of, queries, r_max_m, baked_by) {}

  /// The refiner's pieces, without what others hold and with their full fits.
  Result<Refinement> finished() {
    const bool is_full = refiner.pieces.size() >= options.max_parts;
    Refinement result{{}, refiner.is_within_target() ? "target" : is_full ? "parts" : "gain"};
    for (const auto& piece : refiner.pieces) result.pieces.push_back(*piece);
    shed_covered(set, result.pieces, options.fit);
    if (auto outcome = fit_pieces(set, result.pieces, options.fit, fits); !outcome) return outcome.error();
    return result;
  }
  bool may_split() const { return refiner.pieces.size() < options.max_parts; }

  SolidSet& set;
  const BakeOptions& options;
  Refiner refiner;
  std::vector<std::shared_ptr<const FullFits>> fits;  ///< of the partition finished last
  bool was_smallest = false, was_finer = false;
};

PartitionSearch::PartitionSearch(SolidSet& set, const MeshQueries& queries, double r_max_m,
                                 const BakeOptions& options)
    : impl_(std::make_unique<Impl>(set, queries, r_max_m, options)) {}

PartitionSearch::~PartitionSearch() = default;

Result<Refinement> PartitionSearch::best(std::vector<Cell> cells, const Progress& progress) {
  Refiner& refiner = impl_->refiner;
  if (auto outcome = refiner.start(std::move(cells)); !outcome) return outcome.error();
  bool can_gain = true;
  while (can_gain && !refiner.meets_target() && impl_->may_split()) {
    if (progress.stop()) return Error{Status::kCancelled, "cancelled while refining parts", ""};
    progress.at("refine", static_cast<double>(refiner.pieces.size()) / impl_->options.max_parts);
    refiner.remember_best();
    auto split = refiner.split_worst();
    if (split && !split.value()) split = refiner.split_on_trial();
    if (!split) return split.error();
    can_gain = split.value();
  }
  refiner.end();
  return impl_->finished();
}

Result<std::optional<Refinement>> PartitionSearch::other(const Progress& progress) {
  Refiner& refiner = impl_->refiner;
  const auto finished = [&]() -> Result<std::optional<Refinement>> {
    auto result = impl_->finished();
    if (!result) return result.error();
    return std::optional(std::move(result).value());
  };
  if (!std::exchange(impl_->was_smallest, true) && refiner.go_to_smallest()) return finished();
  if (!std::exchange(impl_->was_finer, true)) {
    refiner.go_to_best();
    const std::size_t parts = refiner.pieces.size();
    for (bool can_gain = true; can_gain && impl_->may_split();) {
      if (progress.stop()) return Error{Status::kCancelled, "cancelled while refining parts", ""};
      auto split = refiner.split_to_save();
      if (!split) return split.error();
      can_gain = split.value();
    }
    if (refiner.pieces.size() > parts) return finished();
  }
  return refiner.go_to_next_on_the_way() ? finished() : std::optional<Refinement>();
}

}  // namespace sqmap::bake
