// SPDX-License-Identifier: GPL-3.0-or-later
#include "segmentation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>

#include "components.hpp"
#include "convexity.hpp"

namespace sqmap::bake {
double tune(const char* name, double value);
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

// Joins every segment below `min_area` to the neighbour it shares the longest border with; false when there is none.
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

int apply_cut(const Surface& surface, std::span<const double> link_bend, std::span<const std::uint8_t> side,
              const CutRules& rules, CutReason reason, Segmentation& segmentation) {
  const std::size_t segment_count = segmentation.reasons.size();
  std::vector<double> inside(segment_count, 0), outside(segment_count, 0);
  for (std::size_t f = 0; f < surface.faces.size(); ++f)
    (side[f] ? inside : outside)[segmentation.label[f]] += surface.area[f];
  std::vector<std::vector<std::uint32_t>> new_border(segment_count);
  for (std::uint32_t i = 0; i < surface.links.size(); ++i) {
    const auto [a, b] = surface.links[i].face;
    if (side[a] != side[b] && segmentation.label[a] == segmentation.label[b])
      new_border[segmentation.label[a]].push_back(i);
  }
  std::vector<std::uint32_t> split(segment_count, kNone);
  int count = 0;
  for (std::size_t s = 0; s < segment_count; ++s) {
    const double smaller = std::min(inside[s], outside[s]);
    if (smaller < rules.min_area) continue;
    const Border border = measure_border(surface, link_bend, new_border[s]);
    if (border.concavity < rules.min_concavity) continue;
    if (protrusion_ratio(smaller, border.length2) < rules.min_protrusion) continue;
    std::array<std::vector<std::uint32_t>, 3> faces;  // outside, inside, all
    for (std::uint32_t f = 0; f < surface.faces.size(); ++f)
      if (segmentation.label[f] == s) {
        faces[side[f]].push_back(f);
        faces[2].push_back(f);
      }
    const double gain = 1 - (hull_volume(surface, faces[0]) + hull_volume(surface, faces[1])) / hull_volume(surface, faces[2]);
    if (std::getenv("VERBOSE")) std::fprintf(stderr, "  gain %.3f conc %.3f prot %.2f area %.3f of %.3f\n", gain, border.concavity, protrusion_ratio(smaller, border.length2), smaller, inside[s]+outside[s]);
    if (gain < tune("GAINMIN", 0.05) && border.concavity * std::min(1.0, std::log(std::max(1.0, protrusion_ratio(smaller, border.length2))) / 3) < tune("STRONG", 0.3)) continue;
    split[s] = static_cast<std::uint32_t>(segmentation.reasons.size());
    segmentation.reasons.push_back(reason);
    if (segmentation.reasons[s] == CutReason::kWhole) segmentation.reasons[s] = reason;
    ++count;
  }
  for (std::size_t f = 0; f < surface.faces.size(); ++f)
    if (side[f] && split[segmentation.label[f]] != kNone) segmentation.label[f] = split[segmentation.label[f]];
  return count;
}

void tidy(const Surface& surface, std::span<const double> link_bend, const CutRules& rules,
          Segmentation& segmentation) {
  split_pieces(surface, segmentation);
  while (join_small(surface, rules.min_area, segmentation)) split_pieces(surface, segmentation);
  while (merge_flattest(surface, link_bend, rules.min_concavity, segmentation)) split_pieces(surface, segmentation);
  if (segmentation.reasons.size() == 1) segmentation.reasons.assign(1, CutReason::kWhole);
}

}  // namespace sqmap::bake
