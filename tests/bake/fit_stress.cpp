// SPDX-License-Identifier: GPL-3.0-or-later
//
// fit_stress FOLDER COUNT [SEED]: bounds COUNT connected pieces of the OFF meshes in a folder, from single
// triangles to whole meshes, moved and scaled at random. Every twentieth fit is the full one, the others are
// quick. Checks that each is finite, holds every point in double and in float, and comes out the same from
// the points in another order. Prints why the fits ended and how many iterations they took. Exit code 0: all
// passed; 1: some did not; 2: usage.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <tbb/parallel_for.h>

#include "sqmap/bake/fit.hpp"
#include "sqmap/bake/mesh.hpp"

namespace sqmap::bake {
namespace {

constexpr std::uint32_t kFullEvery = 20;

struct Source {
  std::string name;
  Mesh mesh;
  std::vector<std::vector<std::uint32_t>> faces_of_vertex;
};

std::vector<Source> read_folder(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> paths;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.path().extension() == ".off") paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end());
  std::vector<Source> sources;
  for (const auto& path : paths) {
    auto read = read_mesh(path);
    if (!read) continue;  // some are there to be refused
    Source source{path.filename().string(), std::move(read.value().mesh), {}};
    source.faces_of_vertex.resize(source.mesh.vertices_m.size());
    for (std::uint32_t f = 0; f < source.mesh.faces.size(); ++f)
      for (const std::uint32_t v : source.mesh.faces[f]) source.faces_of_vertex[v].push_back(f);
    if (!source.mesh.faces.empty()) sources.push_back(std::move(source));
  }
  return sources;
}

double uniform(std::mt19937_64& rng) { return static_cast<double>(rng() >> 11) * 0x1.0p-53; }

/// Corners of faces that grow from one, as many as a number drawn evenly in the logarithm says.
std::vector<Vec3d> piece(const Source& source, std::mt19937_64& rng) {
  const auto face_count = static_cast<double>(source.mesh.faces.size());
  const auto wanted = static_cast<std::size_t>(std::ceil(std::pow(face_count, uniform(rng))));
  std::vector<std::uint32_t> queue{static_cast<std::uint32_t>(uniform(rng) * face_count)};
  std::vector<bool> is_queued(source.mesh.faces.size());
  is_queued[queue[0]] = true;
  std::vector<bool> is_taken(source.mesh.vertices_m.size());
  const double scale = std::pow(10.0, 6 * uniform(rng) - 3);
  const Quaternion q{uniform(rng) - 0.5, uniform(rng) - 0.5, uniform(rng) - 0.5, uniform(rng) - 0.5};
  const Rotation<double> turn = rotation(q);
  std::vector<Vec3d> points;
  for (std::size_t k = 0; k < queue.size() && k < wanted; ++k) {
    for (const std::uint32_t v : source.mesh.faces[queue[k]]) {
      if (!is_taken[v]) points.push_back(turn.apply(scale * source.mesh.vertices_m[v]));
      is_taken[v] = true;
      for (const std::uint32_t next : source.faces_of_vertex[v]) {
        if (!is_queued[next]) queue.push_back(next);
        is_queued[next] = true;
      }
    }
  }
  return points;
}

struct Verdict {
  std::string complaint;
  FitStop stop{};
  int iterations{};
};

Verdict examine(const std::vector<Vec3d>& points, const FitOptions& options, std::mt19937_64& rng) {
  const auto found = fit_superquadric(points, options);
  if (!found) return {"refused: " + found.error().finding};
  const Fit& fit = found.value();
  const Vec3d& a = fit.shape.semi_axes_m;
  const Vec3d& t = fit.object_from_part.translation_m;
  const Quaternion& q = fit.object_from_part.orientation;
  const double sum = a.x + a.y + a.z + t.x + t.y + t.z + q.w + q.x + q.y + q.z + fit.shape.e1 + fit.shape.e2;
  if (!std::isfinite(sum + fit.volume_m3 + fit.mean_residual)) return {"not finite"};
  if (!(std::min({a.x, a.y, a.z}) > 0)) return {"a semi-axis is not positive"};
  const SuperquadricOf<float> in_float{cast<float>(a), static_cast<float>(fit.shape.e1),
                                       static_cast<float>(fit.shape.e2)};
  const Rotation<double> turn = rotation(q);
  for (const Vec3d& p : points) {
    const Vec3d in_part = turn.apply_inverse(p - t);
    if (!(inside_outside_radial(fit.shape, in_part) <= 1)) return {"a point lies outside"};
    if (!(inside_outside_radial(in_float, cast<float>(in_part)) <= 1))
      return {"a point lies outside in float"};
  }
  std::vector<Vec3d> shuffled = points;
  for (std::size_t k = shuffled.size(); k > 1; --k)
    std::swap(shuffled[k - 1], shuffled[static_cast<std::size_t>(uniform(rng) * static_cast<double>(k))]);
  const auto again = fit_superquadric(shuffled, options);
  if (!again || !(again.value().shape == fit.shape) ||
      !(again.value().object_from_part == fit.object_from_part) || again.value().iterations != fit.iterations)
    return {"another order of the points gives another superquadric"};
  return {"", fit.stop, fit.iterations};
}

int run(const std::filesystem::path& folder, std::uint32_t count, std::uint64_t seed) {
  const std::vector<Source> sources = read_folder(folder);
  if (sources.empty()) return std::fprintf(stderr, "fit_stress: no OFF mesh in %s\n", folder.c_str()), 2;
  std::vector<Verdict> verdicts(count);
  tbb::parallel_for(0U, count, [&](std::uint32_t i) {
    std::mt19937_64 rng(seed + i);
    const auto which = static_cast<std::size_t>(uniform(rng) * static_cast<double>(sources.size()));
    const std::vector<Vec3d> points = piece(sources[which], rng);
    FitOptions options;
    options.quick = i % kFullEvery != 0;
    verdicts[i] = examine(points, options, rng);
    if (!verdicts[i].complaint.empty())
      verdicts[i].complaint += " (" + sources[which].name + ", " + std::to_string(points.size()) + " points)";
  });

  std::uint32_t failures = 0;
  std::map<FitStop, std::vector<int>> iterations;
  for (std::uint32_t i = 0; i < count; ++i) {
    if (verdicts[i].complaint.empty()) {
      iterations[verdicts[i].stop].push_back(verdicts[i].iterations);
    } else {
      ++failures;
      std::printf("fit %u: %s\n", i, verdicts[i].complaint.c_str());
    }
  }
  constexpr std::array<const char*, 4> kNames{"a single point", "no further gain", "no descent",
                                              "iterations"};
  std::printf("%u fits of %zu meshes, %u failed\nstopped by             fits  iterations: median     most\n",
              count, sources.size(), failures);
  for (auto& [stop, numbers] : iterations) {
    std::sort(numbers.begin(), numbers.end());
    std::printf("%-18s %8zu %19d %8d\n", kNames[static_cast<std::size_t>(stop)], numbers.size(),
                numbers[numbers.size() / 2], numbers.back());
  }
  return failures == 0 ? 0 : 1;
}

}  // namespace
}  // namespace sqmap::bake

int main(int argc, char** argv) {
  const auto number = [&](int k) { return std::strtoull(argv[k], nullptr, 10); };
  if ((argc != 3 && argc != 4) || number(2) < 1 || number(2) > 100'000'000) {
    std::fputs("usage: fit_stress FOLDER COUNT [SEED]\n", stderr);
    return 2;
  }
  return sqmap::bake::run(argv[1], static_cast<std::uint32_t>(number(2)), argc == 4 ? number(3) : 1);
}
