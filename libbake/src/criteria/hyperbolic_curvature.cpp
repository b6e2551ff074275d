// SPDX-License-Identifier: GPL-3.0-or-later
#include "criteria/hyperbolic_curvature.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "components.hpp"
#include "convexity.hpp"
#include "geodesics.hpp"

namespace sqmap::bake {
namespace {

// Bend a part may keep. By Gauss and Bonnet a tube that bends by the angle phi has total hyperbolic curvature
// -2 phi, however thick it is: the inner half of a whole torus has -4 pi. So this is the mesh-independent
// "minimum size of a subobject" that keeps hyperbolic locales from fragmenting a tube.
constexpr double kPartBend_rad = std::numbers::pi / 3;
// The pieces of a segment must fill at least this much less than its hull, or it was not bent but merely
// dented.
constexpr double kMinHullGain = 0.15;

// A locale is this many edges wide at least: narrower bands of faces are not connected round the tube.
constexpr double kLocaleEdges = 2;

// A locale goes round a tube when its normals cancel: |mean normal| is 0 for a ring, 2 / pi for half of one,
// 1 for a strip of a sheet, which cutting across would not straighten.
constexpr double kMaxNormal = 0.4;

double mean_edge(const Surface& surface) {
  double sum = 0;
  for (const Link& link : surface.links) sum += link.length;
  return surface.links.empty() ? 1 : sum / static_cast<double>(surface.links.size());
}

// Connected components of the bands of equal level, in order of level.
struct Locales {
  std::vector<std::uint32_t> locale_of_face;
  std::vector<double> area, hyperbolic_area,
      hyperbolic_sum;                 // sum: integral of |K| over the hyperbolic faces
  std::vector<Vec3d> normal_sum;      // integral of the normal: zero for a ring
  std::vector<std::uint32_t> before;  // neighbour one level nearer with the longest contact
};
constexpr std::uint32_t kNoLocale = 0xFFFFFFFF;

Locales find_locales(const Surface& tube, std::span<const double> face_gaussian,
                     std::span<const double> distance, double width) {
  const std::size_t face_count = tube.faces.size();
  std::vector<std::uint32_t> level(face_count);
  for (std::size_t f = 0; f < face_count; ++f) level[f] = static_cast<std::uint32_t>(distance[f] / width);
  Components bands(face_count);
  for (const Link& link : tube.links)
    if (level[link.face[0]] == level[link.face[1]]) bands.join(link.face[0], link.face[1]);

  Locales locales;
  std::vector<std::uint32_t> roots;
  for (std::uint32_t f = 0; f < face_count; ++f)
    if (bands.find(f) == f) roots.push_back(f);
  std::stable_sort(roots.begin(), roots.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return level[a] < level[b]; });
  std::vector<std::uint32_t> number(face_count, kNoLocale);
  for (std::uint32_t i = 0; i < roots.size(); ++i) number[roots[i]] = i;
  locales.locale_of_face.resize(face_count);
  locales.area.assign(roots.size(), 0);
  locales.hyperbolic_area.assign(roots.size(), 0);
  locales.hyperbolic_sum.assign(roots.size(), 0);
  locales.normal_sum.assign(roots.size(), {});
  for (std::uint32_t f = 0; f < face_count; ++f) {
    const std::uint32_t l = locales.locale_of_face[f] = number[bands.find(f)];
    locales.area[l] += tube.area[f];
    locales.normal_sum[l] = locales.normal_sum[l] + tube.area[f] * tube.normal[f];
    if (!(face_gaussian[f] < 0)) continue;
    locales.hyperbolic_area[l] += tube.area[f];
    locales.hyperbolic_sum[l] -= tube.area[f] * face_gaussian[f];
  }
  std::map<std::pair<std::uint32_t, std::uint32_t>, double> contact;  // (locale, neighbour before it)
  for (const Link& link : tube.links) {
    const std::uint32_t a = locales.locale_of_face[link.face[0]], b = locales.locale_of_face[link.face[1]];
    if (a != b) contact[{std::max(a, b), std::min(a, b)}] += link.length;
  }
  locales.before.assign(roots.size(), kNoLocale);
  std::vector<double> longest(roots.size(), 0);
  for (const auto& [pair, length] : contact)
    if (length > longest[pair.first]) {
      longest[pair.first] = length;
      locales.before[pair.first] = pair.second;
    }
  return locales;
}

// Piece of each locale. A new piece begins at a ring that passes both tests once the piece before has bent
// enough.
std::vector<std::uint32_t> pieces_along(const Locales& locales, const DecomposeOptions& options,
                                        double min_area, std::uint32_t& piece_count) {
  std::vector<std::uint32_t> piece(locales.area.size());
  std::vector<double> bent, area;  // hyperbolic sum [sr] and area of each piece
  for (std::size_t l = 0; l < piece.size(); ++l) {
    const bool is_hyperbolic = norm(locales.normal_sum[l]) < kMaxNormal * locales.area[l] &&
                               locales.hyperbolic_area[l] > options.k_h * locales.area[l] &&
                               locales.hyperbolic_sum[l] > options.t_h * locales.hyperbolic_area[l];
    const bool is_first = locales.before[l] == kNoLocale;
    piece[l] = is_first ? 0 : piece[locales.before[l]];
    if (is_first ? bent.empty()
                 : is_hyperbolic && area[piece[l]] >= min_area &&
                       bent[piece[l]] + locales.hyperbolic_sum[l] > 2 * kPartBend_rad) {
      piece[l] = static_cast<std::uint32_t>(bent.size());
      bent.push_back(0);
      area.push_back(0);
    }
    bent[piece[l]] += locales.hyperbolic_sum[l];
    area[piece[l]] += locales.area[l];
  }
  piece_count = static_cast<std::uint32_t>(bent.size());
  return piece;
}

}  // namespace

void cut_by_hyperbolic_curvature(const Surface& surface, std::span<const double> face_gaussian,
                                 const DecomposeOptions& options, Segmentation& segmentation) {
  const Rows faces = faces_of_segments(segmentation);
  const auto segment_count = static_cast<std::uint32_t>(segmentation.reasons.size());
  for (std::uint32_t s = 0; s < segment_count; ++s) {
    const Surface tube = make_surface(extract(surface.points, surface.faces, faces[s]));
    // One end: the vertex farthest from the vertex farthest from any.
    std::uint32_t end = 0;
    for (int sweep = 0; sweep < 2; ++sweep) {
      const std::vector<float> d = fast_marching(tube, {&end, 1});
      end = static_cast<std::uint32_t>(std::max_element(d.begin(), d.end()) - d.begin());
    }
    const std::vector<float> at_vertices = fast_marching(tube, {&end, 1});
    const std::vector<double> distance =
        face_means(tube, std::vector<double>(at_vertices.begin(), at_vertices.end()));
    std::vector<double> gaussian;  // on the tube's own unit-area scale
    for (const std::uint32_t f : faces[s]) gaussian.push_back(face_gaussian[f] * tube.scale_m * tube.scale_m);
    const double width = std::max(options.locale_width / tube.scale_m, kLocaleEdges * mean_edge(tube));
    const Locales locales = find_locales(tube, gaussian, distance, width);
    const double min_area = options.min_part_area / (tube.scale_m * tube.scale_m);
    std::uint32_t piece_count = 0;
    const std::vector<std::uint32_t> piece = pieces_along(locales, options, min_area, piece_count);
    if (piece_count < 2) continue;

    Segmentation pieces = one_segment(tube.faces.size());
    pieces.reasons.assign(piece_count, CutReason::kHyperbolic);
    for (std::size_t f = 0; f < tube.faces.size(); ++f) pieces.label[f] = piece[locales.locale_of_face[f]];
    join_small_pieces(tube, min_area, pieces);
    const Rows faces_of_piece = faces_of_segments(pieces);
    double volume = 0;
    std::vector<std::uint32_t> all(tube.faces.size());
    for (std::uint32_t f = 0; f < all.size(); ++f) all[f] = f;
    for (std::size_t p = 0; p < pieces.reasons.size(); ++p) volume += hull_volume(tube, faces_of_piece[p]);
    if (pieces.reasons.size() < 2 || !(volume <= (1 - kMinHullGain) * hull_volume(tube, all))) continue;
    const auto first_new = static_cast<std::uint32_t>(segmentation.reasons.size());
    segmentation.reasons[s] = CutReason::kHyperbolic;
    segmentation.reasons.insert(segmentation.reasons.end(), pieces.reasons.size() - 1,
                                CutReason::kHyperbolic);
    for (std::size_t f = 0; f < tube.faces.size(); ++f)
      if (pieces.label[f] > 0) segmentation.label[faces[s][f]] = first_new + pieces.label[f] - 1;
  }
}

}  // namespace sqmap::bake
