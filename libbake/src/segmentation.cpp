// SPDX-License-Identifier: GPL-3.0-or-later
#include "segmentation.hpp"

#include <algorithm>
#include <array>
#include <map>

#include "components.hpp"
#include "convexity.hpp"

namespace sqmap::bake {
namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFF;

// Relabels so that every segment is one connected piece; pieces get numbers in order of their first face.
void split_pieces(const Surface& surface, Segmentation& segmentation) {
  std::vector<std::uint32_t> piece(surface.faces.size(), kNone), stack;
  std::vector<CutReason> reasons;
  for (std::uint32_t start = 0; start < surface.faces.size(); ++start) {
    if (piece[start] != kNone) continue;
    const auto number = static_cast<std::uint32_t>(reasons.size());
    reasons.push_back(segmentation.reasons[segmentation.label[start]]);
    piece[start] = number;
    stack.assign(1, start);
    while (!stack.empty()) {
      const std::uint32_t f = stack.back();
      stack.pop_back();
      for (const std::uint32_t link : surface.links_of_face[f]) {
        const std::uint32_t g = surface.other_face(surface.links[link], f);
        if (piece[g] != kNone || segmentation.label[g] != segmentation.label[start]) continue;
        piece[g] = number;
        stack.push_back(g);
      }
    }
  }
  segmentation.label = std::move(piece);
  segmentation.reasons = std::move(reasons);
}

using Pair = std::pair<std::uint32_t, std::uint32_t>;

std::map<Pair, std::vector<std::uint32_t>> borders(const Surface& surface, const Segmentation& segmentation) {
  std::map<Pair, std::vector<std::uint32_t>> links;
  for (std::uint32_t i = 0; i < surface.links.size(); ++i) {
    const std::uint32_t a = segmentation.label[surface.links[i].face[0]],
                        b = segmentation.label[surface.links[i].face[1]];
    if (a != b) links[{std::min(a, b), std::max(a, b)}].push_back(i);
  }
  return links;
}

std::vector<double> segment_areas(const Surface& surface, const Segmentation& segmentation) {
  std::vector<double> area(segmentation.reasons.size(), 0);
  for (std::size_t f = 0; f < surface.faces.size(); ++f) area[segmentation.label[f]] += surface.area[f];
  return area;
}

// Joins `from` into `to`; the number `from` stays unused until split_pieces renumbers.
void join(Segmentation& segmentation, std::uint32_t from, std::uint32_t to) {
  for (std::uint32_t& label : segmentation.label)
    if (label == from) label = to;
}

// Joins every segment below `min_area` to the neighbour it shares the longest border with; false when there
// is none.
bool join_small(const Surface& surface, double min_area, Segmentation& segmentation) {
  const std::vector<double> area = segment_areas(surface, segmentation);
  std::map<Pair, double> length;
  for (const Link& link : surface.links) {
    const std::uint32_t a = segmentation.label[link.face[0]], b = segmentation.label[link.face[1]];
    if (a == b) continue;
    length[{a, b}] += link.length;
    length[{b, a}] += link.length;
  }
  Components groups(area.size());
  bool joined = false;
  for (auto row = length.begin(); row != length.end();) {
    const std::uint32_t segment = row->first.first;
    std::uint32_t target = kNone;
    double longest = -1;
    for (; row != length.end() && row->first.first == segment; ++row)
      if (row->second > longest) {
        longest = row->second;
        target = row->first.second;
      }
    if (!(area[segment] < min_area)) continue;
    groups.join(segment, target);
    joined = true;
  }
  // A group takes the reason of its largest member.
  std::vector<std::uint32_t> largest(area.size(), kNone);
  for (std::uint32_t s = 0; s < area.size(); ++s) {
    std::uint32_t& best = largest[groups.find(s)];
    if (best == kNone || area[s] > area[best]) best = s;
  }
  for (std::uint32_t& label : segmentation.label) label = largest[groups.find(label)];
  return joined;
}

bool merge_flattest(const Surface& surface, std::span<const double> link_bend, double min_concavity,
                    Segmentation& segmentation) {
  double flattest = min_concavity;
  Pair best{kNone, kNone};
  for (const auto& [pair, shared] : borders(surface, segmentation)) {
    const Border border = measure_border(surface, link_bend, shared);
    if (!(border.concavity < flattest)) continue;
    flattest = border.concavity;
    best = pair;
  }
  if (best.first == kNone) return false;
  const std::vector<double> area = segment_areas(surface, segmentation);
  const bool first_is_larger = area[best.first] >= area[best.second];
  join(segmentation, first_is_larger ? best.second : best.first, first_is_larger ? best.first : best.second);
  return true;
}

}  // namespace

Segmentation one_segment(std::size_t face_count) {
  return {std::vector<std::uint32_t>(face_count, 0), {CutReason::kWhole}};
}

Rows faces_of_segments(const Segmentation& segmentation) {
  std::vector<std::array<std::uint32_t, 2>> pairs;
  pairs.reserve(segmentation.label.size());
  for (std::uint32_t f = 0; f < segmentation.label.size(); ++f) pairs.push_back({segmentation.label[f], f});
  return group_rows(segmentation.reasons.size(), pairs);
}

int apply_cut(const Surface& surface, std::span<const double> link_bend, std::span<const std::uint8_t> side,
              const CutRules& rules, CutReason reason, Segmentation& segmentation) {
  const Rows faces = faces_of_segments(segmentation);
  const auto segment_count = static_cast<std::uint32_t>(segmentation.reasons.size());
  std::vector<std::vector<std::uint32_t>> new_border(segment_count);
  for (std::uint32_t i = 0; i < surface.links.size(); ++i) {
    const auto [a, b] = surface.links[i].face;
    if (side[a] != side[b] && segmentation.label[a] == segmentation.label[b])
      new_border[segmentation.label[a]].push_back(i);
  }
  int count = 0;
  for (std::uint32_t s = 0; s < segment_count; ++s) {
    if (new_border[s].empty()) continue;
    std::array<std::vector<std::uint32_t>, 2> piece;
    std::array<double, 2> area{};
    for (const std::uint32_t f : faces[s]) {
      piece[side[f]].push_back(f);
      area[side[f]] += surface.area[f];
    }
    const double smaller = std::min(area[0], area[1]);
    if (!(smaller >= rules.min_area)) continue;
    const double strength = border_strength(measure_border(surface, link_bend, new_border[s]), smaller);
    if (!(strength >= rules.min_strength)) continue;
    if (strength < rules.proven_strength && hull_volume(surface, piece[0]) + hull_volume(surface, piece[1]) >
                                                (1 - rules.min_hull_gain) * hull_volume(surface, faces[s]))
      continue;
    for (const std::uint32_t f : piece[1])
      segmentation.label[f] = static_cast<std::uint32_t>(segmentation.reasons.size());
    segmentation.reasons[s] = reason;
    segmentation.reasons.push_back(reason);
    ++count;
  }
  return count;
}

void join_small_pieces(const Surface& surface, double min_area, Segmentation& segmentation) {
  split_pieces(surface, segmentation);
  while (join_small(surface, min_area, segmentation)) split_pieces(surface, segmentation);
  if (segmentation.reasons.size() == 1) segmentation.reasons[0] = CutReason::kWhole;
}

void merge_over_flat_borders(const Surface& surface, std::span<const double> link_bend, double min_concavity,
                             Segmentation& segmentation) {
  while (merge_flattest(surface, link_bend, min_concavity, segmentation)) split_pieces(surface, segmentation);
  if (segmentation.reasons.size() == 1) segmentation.reasons[0] = CutReason::kWhole;
}

}  // namespace sqmap::bake
