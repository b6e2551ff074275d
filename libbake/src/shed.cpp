// SPDX-License-Identifier: GPL-3.0-or-later
#include "shed.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include <tbb/parallel_for.h>

namespace sqmap::bake {

namespace {

// A superquadric that becomes no smaller than this share of what it was is left as it is.
constexpr double kWorthShedding = 0.99;
// Another superquadric holds what lies within this share of its reach: nearer to its surface, its map would
// see the mesh from beside the seam, where rays see little.
constexpr double kWellInside = 0.99;

constexpr auto kNobody = std::numeric_limits<std::uint32_t>::max();

/// Both exponents at their bound. Boxes neither give nor take: their full fits have sharper edges than the
/// quick ones, and would have to hold what sticks out of them.
bool is_box(const Part& part, const FitOptions& options) {
  return std::max(part.shape.e1, part.shape.e2) < 1.01 * options.min_exponent;
}

/// Tells which vertices of a set lie in one part's superquadric.
class Holder {
 public:
  Holder(const SolidSet& set, const Part& part)
      : set_(set), part_(part), turn_(rotation(part.object_from_part.orientation)) {}

  bool touches(const Part& other) const {
    const Vec3d d = other.sphere.centre_m - part_.sphere.centre_m;
    const double reach_m = other.sphere.radius_m + part_.sphere.radius_m;
    return dot(d, d) <= reach_m * reach_m;
  }
  /// All of a triangle: the superquadrics of quick fits are straight, hence convex.
  bool holds(const std::array<std::uint32_t, 3>& triangle) const {
    return std::all_of(triangle.begin(), triangle.end(), [&](std::uint32_t v) { return holds(v); });
  }

 private:
  bool holds(std::uint32_t vertex) const {
    const Vec3d d = set_.vertices_m[vertex] - part_.object_from_part.translation_m;
    return dot(d, d) <= part_.sphere.radius_m * part_.sphere.radius_m &&
           inside_outside_radial(part_.shape, turn_.apply_inverse(d)) <= kWellInside;
  }

  const SolidSet& set_;
  const Part& part_;
  Rotation<double> turn_;
};

/// What is left of a piece, and what goes to which other ones.
struct Division {
  Solid rest;
  std::vector<std::pair<std::uint32_t, Solid>> given;
};

void add(Solid& solid, const Solid& more) {
  solid.triangles.insert(solid.triangles.end(), more.triangles.begin(), more.triangles.end());
  solid.face.insert(solid.face.end(), more.face.begin(), more.face.end());
}

/// Pieces by the volume of their superquadrics.
std::vector<std::uint32_t> by_volume(const std::vector<Piece>& pieces, bool ascending) {
  std::vector<double> volumes_m3;
  for (const Piece& piece : pieces) volumes_m3.push_back(volume_m3(piece.part.shape));
  std::vector<std::uint32_t> order(pieces.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return ascending ? volumes_m3[a] < volumes_m3[b] : volumes_m3[a] > volumes_m3[b];
  });
  return order;
}

/// Those that may take from one piece: those after it in the order whose spheres meet its own, the last
/// first.
class Takers {
 public:
  Takers(const SolidSet& set, const std::vector<Piece>& pieces, const std::vector<std::uint32_t>& order,
         std::size_t place, const FitOptions& options) {
    const Part& giver = pieces[order[place]].part;
    for (std::size_t i = order.size() - 1; i > place && !is_box(giver, options); --i) {
      const Part& taker = pieces[order[i]].part;
      if (const Holder holder(set, taker); holder.touches(giver) && !is_box(taker, options)) {
        pieces_.push_back(order[i]);
        holders_.push_back(holder);
      }
    }
  }
  std::uint32_t size() const { return static_cast<std::uint32_t>(holders_.size()); }
  std::uint32_t piece(std::uint32_t taker) const { return pieces_[taker]; }
  /// The first, from `first` on, that holds all of the triangle; kNobody: none does.
  std::uint32_t of(const std::array<std::uint32_t, 3>& triangle, std::uint32_t first = 0) const {
    for (std::uint32_t i = first; i < size(); ++i)
      if (holders_[i].holds(triangle)) return i;
    return kNobody;
  }

 private:
  std::vector<std::uint32_t> pieces_;
  std::vector<Holder> holders_;
};

/// `taker_of`: of each triangle of `held`. None where nothing can be given; something of the mesh stays.
std::optional<Division> divide(SolidSet& set, const Solid& held, const Takers& takers,
                               std::vector<std::uint32_t> taker_of) {
  if (takers.size() == 0) return std::nullopt;
  Division division{held, {}};
  for (std::uint32_t taker = 0; taker < takers.size(); ++taker) {
    bool some_go = false, some_stay = false;
    for (std::size_t k = 0; k < taker_of.size(); ++k) {
      some_go |= taker_of[k] == taker;
      some_stay |= taker_of[k] != taker && division.rest.face[k] != kNewFace;
    }
    if (!some_go || !some_stay) continue;
    auto [given, rest] = set.split(division.rest, [&](std::size_t k) { return taker_of[k] == taker; });
    division.given.emplace_back(takers.piece(taker), std::move(given));
    division.rest = std::move(rest);
    std::erase(taker_of, taker);
    for (std::size_t k = taker_of.size(); k < division.rest.triangles.size(); ++k)
      taker_of.push_back(takers.of(division.rest.triangles[k], taker + 1));  // caps
  }
  if (division.given.empty()) return std::nullopt;
  return division;
}

void take(Piece& piece, FittedPart&& fitted) {
  piece.part = std::move(fitted.part);
  piece.fit = fitted.fit;
  piece.label();
}

/// Pieces give to those that come after them in the order, all at once, so that what is given lies in what
/// its taker was, and no two give each other the same.
void shed_once(SolidSet& set, std::vector<Piece>& pieces, const std::vector<std::uint32_t>& order,
               const FitOptions& options) {
  const std::size_t count = pieces.size();
  std::vector<std::optional<Takers>> takers(count);  // and the rest, by place in the order
  std::vector<std::vector<std::uint32_t>> taker_of(count);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    takers[i].emplace(set, pieces, order, i, options);
    for (const auto& triangle : pieces[order[i]].held.triangles)
      taker_of[i].push_back(takers[i]->of(triangle));
  });
  std::vector<std::optional<Division>> divisions(count);
  for (std::size_t i = 0; i < count; ++i)
    divisions[order[i]] = divide(set, pieces[order[i]].held, *takers[i], std::move(taker_of[i]));

  // Fitted with all that may come; what does not come in the end leaves the superquadric a bound.
  std::vector<Solid> trials(count);
  for (std::size_t k = 0; k < count; ++k)
    if (divisions[k]) trials[k] = divisions[k]->rest;
  for (const auto& division : divisions) {
    if (!division) continue;
    for (const auto& [taker, given] : division->given)
      if (divisions[taker]) add(trials[taker], given);
  }
  std::vector<std::uint8_t> sheds(count, 0);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t k) {
    if (!divisions[k]) return;
    auto fitted = fit_part(set, trials[k], options);
    if (!fitted || !(volume_m3(fitted.value().part.shape) < kWorthShedding * volume_m3(pieces[k].part.shape)))
      return;
    take(pieces[k], std::move(fitted).value());
    sheds[k] = 1;
  });
  for (std::size_t k = 0; k < count; ++k)
    if (sheds[k] != 0) pieces[k].held = std::move(divisions[k]->rest);
  for (std::size_t k = 0; k < count; ++k) {
    if (sheds[k] == 0) continue;
    for (const auto& [taker, given] : divisions[k]->given) add(pieces[taker].held, given);
  }
}

}  // namespace

void shed_covered(SolidSet& set, std::vector<Piece>& pieces, const FitOptions& options) {
  FitOptions quick = options;
  quick.quick = true;
  quick.taper = false;
  for (Piece& piece : pieces) piece.held = piece.cell.solid;
  for (const bool to_larger : {true, false}) shed_once(set, pieces, by_volume(pieces, to_larger), quick);
}

}  // namespace sqmap::bake
