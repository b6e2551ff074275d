// SPDX-License-Identifier: GPL-3.0-or-later
//
// Our own side, by the public interface alone.
#include <optional>
#include <stdexcept>
#include <vector>

#include "sqmap/runtime/body.hpp"
#include "sqmap/runtime/contact.hpp"
#include "sqmap/runtime/object.hpp"

#include "peer.hpp"
#include "pose_of.hpp"

namespace sqmap::bench {
namespace {

class SqmapPeer : public Peer {
 public:
  SqmapPeer(const Model& model, int layer, unsigned level)
      : object_(build(model.asset)), band_m_(static_cast<float>(kBand * model.r_max_m())) {
    options_.layer = static_cast<runtime::Layer>(layer);
    options_.level = level;
    // The bundle records the mean over the points that lie inside a superquadric. 1.5: our sample is another
    // one.
    stated_percent_ = 100;
    for (const ErrorRow& row : model.asset.errors)
      if (row.level == level && row.layer == static_cast<std::uint32_t>(layer))
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
  std::size_t bytes() const override { return object_.resident_bytes(); }
  StatedError stated_error() const override { return {stated_percent_, true}; }

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
