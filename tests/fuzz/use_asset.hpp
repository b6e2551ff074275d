// SPDX-License-Identifier: Apache-2.0
//
// What must hold for any asset that the reader lets through, however odd.
#pragma once

#include <cmath>
#include <limits>

#include "sqmap/asset/asset.hpp"
#include "sqmap/asset/validate.hpp"
#include "sqmap/runtime/object.hpp"

#include "fuzz/target.hpp"

namespace sqmap::fuzz {

inline void use_asset(const Asset& asset) {
  (void)validate(asset, CheckLevel::kFull);  // must come back whatever the content
  const auto object = runtime::Object::build(asset);
  require(object.ok(), "an asset that is valid (quick) can be built");
  const auto& sphere = asset.sphere;
  std::vector<Vec3f> points{{0, 0, 0},
                            {std::numeric_limits<float>::max(), 0, 0},
                            {std::numeric_limits<float>::quiet_NaN(), 0, 0},
                            {std::numeric_limits<float>::denorm_min(), 0, 0},
                            cast<float>(sphere.centre_m)};
  for (std::size_t k = 0; k < asset.parts.size() && k < 4; ++k) {
    const Part& part = asset.parts[k];
    const Vec3d& t_m = part.object_from_part.translation_m;
    for (const double share : {0.0, 0.3, -0.7, 1.0})
      for (int axis = 0; axis < 3; ++axis) {
        Vec3d p_m = t_m;
        p_m[axis] += share * part.shape.semi_axes_m[axis];
        p_m[(axis + 1) % 3] += 0.3 * share * part.shape.semi_axes_m[(axis + 1) % 3];
        points.push_back(cast<float>(p_m));
      }
  }
  std::vector<runtime::Certainty> certainty(points.size());
  object.value().certainty(points, certainty);
  for (const runtime::Certainty told : certainty)
    require(told <= runtime::Certainty::kInside, "a certainty is one of the three");
  std::vector<float> distance_m(points.size());
  std::vector<Vec3f> normal(points.size());
  for (const runtime::Layer layer : {runtime::Layer::kOne, runtime::Layer::kTwo, runtime::Layer::kThree}) {
    const runtime::QueryOptions options{layer, 1, 0};
    object.value().query(points, {.signed_distance_m = distance_m, .normal = normal}, options);
    for (std::size_t i = 0; i < points.size(); ++i) {
      require(!std::isinf(distance_m[i]), "a distance is a number or not known");
      require(norm(normal[i]) <= 1.001F, "a normal has unit length or none");
      const runtime::Answer one = object.value().query(points[i], options);
      require(one.signed_distance_m == distance_m[i] ||
                  (std::isnan(one.signed_distance_m) && std::isnan(distance_m[i])),
              "one point at a time answers as a batch does");
    }
  }
}

}  // namespace sqmap::fuzz
