// SPDX-License-Identifier: GPL-3.0-or-later
//
// The query of Moustakas et al. 2007 as printed (section 4), on the superquadrics of the bundle: parts closed
// by caps where they were cut, float distances at uniform steps of the angles (8)-(11), and the pyramid
// search (15)-(19) for the foot. The offset (12) is for faces and left out: points are asked about. Layer 3
// is the subdivision of 4.2.3, its finer map traced beforehand.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "sqmap/asset/superquadric.hpp"

#include "peer.hpp"
#include "work.hpp"

namespace sqmap::bench {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// The faces of one part, closed: each connected run of open edges gets a fan around the mean of its
/// vertices.
bake::Mesh capped_part(const Model& model, std::size_t part) {
  bake::Mesh closed;
  closed.vertices_m = model.mesh.vertices_m;
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;  // times (a, b) is met less times (b, a)
  for (std::size_t f = 0; f < model.mesh.faces.size(); ++f) {
    const std::uint32_t source = model.mesh.source_face[f];
    if (source >= model.asset.face_labels.size() || model.asset.face_labels[source] != part) continue;
    const auto& face = model.mesh.faces[f];
    closed.faces.push_back(face);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = face[k], b = face[(k + 1) % 3];
      edges[std::minmax(a, b)] += a < b ? 1 : -1;
    }
  }
  std::map<std::uint32_t, std::uint32_t> leader;
  const auto leader_of = [&](std::uint32_t v) {
    auto it = leader.try_emplace(v, v).first;
    while (it->second != it->first) it = leader.find(it->second);
    return it->first;
  };
  for (const auto& [edge, surplus] : edges)
    if (surplus != 0) leader[leader_of(edge.first)] = leader_of(edge.second);
  struct Fan {
    Vec3d sum_m;
    std::uint32_t count{}, vertex{};
  };
  std::map<std::uint32_t, Fan> fans;
  for (const auto& [vertex, next] : leader) {
    Fan& fan = fans[leader_of(vertex)];
    fan.sum_m = fan.sum_m + model.mesh.vertices_m[vertex];
    ++fan.count;
  }
  for (auto& [vertex, fan] : fans) {
    fan.vertex = static_cast<std::uint32_t>(closed.vertices_m.size());
    closed.vertices_m.push_back((1.0 / fan.count) * fan.sum_m);
  }
  for (const auto& [edge, surplus] : edges) {
    if (surplus == 0) continue;
    const std::uint32_t middle = fans[leader_of(edge.first)].vertex;
    closed.faces.push_back(surplus > 0 ? std::array{edge.second, edge.first, middle}
                                       : std::array{edge.first, edge.second, middle});
  }
  closed.source_face.assign(closed.faces.size(), bake::kNewFace);
  return closed;
}

/// The map of one part. `fine`: nodes of the finest subdivision to one of the map's.
class PaperPart {
 public:
  PaperPart(const Model& model, std::size_t index, std::int32_t rows, std::int32_t cols,
            unsigned subdivisions)
      : fine_(1 << subdivisions), rows_((rows - 1) * fine_ + 1), cols_(cols * fine_) {
    const Part& part = model.asset.parts[index];
    const Superquadric& shape = part.shape;
    shape_ = {cast<float>(shape.semi_axes_m), static_cast<float>(shape.e1), static_cast<float>(shape.e2),
              static_cast<float>(shape.taper)};
    turn_ = rotation<float>(part.object_from_part.orientation);
    centre_m_ = cast<float>(part.object_from_part.translation_m);
    radius_m_ = static_cast<float>(bounding_radius_m(shape) * 1.00001);
    search_levels_ =
        std::max(0, static_cast<int>(
                        std::max(std::log2(rows / 16.0), std::log2(cols / 32.0))));  // (18), its integer part

    std::vector<SuperellipsePoint<double>> eta, omega;
    eta_.reserve(static_cast<std::size_t>(rows_));
    omega_.reserve(static_cast<std::size_t>(cols_));
    depth_m_.reserve(eta_.capacity() * omega_.capacity());
    for (std::int32_t r = 0; r < rows_; ++r) {
      const double angle = std::numbers::pi * r / (rows_ - 1) - std::numbers::pi / 2;
      eta.push_back(superellipse_point(std::max(std::cos(angle), 0.0), std::sin(angle), shape.e1));
      eta_.push_back(in_float(eta.back()));
    }
    for (std::int32_t c = 0; c < cols_; ++c) {
      const double angle = 2 * std::numbers::pi * c / cols_ - std::numbers::pi;
      omega.push_back(superellipse_point(std::cos(angle), std::sin(angle), shape.e2));
      omega_.push_back(in_float(omega.back()));
    }
    const bake::RayTracer tracer(capped_part(model, index));
    const auto turn = rotation(part.object_from_part.orientation);
    std::vector<bake::RayTracer::Hit> hits;
    for (const auto& e : eta)
      for (const auto& o : omega) {
        const Vec3d from_m =
            turn.apply(sqmap::surface_point(shape, e, o)) + part.object_from_part.translation_m;
        tracer.trace(from_m, normalized(-turn.apply(sqmap::surface_normal(shape, e, o))), hits);
        depth_m_.push_back(hits.empty() ? kInfinity : static_cast<float>(hits.front().t_m));
      }
  }

  bool reaches(const Vec3f& p_m, float radius_m) const noexcept {
    const Vec3f away = p_m - centre_m_;
    const float within_m = radius_m_ + radius_m;
    return dot(away, away) <= within_m * within_m;
  }
  Vec3f in_part(const Vec3f& p_m) const noexcept { return turn_.apply_inverse(p_m - centre_m_); }
  /// Layer 1.
  bool holds(const Vec3f& m) const noexcept { return inside_outside_radial(shape_, m) < 1; }

  struct Foot {
    std::int32_t row{}, col{};
    float distance_m{};
  };
  /// Layer 2 and the subdivisions of layer 3.
  Foot search(const Vec3f& m) const noexcept {
    const Vec3f& a = shape_.semi_axes_m;
    const float along = superellipse_norm(std::abs(m.x) / a.x, std::abs(m.y) / a.y, shape_.e2);
    const float eta = std::atan2(m.z / a.z, along), omega = std::atan2(m.y / a.y, m.x / a.x);
    const std::int32_t coarse_rows = (rows_ - 1) / fine_, coarse_cols = cols_ / fine_;
    std::int32_t row = fine_ * nearest((eta / kPi + 0.5F) * static_cast<float>(coarse_rows));
    std::int32_t col = fine_ * nearest((omega / kPi + 1) * 0.5F * static_cast<float>(coarse_cols));
    const std::int32_t row_way = way(eta, shape_.e1), col_way = way(omega, shape_.e2);
    float best = -1;
    std::int32_t best_row = row, best_col = col;
    const auto consider = [&](std::int32_t r, std::int32_t c) {
      if (r < 0 || r >= rows_) return;
      const float value = collinearity(m, r, c);
      if (value > best) best = value, best_row = r, best_col = c;
    };
    consider(row, col);
    const std::int32_t first_row = row, first_col = col, range = fine_ << search_levels_;  // (17)
    const auto is_within = [range](std::int32_t from, std::int32_t to, std::int32_t sign) {
      return sign * (to - from) >= 0 && sign * (to - from) <= range;
    };
    std::int32_t stride = range / 2;
    for (int level = 0; level < search_levels_; ++level, stride /= 2) {
      // The top level are the nine nodes of the whole range, each further one the eight around the best.
      if (level == 0) row += row_way * stride, col += col_way * stride;
      if (level > 0) row = best_row, col = best_col;
      for (std::int32_t dr = -1; dr <= 1; ++dr)
        for (std::int32_t dc = -1; dc <= 1; ++dc) {
          const std::int32_t r = row + dr * stride, c = col + dc * stride;
          if ((r != best_row || c != best_col) && is_within(first_row, r, row_way) &&
              is_within(first_col, c, col_way))
            consider(r, c);
        }
    }
    for (stride = fine_ / 2; stride > 0; stride /= 2) {
      row = best_row, col = best_col;
      for (std::int32_t dr = -1; dr <= 1; ++dr)
        for (std::int32_t dc = -1; dc <= 1; ++dc)
          if (dr != 0 || dc != 0) consider(row + dr * stride, col + dc * stride);
    }
    best_col = wrapped(best_col);
    return {best_row, best_col, norm(point(best_row, best_col) - m)};
  }
  /// The distance to the nearest of all nodes.
  float least_distance_m(const Vec3f& m) const noexcept {
    float least = kInfinity;
    for (std::int32_t r = 0; r < rows_; ++r)
      for (std::int32_t c = 0; c < cols_; ++c) {
        const Vec3f away = point(r, c) - m;
        least = std::min(least, dot(away, away));
      }
    return std::sqrt(least);
  }
  float signed_distance_m(const Foot& foot) const noexcept {
    return depth_m_[slot(foot.row, foot.col)] - foot.distance_m;
  }
  /// (26) by differences between the nodes around the foot, outwards; object frame.
  Vec3f normal(const Foot& foot) const noexcept {
    const std::int32_t up = std::min(foot.row + 1, rows_ - 1), down = std::max(foot.row - 1, 0);
    const Vec3f across = surface(foot.row, foot.col + 1) - surface(foot.row, foot.col - 1);
    const Vec3f along = surface(up, foot.col) - surface(down, foot.col);
    const Vec3f outward = direction(foot.row, foot.col);
    const Vec3f n = normalized(cross(across, along));
    const float side = dot(n, outward);
    if (!(std::abs(side) > 0)) return turn_.apply(outward);  // beside a ray that met nothing; at a pole
    return turn_.apply(side < 0 ? -n : n);
  }
  std::size_t bytes() const noexcept {
    return sizeof(*this) + depth_m_.capacity() * sizeof(float) +
           (eta_.capacity() + omega_.capacity()) * sizeof(SuperellipsePoint<float>);
  }

 private:
  static SuperellipsePoint<float> in_float(const SuperellipsePoint<double>& p) noexcept {
    return {static_cast<float>(p.c), static_cast<float>(p.s), static_cast<float>(p.c_power),
            static_cast<float>(p.s_power)};
  }
  static std::int32_t nearest(float x) noexcept { return static_cast<std::int32_t>(std::lround(x)); }
  /// The direction of the search, (15) and (16).
  static std::int32_t way(float angle, float e) noexcept {
    const float quarters = angle / (kPi / 2);
    const bool is_in_a = quarters - std::floor(quarters) < 0.5F;
    return is_in_a == (e < 1) ? -1 : 1;
  }
  std::int32_t wrapped(std::int32_t col) const noexcept { return ((col % cols_) + cols_) % cols_; }
  std::size_t slot(std::int32_t row, std::int32_t col) const noexcept {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(cols_) +
           static_cast<std::size_t>(wrapped(col));
  }
  const SuperellipsePoint<float>& eta(std::int32_t row) const noexcept {
    return eta_[static_cast<std::size_t>(row)];
  }
  const SuperellipsePoint<float>& omega(std::int32_t col) const noexcept {
    return omega_[static_cast<std::size_t>(wrapped(col))];
  }
  Vec3f point(std::int32_t row, std::int32_t col) const noexcept {
    return sqmap::surface_point(shape_, eta(row), omega(col));
  }
  Vec3f direction(std::int32_t row, std::int32_t col) const noexcept {
    return sqmap::surface_normal(shape_, eta(row), omega(col));
  }
  Vec3f surface(std::int32_t row, std::int32_t col) const noexcept {
    return point(row, col) - depth_m_[slot(row, col)] * direction(row, col);
  }
  /// The square of I_S, (19), which orders nodes alike.
  float collinearity(const Vec3f& m, std::int32_t row, std::int32_t col) const noexcept {
    const SuperellipsePoint<float>&e = eta(row), &o = omega(col);
    const Vec3f n = sqmap::surface_gradient(shape_, e, o);
    const Vec3f line = sqmap::surface_point(shape_, e, o) - m;
    const float product = dot(n, line), length = dot(n, n) * dot(line, line);
    return length > 0 ? product * product / length : 1;
  }

  std::int32_t fine_, rows_, cols_;
  int search_levels_{};
  SuperquadricOf<float> shape_;
  Rotation<float> turn_;
  Vec3f centre_m_;
  float radius_m_{};
  std::vector<SuperellipsePoint<float>> eta_, omega_;
  std::vector<float> depth_m_;  // along the inward normal to the first crossing; infinite: none
};

class PaperPeer : public Peer {
 public:
  PaperPeer(const Model& model, unsigned rows, unsigned cols, unsigned subdivisions)
      : r_max_m_(model.r_max_m()), band_m_(static_cast<float>(kBand * model.r_max_m())) {
    for (std::size_t part = 0; part < model.asset.parts.size(); ++part)
      parts_.emplace_back(model, part, static_cast<std::int32_t>(rows), static_cast<std::int32_t>(cols),
                          subdivisions);
    measure_error(model);
  }

  void answer(const Cloud& cloud, const Placement& placement, Hits& hits) const override {
    hits.count = 0;
    near_.reserve(parts_.size());
    for (std::size_t block = 0; block < cloud.block_count; ++block) {
      const Vec3f middle_m =
          placement.apply({cloud.block_x_m[block], cloud.block_y_m[block], cloud.block_z_m[block]});
      near_.clear();
      for (const PaperPart& part : parts_)
        if (part.reaches(middle_m, cloud.block_radius_m[block])) near_.push_back(&part);
      if (near_.empty()) continue;
      for (std::size_t i = block * kBlock; i < std::min((block + 1) * kBlock, cloud.count); ++i)
        answer_point(placement.apply(cloud.points_m[i]), i, hits);
    }
  }
  double wrong_feet_percent(const Cloud& cloud) const override {
    std::size_t feet = 0, wrong = 0;
    const std::size_t step = std::max<std::size_t>(cloud.count / kFeetSample, 1);
    for (std::size_t i = 0; i < cloud.count; i += step)
      for (const PaperPart& part : parts_) {
        const Vec3f m = part.in_part(cloud.points_m[i]);
        if (!part.holds(m)) continue;
        ++feet;
        if (part.search(m).distance_m - part.least_distance_m(m) > kWrongFoot * r_max_m_) ++wrong;
      }
    return feet == 0 ? std::numeric_limits<double>::quiet_NaN()
                     : 100 * static_cast<double>(wrong) / static_cast<double>(feet);
  }
  std::size_t bytes() const override {
    std::size_t sum = sizeof(*this);
    for (const PaperPart& part : parts_) sum += part.bytes();
    return sum;
  }
  StatedError stated_error() const override { return {stated_percent_, true}; }

 private:
  void answer_point(const Vec3f& p_m, std::size_t index, Hits& hits) const noexcept {
    const PaperPart* nearest = nullptr;
    PaperPart::Foot foot;
    float least_m = kInfinity;
    for (const PaperPart* part : near_) {
      if (!part->reaches(p_m, 0)) continue;
      const Vec3f m = part->in_part(p_m);
      if (!part->holds(m)) continue;
      const PaperPart::Foot found = part->search(m);
      const float distance_m = part->signed_distance_m(found);
      if (distance_m < least_m) least_m = distance_m, foot = found, nearest = part;
    }
    if (nearest != nullptr && least_m <= band_m_) hits.add(index, least_m, nearest->normal(foot));
  }
  /// The paper promises no error for a density: what a sample of its own shows is stated, as the bundle's is.
  void measure_error(const Model& model) {
    const Shell shell = make_shell(model, kOwnShell, 2000);
    const Cloud cloud(shell.points_m);
    Hits hits(cloud.count);
    answer(cloud, {}, hits);
    double sum_m = 0;
    for (std::size_t i = 0; i < hits.count; ++i)
      sum_m += std::abs(hits.distance_m[i] - shell.distance_m[cloud.source[hits.point[i]]]);
    stated_percent_ = kSampleMargin * 100 * sum_m /
                          (static_cast<double>(std::max<std::size_t>(hits.count, 1)) * model.r_max_m()) +
                      1e-3;
  }

  std::vector<PaperPart> parts_;
  double r_max_m_;
  float band_m_;
  double stated_percent_{100};
  mutable std::vector<const PaperPart*> near_;  // of the last block, kept to spare the allocation
};

}  // namespace

std::unique_ptr<Peer> make_paper(const Model& model, unsigned rows, unsigned cols, unsigned subdivisions) {
  return std::make_unique<PaperPeer>(model, rows, cols, subdivisions);
}

}  // namespace sqmap::bench
