// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <span>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "sqmap/asset/shape_table.hpp"

#include "part_lines.hpp"

namespace sqmap::bake {

namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// [0, 1) from 53 bits: unlike the standard distributions, the same on every library.
double uniform(std::mt19937_64& engine) { return static_cast<double>(engine() >> 11) * 0x1.0p-53; }

/// Depth that the map tells at a foot point, as layer 2 (bilinear) or layer 3 (fan over the cell's vertex
/// sample) reads it; NaN where the cell does not bound a surface patch.
double told_depth_m(const DistanceMap& map, const Foot<double>& foot, std::uint32_t stride,
                    bool third_layer) {
  const std::uint32_t row =
      std::min(static_cast<std::uint32_t>(foot.row) / stride * stride, map.rows - 1 - stride);
  const std::uint32_t col = std::min(static_cast<std::uint32_t>(foot.col), map.cols - 1) / stride * stride;
  const std::uint32_t next = (col + stride) % map.cols;
  const std::uint32_t corner[4] = {row * map.cols + col, row * map.cols + next,
                                   (row + stride) * map.cols + col, (row + stride) * map.cols + next};
  double d[4];
  for (int k = 0; k < 4; ++k) {
    if (map.code[corner[k]] == map.miss_code() || map.starts_inside(corner[k])) return kNone;
    d[k] = map.depth_m(map.code[corner[k]]);
  }
  const double s = (foot.row - row) / stride, t = (foot.col - col) / stride;
  if (third_layer && stride == 1) {
    const auto it =
        std::lower_bound(map.vertex_samples.begin(), map.vertex_samples.end(), corner[0],
                         [](const auto& sample, std::uint32_t cell) { return sample.cell < cell; });
    if (it != map.vertex_samples.end() && it->cell == corner[0]) {
      // The fan triangle (a, b, apex) that holds (s, t), by barycentric coordinates.
      const double place[4][2] = {{0, 0}, {0, 1}, {1, 1}, {1, 0}};
      const double depth[4] = {d[0], d[1], d[3], d[2]};
      const double as = it->row_256ths / 256.0, at = it->col_256ths / 256.0;
      for (int k = 0; k < 4; ++k) {
        const auto* a = place[k];
        const auto* b = place[(k + 1) % 4];
        const double area = (b[0] - a[0]) * (at - a[1]) - (b[1] - a[1]) * (as - a[0]);
        if (area == 0) continue;
        const double wc = ((b[0] - a[0]) * (t - a[1]) - (b[1] - a[1]) * (s - a[0])) / area;
        const double wb = ((s - a[0]) * (at - a[1]) - (t - a[1]) * (as - a[0])) / area;
        if (wc < -1e-9 || wb < -1e-9 || wb + wc > 1 + 1e-9) continue;
        return depth[k] + wb * (depth[(k + 1) % 4] - depth[k]) + wc * (map.depth_m(it->code) - depth[k]);
      }
    }
  }
  return (1 - s) * ((1 - t) * d[0] + t * d[1]) + s * ((1 - t) * d[2] + t * d[3]);
}

/// A shell point inside one superquadric, with the true depth of the mesh under its foot point.
struct Probe {
  std::uint32_t part;
  Foot<double> foot;
  double depth_m;
};

std::vector<Probe> probe(const Asset& asset, const ShellPoints& shell, const MeshQueries& queries) {
  std::vector<std::vector<Probe>> by_part(asset.parts.size());
  tbb::parallel_for(std::size_t{0}, asset.parts.size(), [&](std::size_t k) {
    const Part& part = asset.parts[k];
    const ShapeTable<double> table(part.shape, part.map.rows, part.map.cols);
    const PartLines lines(part.shape, part.object_from_part, queries);
    const Rotation<double> turn = rotation(part.object_from_part.orientation);
    const Vec3d half_m = half_extents_m(part.shape);
    std::vector<RayTracer::Hit> hits;
    for (const Vec3f& point : shell.points_m) {
      const Vec3d m = straightened(
          part.shape.bend, turn.apply_inverse(cast<double>(point) - part.object_from_part.translation_m));
      const bool in_box = std::abs(m.x) <= half_m.x && std::abs(m.y) <= half_m.y && std::abs(m.z) <= half_m.z;
      if (!in_box || !(inside_outside_radial(straight(part.shape), m) <= 1)) continue;
      const Foot<double> foot = table.foot(m);
      const SurfaceSample<double> r = table.sample(foot.row, foot.col);
      lines.trace(r.point_m, -r.normal, hits);
      if (!hits.empty()) by_part[k].push_back({static_cast<std::uint32_t>(k), foot, hits.front().t_m});
    }
  });
  std::vector<Probe> probes;
  for (const auto& list : by_part) probes.insert(probes.end(), list.begin(), list.end());
  return probes;
}

double eq35_percent(const Asset& asset, const std::vector<Probe>& probes, std::uint32_t layer,
                    std::uint32_t level) {
  double sum = 0;
  std::size_t count = 0;
  for (const Probe& p : probes) {
    const DistanceMap& map = asset.parts[p.part].map;
    const std::uint32_t stride = 1U << std::min(level, map.level_count - 1);
    const double told_m = told_depth_m(map, p.foot, stride, layer == 3);
    if (std::isnan(told_m)) continue;
    sum += std::abs((layer == 1 ? 0 : told_m) - p.depth_m);
    ++count;
  }
  return count > 0 ? 100 * sum / static_cast<double>(count) / asset.r_max_m : kNone;
}

/// What the runtime says of each point.
struct Told {
  std::vector<float> signed_distance_m;  ///< NaN: unknown
  std::vector<std::uint8_t> inside;
};

double misclassified_percent(const Told& told, const ShellPoints& shell) {
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < told.inside.size(); ++i)
    wrong += (told.inside[i] != 0) != (shell.signed_distance_m[i] < 0);
  return told.inside.empty() ? kNone
                             : 100.0 * static_cast<double>(wrong) / static_cast<double>(told.inside.size());
}

Told ask(const runtime::Object& object, const ShellPoints& shell, const runtime::QueryOptions& options) {
  const std::size_t count = shell.points_m.size();
  Told told{std::vector<float>(count), std::vector<std::uint8_t>(count)};
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, count, 1024), [&](const tbb::blocked_range<std::size_t>& range) {
        runtime::Answers answers;
        answers.signed_distance_m = std::span(told.signed_distance_m).subspan(range.begin(), range.size());
        answers.inside = std::span(told.inside).subspan(range.begin(), range.size());
        object.query(std::span(shell.points_m).subspan(range.begin(), range.size()), answers, options);
      });
  return told;
}

/// |told - true| signed distances [m], where one is told; inner points without one feel no force and count
/// with their whole depth.
std::vector<double> depth_errors_m(const Told& told, const ShellPoints& shell) {
  std::vector<double> errors_m;
  for (std::size_t i = 0; i < told.signed_distance_m.size(); ++i) {
    const double told_m = told.signed_distance_m[i], truth_m = shell.signed_distance_m[i];
    if (!std::isnan(told_m)) {
      errors_m.push_back(std::abs(told_m - truth_m));
    } else if (truth_m < 0) {
      errors_m.push_back(-truth_m);
    }
  }
  return errors_m;
}

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

}  // namespace

ShellError shell_error(const runtime::Object& object, const ShellPoints& shell) {
  const Told told = ask(object, shell, {runtime::Layer::kThree, 0});
  return {mean(depth_errors_m(told, shell)), misclassified_percent(told, shell) / 100};
}

ShellPoints sample_shell(const MeshQueries& queries, double half_width_m, std::uint32_t count,
                         std::uint64_t seed) {
  const Mesh& mesh = queries.mesh;
  std::vector<double> area_sum;
  double sum = 0;
  for (const auto& f : mesh.faces) {
    sum += norm(
        cross(mesh.vertices_m[f[1]] - mesh.vertices_m[f[0]], mesh.vertices_m[f[2]] - mesh.vertices_m[f[0]]));
    area_sum.push_back(sum);
  }
  ShellPoints shell;
  shell.points_m.resize(count);
  shell.face.resize(count);
  shell.signed_distance_m.resize(count);
  std::vector<Vec3d> surface_m(count);
  std::mt19937_64 engine(seed);
  for (std::uint32_t i = 0; i < count; ++i) {
    const double pick = uniform(engine) * sum, u = uniform(engine), v = uniform(engine), w = uniform(engine);
    const auto face = std::min<std::size_t>(
        static_cast<std::size_t>(std::upper_bound(area_sum.begin(), area_sum.end(), pick) - area_sum.begin()),
        mesh.faces.size() - 1);
    const auto& f = mesh.faces[face];
    const Vec3d &a = mesh.vertices_m[f[0]], &b = mesh.vertices_m[f[1]], &c = mesh.vertices_m[f[2]];
    const double root = std::sqrt(u);
    surface_m[i] = (1 - root) * a + root * (1 - v) * b + root * v * c;
    shell.points_m[i] =
        cast<float>(surface_m[i] + (2 * w - 1) * half_width_m * normalized(cross(b - a, c - a)));
    shell.face[i] = static_cast<std::uint32_t>(face);
  }
  tbb::parallel_for(0U, count, [&](std::uint32_t i) {
    // The truth of the point as rounded to float, which is what the runtime is asked.
    const Vec3d point_m = cast<double>(shell.points_m[i]);
    shell.signed_distance_m[i] = queries.signed_distance(point_m, norm(point_m - surface_m[i]));
  });
  return shell;
}

std::vector<ErrorRow> measure(const Asset& asset, const runtime::Object& object, const MeshQueries& queries,
                              std::uint32_t sample_count, std::uint64_t seed) {
  const ShellPoints wide = sample_shell(queries, 0.03 * asset.r_max_m, sample_count, seed);
  const ShellPoints narrow = sample_shell(queries, 0.005 * asset.r_max_m, sample_count, seed + 1);
  const std::vector<Probe> probes = probe(asset, wide, queries);
  std::vector<ErrorRow> rows;
  for (std::uint32_t level = 0; level < object.level_count(); ++level) {
    for (std::uint32_t layer = 1; layer <= 3; ++layer) {
      if (layer == 1 && level > 0) continue;  // layer 1 has no levels
      const runtime::QueryOptions options{static_cast<runtime::Layer>(layer), level};
      const Told of_wide = ask(object, wide, options), of_narrow = ask(object, narrow, options);
      std::vector<double> errors;
      if (layer > 1) errors = depth_errors_m(of_wide, wide);
      std::sort(errors.begin(), errors.end());
      ErrorRow row;
      row.level = level;
      row.layer = layer;
      row.eq35_percent = eq35_percent(asset, probes, layer, level);
      row.depth_mean_percent = errors.empty() ? kNone : 100 * mean(errors) / asset.r_max_m;
      row.depth_p95_percent = errors.empty() ? kNone : 100 * errors[errors.size() * 95 / 100] / asset.r_max_m;
      row.misclassified_3_percent = misclassified_percent(of_wide, wide);
      row.misclassified_05_percent = misclassified_percent(of_narrow, narrow);
      row.samples_3 = static_cast<std::uint32_t>(of_wide.inside.size());
      row.samples_05 = static_cast<std::uint32_t>(of_narrow.inside.size());
      row.samples_depth = static_cast<std::uint32_t>(errors.size());
      rows.push_back(row);
    }
  }
  return rows;
}

std::vector<double> error_by_part(const runtime::Object& object, const ShellPoints& shell,
                                  const std::vector<std::uint32_t>& part_of_face, std::uint32_t part_count,
                                  double worst_m, std::vector<std::uint32_t>& share) {
  const Told told = ask(object, shell, {runtime::Layer::kThree, 0});
  std::vector<double> error(part_count);
  share.assign(part_count, 0);
  for (std::size_t i = 0; i < told.inside.size(); ++i) {
    const std::uint32_t part = part_of_face[shell.face[i]];
    const double truth_m = shell.signed_distance_m[i], told_m = told.signed_distance_m[i];
    const bool inside = told.inside[i] != 0;
    double e = std::isnan(told_m) ? (truth_m > 0 && !inside ? 0 : worst_m)
                                  : std::min(worst_m, std::abs(told_m - truth_m));
    if (inside != (truth_m < 0)) e = std::max(e, std::min(worst_m, 2 * std::abs(truth_m)));
    error[part] += e;
    ++share[part];
  }
  for (std::uint32_t k = 0; k < part_count; ++k) error[k] /= std::max(1U, share[k]);
  return error;
}

}  // namespace sqmap::bake
