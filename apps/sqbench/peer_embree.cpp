// SPDX-License-Identifier: GPL-3.0-or-later
#include "closest.hpp"
#include "exact_answer.hpp"
#include "peer.hpp"

namespace sqmap::bench {
namespace {

/// Embree's point query with the band as its radius.
class EmbreePeer : public Peer {
 public:
  explicit EmbreePeer(const Model& model)
      : closest_(model.mesh), normals_(model.mesh), near_(model), band_m_(kBand * model.r_max_m()) {}

  void answer(const Cloud& cloud, const Placement& placement, Hits& hits) const override {
    hits.count = 0;
    near_.for_each(
        cloud, placement,
        [&](const Vec3f& centre_m, float radius_m) {  // one search instead of a block's
          return closest_.nearest(cast<double>(centre_m), band_m_ + double{radius_m}).is_found;
        },
        [&](std::size_t i, const Vec3f& p_m) {
          const Vec3d p = cast<double>(p_m);
          const auto found = closest_.nearest(p, band_m_);
          if (found.is_found) add_exact(i, p, found.nearest_m, normals_.at(found.face, found.feature), hits);
        });
  }
  std::size_t bytes() const override { return sizeof(*this) + closest_.bytes() + normals_.bytes(); }
  StatedError stated_error() const override { return kExactError; }

 private:
  EmbreeClosest closest_;
  Pseudonormals normals_;
  NearBox near_;
  double band_m_;
};

}  // namespace

std::unique_ptr<Peer> make_embree(const Model& model) { return std::make_unique<EmbreePeer>(model); }

}  // namespace sqmap::bench
