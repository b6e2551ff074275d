// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>

#include "sqmap/asset/asset.hpp"
#include "sqmap/runtime/object.hpp"

namespace sqmap::apps {

/// What the bounds of a bundle are worth.
struct CertaintyShare {
  std::size_t bytes{};                         ///< in memory
  double tolerance_m{};                        ///< of Object::certainty_tolerance_m
  double outside_percent{}, inside_percent{};  ///< of the superquadrics' volume: what is surely there
};

/// By 4096 points in the box of each part, always the same ones. Nothing where a part has no bounds.
std::optional<CertaintyShare> certainty_share(const Asset& asset, const runtime::Object& object);

}  // namespace sqmap::apps
