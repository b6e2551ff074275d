// SPDX-License-Identifier: GPL-3.0-or-later
#include "sqmap/bake/decompose.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <chrono>
#include <cstdlib>
#include <numeric>

#include <tbb/parallel_for.h>

#include "curvature.hpp"
#include "cuts.hpp"
#include "geodesics.hpp"
#include "locales.hpp"
#include "segmentation.hpp"
#include "surface.hpp"
#include "working_mesh.hpp"

namespace sqmap::bake {
struct Tick { std::chrono::steady_clock::time_point t = std::chrono::steady_clock::now(); void operator()(const char* n) { auto u = std::chrono::steady_clock::now(); if (std::getenv("TICK")) std::fprintf(stderr, "  %s %.3f\n", n, std::chrono::duration<double>(u - t).count()); t = u; } };
double tune(const char* name, double value) {
  const char* text = std::getenv(name);
  return text ? std::atof(text) : value;
}
namespace {

constexpr std::size_t kSampleCount = 256;
using Signature = std::vector<double>;  // area weight of each sample beyond the loop, or 0

struct Candidate {
  Loop loop;
  double salience;
  std::vector<std::uint8_t> beyond;  // of each sample
};

double salience(const Border& border, double area) {
  return border.concavity * std::min(1.0, std::log(std::max(1.0, protrusion_ratio(area, border.length2))) / tune("LOGP", 3));
}

double difference(const std::vector<Source>& samples, const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b) {
  double same = 0, other = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) (a[i] == b[i] ? same : other) += samples[i].area;
  return std::min(same, other);
}

Segmentation segment(const Surface& surface, const DecomposeOptions& options) {
  Segmentation partition{std::vector<std::uint32_t>(surface.faces.size(), 0), {CutReason::kWhole}};
  if (surface.faces.size() < 20) return partition;
  Tick tick;
  const Curvature bend = curvature(surface, tune("CW", 0.01));
  const std::vector<double> link_bend = bend_across_links(surface, bend);

  tick("curvature");
  const std::vector<Source> sources = farthest_point_sources(surface, options.source_count);
  const std::vector<Source> samples = farthest_point_sources(surface, kSampleCount);
  std::vector<std::uint32_t> source_vertices;
  for (const Source& source : sources) source_vertices.push_back(source.vertex);
  tick("fps");
  const std::vector<std::vector<float>> fields = distances_from_each(surface, source_vertices);

  tick("fields");
  const double min_concavity = tune("TAU", 0.1), raw_concavity = min_concavity * tune("RAW", 0), min_protrusion = tune("PROT", 1.5);
  const CutRules rules{options.min_part_area, min_concavity, min_protrusion};
  std::vector<std::vector<Candidate>> found(fields.size());
  tbb::parallel_for(std::size_t{0}, fields.size(), [&](std::size_t i) {
    std::vector<Loop> loops = find_loops(surface, bend, fields[i], tune("H", 0.015));
    std::vector<double> best_child(loops.size(), -2);
    for (const Loop& loop : loops)
      if (loop.parent != Loop::kNone && loop.area > 0.5 * loops[loop.parent].area)
        best_child[loop.parent] = std::max(best_child[loop.parent], loop.concavity);
    for (std::size_t l = 0; l < loops.size(); ++l) {
      Loop& loop = loops[l];
      if (loop.concavity < raw_concavity || loop.area < options.min_part_area || loop.area > 1 - options.min_part_area) continue;
      if (protrusion_ratio(std::min(loop.area, 1 - loop.area), loop.length2) < min_protrusion) continue;
      if (loop.concavity < best_child[l]) continue;
      if (loop.parent != Loop::kNone && loop.concavity < loops[loop.parent].concavity) continue;
      loop.field = static_cast<std::uint32_t>(i);
      found[i].push_back({loop, salience({loop.length, loop.length2, loop.concavity}, std::min(loop.area, 1 - loop.area)), {}});
    }
    for (Candidate& candidate : found[i]) {
      const std::vector<std::uint8_t> side = faces_beyond(surface, fields[i], candidate.loop);
      for (const Source& sample : samples) candidate.beyond.push_back(side[surface.faces_of_vertex[sample.vertex][0]]);
    }
  });
  tick("loops");
  std::vector<Candidate> candidates;
  for (auto& list : found) candidates.insert(candidates.end(), list.begin(), list.end());
  std::stable_sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) { return a.salience > b.salience; });
  std::vector<Candidate> kept;
  for (const Candidate& candidate : candidates) {
    const double area = std::min(candidate.loop.area, 1 - candidate.loop.area);
    bool is_new = true;
    for (const Candidate& other : kept)
      if (difference(samples, candidate.beyond, other.beyond) < std::max(tune("NMSA", 0.5) * options.min_part_area, tune("NMS", 0.1) * area)) {
        is_new = false;
        break;
      }
    if (is_new) kept.push_back(candidate);
    if (kept.size() >= tune("MAXC", 100)) break;
  }
  tick("nms");
  struct Cut {
    std::vector<std::uint8_t> side;
    Border border;
    double salience;
  };
  std::vector<Cut> cuts(kept.size());
  tbb::parallel_for(std::size_t{0}, kept.size(), [&](std::size_t i) {
    Cut& cut = cuts[i];
    cut.side = refine_border(surface, link_bend, faces_beyond(surface, fields[kept[i].loop.field], kept[i].loop));
    std::vector<std::uint32_t> links;
    for (std::uint32_t l = 0; l < surface.links.size(); ++l)
      if (cut.side[surface.links[l].face[0]] != cut.side[surface.links[l].face[1]]) links.push_back(l);
    cut.border = measure_border(surface, link_bend, links);
    double inside = 0;
    for (std::size_t f = 0; f < cut.side.size(); ++f) inside += cut.side[f] ? surface.area[f] : 0;
    cut.salience = salience(cut.border, std::min(inside, 1 - inside));
  });
  tick("refine");
  std::vector<std::uint32_t> order(cuts.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return cuts[a].salience > cuts[b].salience; });
  int applied = 0;
  if (std::getenv("VERBOSE")) for (const std::uint32_t i : order) { double in=0; for (std::size_t f=0;f<cuts[i].side.size();++f) in+=cuts[i].side[f]?surface.area[f]:0;
    std::fprintf(stderr, "field %u level %.3f area %.3f len %.3f conc %.3f prot %.2f -> area %.3f len %.3f conc %.3f prot %.2f\n", kept[i].loop.field, kept[i].loop.level, kept[i].loop.area, kept[i].loop.length, kept[i].loop.concavity, protrusion_ratio(std::min(kept[i].loop.area,1-kept[i].loop.area),kept[i].loop.length2), in, cuts[i].border.length, cuts[i].border.concavity, protrusion_ratio(std::min(in,1-in),cuts[i].border.length2)); }
  for (const std::uint32_t i : order) {
    if (cuts[i].salience < tune("SAL", 0.15)) break;
    applied += apply_cut(surface, link_bend, cuts[i].side, rules, CutReason::kBoundaryStrength, partition) > 0;
  }
  if (std::getenv("VERBOSE")) std::fprintf(stderr, "candidates %zu kept %zu applied %d\n", candidates.size(), kept.size(), applied);
  tick("apply");
  tidy(surface, link_bend, rules, partition);
  return partition;
}

}  // namespace

Outcome DecomposeOptions::check() const {
  if (source_count < 1)
    return Error{Status::kBadOption, "decompose.source_count = " + std::to_string(source_count) + ", must be > 0", ""};
  return Done{};
}

Result<Decomposition> decompose(const PreparedMesh& prepared, const DecomposeOptions& options, const Progress& progress) {
  if (const Outcome outcome = options.check(); !outcome) return outcome.error();
  const Mesh& mesh = prepared.mesh;
  std::uint32_t component_count = 0;
  for (const std::uint32_t c : prepared.component) component_count = std::max(component_count, c + 1);
  std::vector<std::array<std::uint32_t, 2>> pairs;
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) pairs.push_back({prepared.component[f], f});
  const Rows faces_of = group_rows(component_count, pairs);
  Decomposition result;
  double total_area = 0;
  for (const auto& [a, b, c] : mesh.faces) total_area += 0.5 * norm(cross(mesh.vertices_m[b] - mesh.vertices_m[a], mesh.vertices_m[c] - mesh.vertices_m[a]));
  result.label.assign(mesh.faces.size(), 0);
  for (std::uint32_t c = 0; c < component_count; ++c) {
    progress.at("decompose", static_cast<double>(c) / component_count);
    if (progress.stop()) return Error{Status::kCancelled, "cancelled while decomposing", ""};
    const Triangles input = extract(mesh.vertices_m, mesh.faces, faces_of[c]);
    Tick tick;
    const Surface full = make_surface(input);
    tick("full");
    const double share = full.scale_m * full.scale_m / total_area;
    const double coarser = std::pow(1 / share, 0.25);
    const WorkingMesh working = make_working_mesh(input, coarser * tune("SHORT", 0.01) * full.scale_m, coarser * tune("LONG", 0.03) * full.scale_m);
    const Surface surface = make_surface(working.triangles);
    tick("working");
    if (std::getenv("VERBOSE")) std::fprintf(stderr, "working faces %zu\n", surface.faces.size());
    const Segmentation coarse = share < options.min_part_area ? Segmentation{std::vector<std::uint32_t>(surface.faces.size(), 0), {CutReason::kWhole}} : segment(surface, options);
    Segmentation partition{std::vector<std::uint32_t>(full.faces.size()), coarse.reasons};
    std::vector<double> vote(coarse.reasons.size());
    for (std::size_t f = 0; f < full.faces.size(); ++f) {
      vote.assign(vote.size(), 0);
      for (const std::uint32_t g : working.faces_of_input[f]) vote[coarse.label[g]] += surface.area[g];
      partition.label[f] = static_cast<std::uint32_t>(std::max_element(vote.begin(), vote.end()) - vote.begin());
    }
    tidy(full, std::vector<double>(full.links.size(), 0), {0.5 * options.min_part_area, -2, 0}, partition);
    tick("project");
    for (std::size_t i = 0; i < partition.label.size(); ++i) result.label[faces_of[c][i]] = static_cast<std::uint32_t>(result.reasons.size()) + partition.label[i];
    for (const CutReason reason : partition.reasons) result.reasons.push_back(reason == CutReason::kWhole && component_count > 1 ? CutReason::kComponent : reason);
  }
  return result;
}

}  // namespace sqmap::bake
