// SPDX-License-Identifier: GPL-3.0-or-later
//
// Our own side, by the public interface alone.
#include <algorithm>
#include <optional>
#include <stdexcept>
#include <vector>

#include "sqmap/runtime/body.hpp"
#include "sqmap/runtime/contact.hpp"
#include "sqmap/runtime/object.hpp"

#include "peer.hpp"

namespace sqmap::bench {
namespace {

/// The quaternion of a rotation, by its largest component.
Pose pose_of(const Placement& placement) {
  const auto& m = placement.rotation.row;
  const double d[4] = {1.0 + m[0].x + m[1].y + m[2].z, 1.0 + m[0].x - m[1].y - m[2].z,
                       1.0 - m[0].x + m[1].y - m[2].z, 1.0 - m[0].x - m[1].y + m[2].z};
  const double a = m[2].y - m[1].z, b = m[0].z - m[2].x, c = m[1].x - m[0].y;
  const double xy = m[0].y + m[1].x, yz = m[1].z + m[2].y, zx = m[2].x + m[0].z;
  const auto largest = std::max_element(d, d + 4) - d;
  const Quaternion q = largest == 0   ? Quaternion{d[0], a, b, c}
                       : largest == 1 ? Quaternion{a, d[1], xy, zx}
                       : largest == 2 ? Quaternion{b, xy, d[2], yz}
                                      : Quaternion{c, zx, yz, d[3]};  // rotation() normalises
  return {q, cast<double>(placement.translation_m)};
}

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
    if (body_of_ != &cloud || body_->point_count() != cloud.count) {
      auto body = runtime::PointBody::build(cloud.points_m);
      if (!body) throw std::runtime_error(body.error().finding);
      body_.emplace(std::move(body).value());
      body_of_ = &cloud;
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
  mutable std::vector<runtime::Contact> contacts_;
  mutable std::vector<Vec3f> points_m_;  // of the last frame, kept to spare the allocation
};

}  // namespace

std::unique_ptr<Peer> make_sqmap(const Model& model, int layer, unsigned level) {
  return std::make_unique<SqmapPeer>(model, layer, level);
}

}  // namespace sqmap::bench
