// SPDX-License-Identifier: GPL-3.0-or-later
//
// Our own side, by the public interface alone.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <vector>

#include "sqmap/asset/superquadric.hpp"
#include "sqmap/runtime/body.hpp"
#include "sqmap/runtime/contact.hpp"
#include "sqmap/runtime/object.hpp"

#include "peer.hpp"
#include "pose_of.hpp"

namespace sqmap::bench {
namespace {

constexpr double kDirectionFrom = 0.001;  ///< of R_max

/// From a point inside a superquadric along a direction to its surface, by bisection; part frame.
double way_out_m(const Superquadric& shape, const Vec3d& m, const Vec3d& direction) {
  double low_m = 0, high_m = 2 * bounding_radius_m(shape);
  for (int i = 0; i < 60; ++i) {
    const double middle_m = (low_m + high_m) / 2;
    (inside_outside_radial(shape, m + middle_m * direction) < 1 ? low_m : high_m) = middle_m;
  }
  return high_m;
}

/// To the nearest point of a superquadric: the best of a lattice of angles, then ever smaller steps from
/// there.
double least_distance_m(const Superquadric& shape, const Vec3d& m) {
  constexpr double kPi = std::numbers::pi;
  constexpr int kRows = 64;
  const auto at = [](double angle, double e) {
    return superellipse_point(std::cos(angle), std::sin(angle), e);
  };
  double best_m = std::numeric_limits<double>::infinity(), best_eta = 0, best_omega = 0;
  const auto consider = [&](double eta, double omega, const auto& on_eta, const auto& on_omega) {
    const double found_m = norm(surface_point(shape, on_eta, on_omega) - m);
    if (!(found_m < best_m)) return false;
    best_m = found_m, best_eta = eta, best_omega = omega;
    return true;
  };
  std::array<SuperellipsePoint<double>, std::size_t{2} * kRows> columns;
  for (int c = 0; c < 2 * kRows; ++c)
    columns[static_cast<std::size_t>(c)] = at(kPi * c / kRows - kPi, shape.e2);
  for (int r = 0; r <= kRows; ++r) {
    const double eta = kPi * r / kRows - kPi / 2;
    const auto on_eta = at(eta, shape.e1);
    for (int c = 0; c < 2 * kRows; ++c)
      consider(eta, kPi * c / kRows - kPi, on_eta, columns[static_cast<std::size_t>(c)]);
  }
  for (double step = kPi / kRows; step > 1e-6;) {
    const double eta = best_eta, omega = best_omega;
    bool is_better = false;
    for (int k = 0; k < 9; ++k) {
      const int rows_up = k / 3 - 1, columns_right = k % 3 - 1;
      const double near_eta = eta + rows_up * step, near_omega = omega + columns_right * step;
      is_better |= consider(near_eta, near_omega, at(near_eta, shape.e1), at(near_omega, shape.e2));
    }
    if (!is_better) step /= 2;
  }
  return best_m;
}

class SqmapPeer : public Peer {
 public:
  SqmapPeer(const Model& model, int layer, unsigned level)
      : model_(model), object_(build(model.asset)), band_m_(static_cast<float>(kBand * model.r_max_m())) {
    options_.layer = static_cast<runtime::Layer>(layer);
    options_.level = level;
    // The bundle records the mean over the points that lie inside a superquadric. 1.5: our sample is another
    // one.
    stated_percent_ = 100;
    if (layer == 1) stated_percent_ = 100 * kBand;  // tells no distance: its hits stand for zero
    for (const ErrorRow& row : model.asset.errors)
      if (layer != 1 && row.level == level && row.layer == static_cast<std::uint32_t>(layer))
        stated_percent_ = 1.5 * row.depth_mean_percent + 1e-3;
  }

  void answer(const Cloud& cloud, const Placement& placement, Hits& hits) const override {
    if (!is_body_of(cloud)) {
      auto body = runtime::PointBody::build(cloud.points_m);
      if (!body) throw std::runtime_error(body.error().finding);
      body_.emplace(std::move(body).value());
      body_of_ = &cloud;
      for (std::size_t k = 0; k < 3; ++k) sample_m_[k] = sample_m(cloud, k);
      contacts_.resize(cloud.count);
    }
    const runtime::ContactQuery query{options_, band_m_};
    const std::size_t found = object_.contacts(*body_, {pose_of(placement), 1}, contacts_, query);
    hits.count = 0;
    for (std::size_t i = 0; i < found; ++i)
      hits.add(contacts_[i].point, -contacts_[i].depth_m, contacts_[i].normal);
  }
  bool sides(const Cloud& cloud, const Placement& placement,
             std::vector<std::uint8_t>& inside) const override {
    place(cloud, placement);
    inside.resize(cloud.count);
    object_.query(points_m_, {.inside = inside}, options_);
    return true;
  }
  double wrong_feet_percent(const Cloud& cloud) const override {
    if (options_.layer != runtime::Layer::kTwo) return std::numeric_limits<double>::quiet_NaN();
    std::size_t feet = 0, wrong = 0;
    const std::size_t step = std::max<std::size_t>(cloud.count / kFeetSample, 1);
    for (std::size_t i = 0; i < cloud.count; i += step) {
      const runtime::Answer answer = object_.query(cloud.points_m[i], options_);
      // Closer to the surface the direction to it is decided by rounding.
      if (answer.part == runtime::kNowhere ||
          !(std::abs(answer.signed_distance_m) > kDirectionFrom * model_.r_max_m()))
        continue;
      // In layer 2 point, surface and foot lie on one normal of the superquadric.
      const Part& part = model_.asset.parts[answer.part];
      const auto turn = rotation(part.object_from_part.orientation);
      const Vec3d p_m = cast<double>(cloud.points_m[i]);
      const Vec3d m = turn.apply_inverse(p_m - part.object_from_part.translation_m);
      const double side = answer.signed_distance_m < 0 ? -1 : 1;
      const Vec3d outward = turn.apply_inverse(side * normalized(p_m - cast<double>(answer.surface_m)));
      ++feet;
      if (way_out_m(part.shape, m, outward) - least_distance_m(part.shape, m) > kWrongFoot * model_.r_max_m())
        ++wrong;
    }
    return feet == 0 ? std::numeric_limits<double>::quiet_NaN()
                     : 100 * static_cast<double>(wrong) / static_cast<double>(feet);
  }
  std::size_t bytes() const override { return object_.resident_bytes(); }
  StatedError stated_error() const override {
    return {stated_percent_, options_.layer != runtime::Layer::kOne};
  }

 private:
  /// First, middle or last point.
  static Vec3f sample_m(const Cloud& cloud, std::size_t k) {
    return cloud.count == 0 ? Vec3f{} : cloud.points_m[(cloud.count - 1) * k / 2];
  }
  /// Suites make one cloud after another, perhaps at one address and of one size: some points must agree,
  /// too.
  bool is_body_of(const Cloud& cloud) const {
    if (body_of_ != &cloud || body_->point_count() != cloud.count) return false;
    for (std::size_t k = 0; k < 3; ++k)
      if (!(sample_m_[k] == sample_m(cloud, k))) return false;
    return true;
  }
  void place(const Cloud& cloud, const Placement& placement) const {
    points_m_.resize(cloud.count);
    for (std::size_t i = 0; i < cloud.count; ++i) points_m_[i] = placement.apply(cloud.points_m[i]);
  }
  static runtime::Object build(const Asset& asset) {
    auto object = runtime::Object::build(asset);
    if (!object) throw std::runtime_error(object.error().finding);
    return std::move(object).value();
  }

  const Model& model_;
  runtime::Object object_;
  runtime::QueryOptions options_;
  float band_m_;
  double stated_percent_;
  mutable std::optional<runtime::PointBody> body_;
  mutable const Cloud* body_of_ = nullptr;
  mutable Vec3f sample_m_[3];
  mutable std::vector<runtime::Contact> contacts_;
  mutable std::vector<Vec3f> points_m_;  // of the last frame, kept to spare the allocation
};

}  // namespace

std::unique_ptr<Peer> make_sqmap(const Model& model, int layer, unsigned level) {
  return std::make_unique<SqmapPeer>(model, layer, level);
}

}  // namespace sqmap::bench
