// SPDX-License-Identifier: Apache-2.0
#include "asset_diff.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include <fmt/format.h>

namespace sqmap::apps {
namespace {

constexpr double kNoNumber = std::numeric_limits<double>::infinity();

/// Collects the differences of one pair of assets.
class Comparison {
 public:
  Comparison(double tolerance, double r_max_m)
      : tolerance_(tolerance), length_m_(r_max_m > 0 ? r_max_m : 1) {}

  void in(std::string where) { prefix_ = std::move(where); }

  template <class T>
  void exact(const char* what, const T& a, const T& b) {
    if (!(a == b)) add(what, fmt::format("{}", a), fmt::format("{}", b), kNoNumber);
  }
  void plain(const char* what, double a, double b) { number(what, a, b, 1); }
  void length(const char* what, double a_m, double b_m) { number(what, a_m, b_m, length_m_); }
  void curvature(const char* what, double a_per_m, double b_per_m) {
    number(what, a_per_m, b_per_m, 1 / length_m_);
  }
  void volume(const char* what, double a_m3, double b_m3) {
    number(what, a_m3, b_m3, std::pow(length_m_, 3));
  }
  void point(const char* what, const Vec3d& a_m, const Vec3d& b_m) {
    const double size = norm(a_m - b_m) / length_m_;
    if (!(a_m == b_m) && !(size <= tolerance_))
      add(what, fmt::format("({}, {}, {})", a_m.x, a_m.y, a_m.z),
          fmt::format("({}, {}, {})", b_m.x, b_m.y, b_m.z), size);
  }
  void sphere(const char* what, const BoundingSphere& a, const BoundingSphere& b) {
    point(what, a.centre_m, b.centre_m);
    length(what, a.radius_m, b.radius_m);
  }
  void orientation(const Quaternion& a, const Quaternion& b);
  void map(const DistanceMap& a, const DistanceMap& b);
  void bounds(const SurfaceBounds& a, const SurfaceBounds& b) {
    exact("bound cells", a.cells, b.cells);
    length("bound tolerance_m", a.tolerance_m, b.tolerance_m);
    list("bounds", a.cell, b.cell);
  }
  void add(const char* what, std::string first, std::string second, double size) {
    found_.push_back(
        {prefix_.empty() ? what : prefix_ + " " + what, std::move(first), std::move(second), size});
  }
  std::vector<Difference> take() { return std::move(found_); }

 private:
  void number(const char* what, double a, double b, double unit) {
    if (a == b || (a != a && b != b)) return;  // two NaN: both not measured
    const double size = std::abs(a - b) / unit;
    if (!(size <= tolerance_)) add(what, fmt::format("{}", a), fmt::format("{}", b), size);
  }
  template <class T>
  void list(const char* what, const std::vector<T>& a, const std::vector<T>& b);

  double tolerance_, length_m_;
  std::string prefix_;
  std::vector<Difference> found_;
};

void Comparison::orientation(const Quaternion& a, const Quaternion& b) {
  if (a == b) return;
  // q and -q are one rotation; the size is the largest move of a point of the unit sphere.
  const auto distance = [&](double sign) {
    return std::sqrt(std::pow(a.w - sign * b.w, 2) + std::pow(a.x - sign * b.x, 2) +
                     std::pow(a.y - sign * b.y, 2) + std::pow(a.z - sign * b.z, 2));
  };
  const double size = 2 * std::min(distance(1), distance(-1));
  if (!(size <= tolerance_) || tolerance_ == 0)
    add("orientation", fmt::format("({}, {}, {}, {})", a.w, a.x, a.y, a.z),
        fmt::format("({}, {}, {}, {})", b.w, b.x, b.y, b.z), size);
}

template <class T>
void Comparison::list(const char* what, const std::vector<T>& a, const std::vector<T>& b) {
  if (a.size() != b.size()) {
    add(what, fmt::format("{} entries", a.size()), fmt::format("{} entries", b.size()), kNoNumber);
  } else if (a != b && tolerance_ == 0) {
    const auto [first, second] = std::mismatch(a.begin(), a.end(), b.begin());
    add(what, fmt::format("entry {}", first - a.begin()), "another value", kNoNumber);
  }
}

void Comparison::map(const DistanceMap& a, const DistanceMap& b) {
  if (a.rows != b.rows || a.cols != b.cols || a.level_count != b.level_count) {
    add("map", fmt::format("{} x {}, {} levels", a.rows, a.cols, a.level_count),
        fmt::format("{} x {}, {} levels", b.rows, b.cols, b.level_count), kNoNumber);
    return;
  }
  if (tolerance_ == 0) {
    exact("map bits", a.bits, b.bits);
    plain("map depth_min_m", a.depth_min_m, b.depth_min_m);
    plain("map depth_step_m", a.depth_step_m, b.depth_step_m);
  }
  std::size_t kinds = 0;
  double most_m = 0;
  std::uint32_t where = 0;
  for (std::uint32_t texel = 0; texel < a.code.size(); ++texel) {
    const bool a_hits = a.code[texel] != a.miss_code(), b_hits = b.code[texel] != b.miss_code();
    if (a_hits != b_hits || a.starts_inside(texel) != b.starts_inside(texel)) ++kinds;
    if (!a_hits || !b_hits) continue;
    const double change_m = std::abs(a.depth_m(a.code[texel]) - b.depth_m(b.code[texel]));
    if (change_m > most_m) {
      most_m = change_m;
      where = texel;
    }
  }
  if (kinds > 0)
    add("map nodes that hit, miss or start inside", "", fmt::format("{} of {} changed", kinds, a.code.size()),
        kNoNumber);
  if (most_m / length_m_ > tolerance_)
    add("map depth_m", fmt::format("{}", a.depth_m(a.code[where])),
        fmt::format("{} at row {}, column {}", b.depth_m(b.code[where]), where / a.cols, where % a.cols),
        most_m / length_m_);
  list("map crossings", a.crossings, b.crossings);
  list("map vertex samples", a.vertex_samples, b.vertex_samples);
}

void compare_parts(Comparison& compare, const Part& a, const Part& b) {
  compare.point("semi-axes_m", a.shape.semi_axes_m, b.shape.semi_axes_m);
  compare.plain("e1", a.shape.e1, b.shape.e1);
  compare.plain("e2", a.shape.e2, b.shape.e2);
  compare.plain("taper", a.shape.taper, b.shape.taper);
  compare.curvature("bend_per_m x", a.shape.bend.x, b.shape.bend.x);
  compare.curvature("bend_per_m y", a.shape.bend.y, b.shape.bend.y);
  compare.orientation(a.object_from_part.orientation, b.object_from_part.orientation);
  compare.point("translation_m", a.object_from_part.translation_m, b.object_from_part.translation_m);
  compare.sphere("sphere", a.sphere, b.sphere);
  compare.exact("segment", a.segment, b.segment);
  compare.exact("cut reason", static_cast<int>(a.reason), static_cast<int>(b.reason));
  compare.exact("vertex count", a.vertex_count, b.vertex_count);
  compare.exact("face count", a.face_count, b.face_count);
  compare.volume("volume_m3", a.volume_m3, b.volume_m3);
  compare.map(a.map, b.map);
  compare.bounds(a.bounds, b.bounds);
}

void compare_mesh(Comparison& compare, const MeshRecord& a, const MeshRecord& b) {
  using Member = std::pair<const char*, std::uint32_t MeshRecord::*>;
  for (const auto& [name, member] :
       {Member{"source vertices", &MeshRecord::source_vertices},
        Member{"source faces", &MeshRecord::source_faces}, Member{"vertices", &MeshRecord::vertices},
        Member{"faces", &MeshRecord::faces}, Member{"components", &MeshRecord::components},
        Member{"welded vertices", &MeshRecord::welded_vertices},
        Member{"degenerate faces", &MeshRecord::degenerate_faces},
        Member{"duplicate faces", &MeshRecord::duplicate_faces},
        Member{"flipped faces", &MeshRecord::flipped_faces},
        Member{"filled holes", &MeshRecord::filled_holes},
        Member{"boundary edges", &MeshRecord::boundary_edges},
        Member{"non-manifold edges", &MeshRecord::non_manifold_edges}})
    compare.exact(name, a.*member, b.*member);
  compare.exact("is closed", a.is_closed, b.is_closed);
  compare.volume("volume_m3", a.volume_m3, b.volume_m3);
}

void compare_errors(Comparison& compare, const ErrorRow& a, const ErrorRow& b) {
  compare.exact("level", a.level, b.level);
  compare.exact("layer", a.layer, b.layer);
  compare.plain("eq35_percent", a.eq35_percent, b.eq35_percent);
  compare.plain("depth_mean_percent", a.depth_mean_percent, b.depth_mean_percent);
  compare.plain("depth_p95_percent", a.depth_p95_percent, b.depth_p95_percent);
  compare.plain("misclassified_3_percent", a.misclassified_3_percent, b.misclassified_3_percent);
  compare.plain("misclassified_05_percent", a.misclassified_05_percent, b.misclassified_05_percent);
}

void compare_provenance(Comparison& compare, const Provenance& a, const Provenance& b) {
  compare.exact("generator", a.generator, b.generator);
  compare.exact("generator version", a.generator_version, b.generator_version);
  compare.exact("source name", a.source_name, b.source_name);
  compare.exact("source hash", a.source_hash, b.source_hash);
  compare.exact("options", a.options_json, b.options_json);
}

}  // namespace

std::vector<Difference> differences(const Asset& first, const Asset& second, const DiffOptions& options) {
  Comparison compare(options.tolerance, std::max(first.r_max_m, second.r_max_m));
  compare.length("R_max_m", first.r_max_m, second.r_max_m);
  compare.sphere("bounding sphere", first.sphere, second.sphere);
  compare.exact("part count", first.parts.size(), second.parts.size());
  for (std::size_t i = 0; i < std::min(first.parts.size(), second.parts.size()); ++i) {
    compare.in(fmt::format("part {}", i));
    compare_parts(compare, first.parts[i], second.parts[i]);
  }
  compare.in("face labels");
  compare.exact("count", first.face_labels.size(), second.face_labels.size());
  if (first.face_labels.size() == second.face_labels.size()) {
    std::size_t changed = 0;
    for (std::size_t f = 0; f < first.face_labels.size(); ++f)
      if (first.face_labels[f] != second.face_labels[f]) ++changed;
    if (changed > 0)
      compare.add("changed", "", fmt::format("{} of {}", changed, first.face_labels.size()), kNoNumber);
  }
  compare.in("mesh");
  compare_mesh(compare, first.mesh, second.mesh);
  compare.in("errors");
  compare.exact("count", first.errors.size(), second.errors.size());
  for (std::size_t i = 0; i < std::min(first.errors.size(), second.errors.size()); ++i) {
    compare.in(fmt::format("errors row {}", i));
    compare_errors(compare, first.errors[i], second.errors[i]);
  }
  compare.in("source");
  compare.plain("metres per unit", first.provenance.metres_per_unit, second.provenance.metres_per_unit);
  compare.exact("up axis", first.provenance.up_axis, second.provenance.up_axis);
  compare.in("provenance");
  if (options.with_provenance) compare_provenance(compare, first.provenance, second.provenance);
  return compare.take();
}

}  // namespace sqmap::apps
