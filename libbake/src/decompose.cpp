// SPDX-License-Identifier: GPL-3.0-or-later
#include "sqmap/bake/decompose.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string>

#include "criteria/boundary_strength.hpp"
#include "criteria/hyperbolic_curvature.hpp"
#include "curvature.hpp"
#include "geodesics.hpp"
#include "segmentation.hpp"
#include "surface.hpp"
#include "working_mesh.hpp"

namespace sqmap::bake {
namespace {

// Edge lengths of the working mesh: about 7,000 faces for a component that is the whole mesh.
constexpr double kShortestEdge = 0.01, kLongestEdge = 0.03;
// Radius of the window of the Gaussian curvature: a few edges of the working mesh.
constexpr double kGaussianWindow = 0.03;

Error bad(const char* name, double value, const char* required) {
  return {Status::kBadOption,
          std::string("decompose.") + name + " = " + std::to_string(value) + ", must be " + required, ""};
}

Rows faces_of_components(const PreparedMesh& prepared) {
  std::uint32_t component_count = 0;
  for (const std::uint32_t c : prepared.component) component_count = std::max(component_count, c + 1);
  std::vector<std::array<std::uint32_t, 2>> pairs;
  pairs.reserve(prepared.component.size());
  for (std::uint32_t f = 0; f < prepared.component.size(); ++f) pairs.push_back({prepared.component[f], f});
  return group_rows(component_count, pairs);
}

double face_area(const Mesh& mesh, std::uint32_t face) {
  const auto& [a, b, c] = mesh.faces[face];
  return 0.5 * norm(cross(mesh.vertices_m[b] - mesh.vertices_m[a], mesh.vertices_m[c] - mesh.vertices_m[a]));
}

Segmentation segment_working_mesh(const Surface& surface, const DecomposeOptions& options) {
  Segmentation segmentation = one_segment(surface.faces.size());
  if (options.use_boundary_strength) cut_by_boundary_strength(surface, options, segmentation);
  if (options.use_hyperbolic)
    cut_by_hyperbolic_curvature(surface, face_means(surface, curvature(surface, kGaussianWindow).gaussian),
                                options, segmentation);
  join_small_pieces(surface, options.min_part_area, segmentation);
  return segmentation;
}

// Segments of one component. `share` is its part of the whole mesh's area: small components are worked on
// coarsely.
Segmentation segment_component(const Triangles& input, double share, const DecomposeOptions& options) {
  const Surface full = make_surface(input);
  const double unit = full.scale_m * std::pow(share, -0.25);
  const WorkingMesh working = make_working_mesh(input, kShortestEdge * unit, kLongestEdge * unit);
  const Surface surface = make_surface(working.triangles);
  const Segmentation coarse = segment_working_mesh(surface, options);
  if (coarse.reasons.size() == 1) return one_segment(full.faces.size());

  Segmentation fine{std::vector<std::uint32_t>(full.faces.size()), coarse.reasons};
  std::vector<double> vote(coarse.reasons.size());
  for (std::size_t f = 0; f < full.faces.size(); ++f) {
    std::fill(vote.begin(), vote.end(), 0);
    for (const std::uint32_t g : working.faces_of_input[f]) vote[coarse.label[g]] += surface.area[g];
    fine.label[f] = static_cast<std::uint32_t>(std::max_element(vote.begin(), vote.end()) - vote.begin());
  }
  // Only scraps that the way back tore off: a part that made the minimum on the working mesh keeps its place.
  join_small_pieces(full, 0.5 * options.min_part_area, fine);
  return fine;
}

// Renumbers by descending area, ties by centroid, so that neither face order nor discovery shows.
void number_by_size(const Mesh& mesh, Decomposition& result) {
  struct Size {
    double area{};
    Vec3d moment{};
  };
  std::vector<Size> size(result.reasons.size());
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    const double area = face_area(mesh, f);
    size[result.label[f]].area += area;
    Vec3d& moment = size[result.label[f]].moment;
    for (const std::uint32_t v : mesh.faces[f]) moment = moment + (area / 3) * mesh.vertices_m[v];
  }
  std::vector<std::uint32_t> order(size.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    const auto key = [&](std::uint32_t s) {
      return std::array{-size[s].area, size[s].moment.x, size[s].moment.y, size[s].moment.z};
    };
    return key(a) < key(b);
  });
  std::vector<std::uint32_t> rank(order.size());
  std::vector<CutReason> reasons;
  for (std::uint32_t i = 0; i < order.size(); ++i) {
    rank[order[i]] = i;
    reasons.push_back(result.reasons[order[i]]);
  }
  for (std::uint32_t& label : result.label) label = rank[label];
  result.reasons = std::move(reasons);
}

// Calls visit(surface, faces) for every component with area.
template <class Visit>
void for_each_surface(const PreparedMesh& prepared, const Visit& visit) {
  const Rows faces_of = faces_of_components(prepared);
  for (std::size_t c = 0; c + 1 < faces_of.begin.size(); ++c) {
    const Surface surface = make_surface(extract(prepared.mesh.vertices_m, prepared.mesh.faces, faces_of[c]));
    if (surface.scale_m > 0) visit(surface, faces_of[c]);
  }
}

}  // namespace

Outcome DecomposeOptions::check() const {
  if (source_count < 1 || source_count > 1000) return bad("source_count", source_count, "in [1, 1000]");
  if (!(window > 0 && window <= 1)) return bad("window", window, "in (0, 1]");
  if (!(locale_width >= 0.005 && locale_width <= 0.5))
    return bad("locale_width", locale_width, "in [0.005, 0.5]");
  if (!(boundary_strength >= 0 && boundary_strength <= 1))
    return bad("boundary_strength", boundary_strength, "in [0, 1]");
  if (!(min_hull_gain >= 0 && min_hull_gain <= 1)) return bad("min_hull_gain", min_hull_gain, "in [0, 1]");
  if (!(k_h >= 0 && k_h <= 1)) return bad("k_h", k_h, "in [0, 1]");
  if (!(t_h >= 0)) return bad("t_h", t_h, ">= 0");
  if (!(min_part_area > 0 && min_part_area <= 0.5)) return bad("min_part_area", min_part_area, "in (0, 0.5]");
  return Done{};
}

Result<Decomposition> decompose(const PreparedMesh& prepared, const DecomposeOptions& options,
                                const Progress& progress) {
  if (const Outcome outcome = options.check(); !outcome) return outcome.error();
  const Mesh& mesh = prepared.mesh;
  if (prepared.component.size() != mesh.faces.size())
    return Error{Status::kInvalidMesh,
                 std::to_string(prepared.component.size()) + " component numbers for " +
                     std::to_string(mesh.faces.size()) + " faces, need one a face",
                 "call check_and_repair first"};
  const Rows faces_of = faces_of_components(prepared);
  const std::size_t component_count = faces_of.begin.size() - 1;
  double total_area = 0;
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) total_area += face_area(mesh, f);

  Decomposition result;
  result.label.assign(mesh.faces.size(), 0);
  if (options.join_components) {
    result.reasons = {CutReason::kWhole};
    progress.at("decompose", 1);
    return result;
  }
  for (std::size_t c = 0; c < component_count; ++c) {
    if (faces_of[c].empty()) continue;
    progress.at("decompose", static_cast<double>(c) / static_cast<double>(component_count));
    if (progress.stop()) return Error{Status::kCancelled, "cancelled while decomposing", ""};
    double area = 0;
    for (const std::uint32_t f : faces_of[c]) area += face_area(mesh, f);
    const double share = area / total_area;
    const Segmentation part =
        share >= options.min_part_area  // NaN, of a mesh without area: stays whole
            ? segment_component(extract(mesh.vertices_m, mesh.faces, faces_of[c]), share, options)
            : one_segment(faces_of[c].size());
    const auto first = static_cast<std::uint32_t>(result.reasons.size());
    for (std::size_t i = 0; i < part.label.size(); ++i) result.label[faces_of[c][i]] = first + part.label[i];
    for (const CutReason reason : part.reasons)
      result.reasons.push_back(reason == CutReason::kWhole && component_count > 1 ? CutReason::kComponent
                                                                                  : reason);
  }
  number_by_size(mesh, result);
  progress.at("decompose", 1);
  return result;
}

std::vector<double> protrusion(const PreparedMesh& prepared, int source_count) {
  std::vector<double> result(prepared.mesh.faces.size(), 0);
  for_each_surface(prepared, [&](const Surface& surface, std::span<const std::uint32_t> faces) {
    const std::vector<Source> sources =
        farthest_point_sources(surface, static_cast<std::size_t>(std::max(1, source_count)));
    std::vector<std::uint32_t> starts;
    for (const Source& source : sources) starts.push_back(source.vertex);
    const std::vector<double> at_faces =
        face_means(surface, vertex_protrusion(surface, sources, distances_from_each(surface, starts)));
    for (std::size_t i = 0; i < faces.size(); ++i) result[faces[i]] = at_faces[i];
  });
  return result;
}

std::vector<double> gaussian_curvature(const PreparedMesh& prepared) {
  std::vector<double> result(prepared.mesh.faces.size(), 0);
  for_each_surface(prepared, [&](const Surface& surface, std::span<const std::uint32_t> faces) {
    const std::vector<double> at_faces = face_means(surface, curvature(surface, kGaussianWindow).gaussian);
    for (std::size_t i = 0; i < faces.size(); ++i)
      result[faces[i]] = at_faces[i] / (surface.scale_m * surface.scale_m);
  });
  return result;
}

}  // namespace sqmap::bake
