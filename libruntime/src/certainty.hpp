// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sqmap/runtime/object.hpp"

#include "resident.hpp"

namespace sqmap::runtime {

/// Object::certainty of one point.
Certainty certainty_of(const Resident& resident, const Vec3f& p_m) noexcept;

}  // namespace sqmap::runtime
