// SPDX-License-Identifier: Apache-2.0
//
// The batched engine: the same question as Object::query for many points, compiled once for each instruction
// set of SimdTarget. packing.inl: the lanes of a mask; lanes.inl: tables and powers on vectors; look.inl:
// layer 2; walk.inl, fans.inl: layer 3; cull.inl: bounding balls and layer 1; bounds.inl: bounds of the
// surface; batch.inl: the pipeline; body.inl: bodies and their contacts.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <span>

#include "sqmap/runtime/body.hpp"
#include "sqmap/runtime/budget.hpp"
#include "sqmap/runtime/contact.hpp"
#include "sqmap/runtime/object.hpp"

#include "combine.hpp"
#include "resident.hpp"

namespace sqmap::runtime {

/// Points that the engine answers at a time, on its stack, in blocks that are culled by part.
inline constexpr std::uint32_t kBlockPoints = 32;
inline constexpr std::uint32_t kChunkBlocks = 32;
inline constexpr std::uint32_t kChunkPoints = kBlockPoints * kChunkBlocks;
inline constexpr std::uint32_t kMostLanes = 16;
/// Length of arrays that vectors may write past the last point; a multiple of the widest vector, for
/// alignment.
inline constexpr std::uint32_t kPadded = kChunkPoints + kMostLanes;

/// What a caller wants of a chunk.
struct Wants {
  bool normal = false, surface = false;
  /// Object::contacts: only points that can be contacts (ContactQuery::within_m) need be answered.
  bool contacts = false;
  float reach = 0;  ///< of contacts, in units: how far outside a chart's surface may be
  float within_m = 0;
};

/// Points of one question, in units of the Resident; structure of arrays. Blocks of kBlockPoints points lie
/// in balls; a block whose ball is empty has a centre that is not finite.
struct alignas(64) Chunk {
  float x[kPadded], y[kPadded], z[kPadded];
  float block_centre[3][kChunkBlocks], block_radius[kChunkBlocks];
  std::uint32_t block_first[kChunkBlocks];  ///< place of the block's first point in its body
  std::uint32_t block_count = 0;
  std::uint32_t count = 0;
};

/// What is known of a point that lies in a superquadric: the variables of Object::query(point).
struct Finding {
  float nearest, sharpest, nearest_certainty, offset;
  float normal[3],
      surface[3];  ///< object frame, units; of the nearest. No Vec3f: nobody wants it initialised
  std::uint32_t part;
  std::int32_t nearest_entry;  ///< among the entries at hand; -1: none of them
  std::uint8_t layer;
  bool inside, nearest_inside, nearest_faces;

  Vec3f normal_vector() const noexcept { return {normal[0], normal[1], normal[2]}; }
  Vec3f surface_point() const noexcept { return {surface[0], surface[1], surface[2]}; }
  void clear() noexcept {
    *this = {};
    nearest = std::numeric_limits<float>::infinity();
    sharpest = -1;
    part = kNowhere;
    nearest_entry = -1;
  }
  bool is_inside() const noexcept {
    return nearest_faces && sharpest < kOverrule * nearest_certainty ? nearest_inside : inside;
  }
  /// NaN: no chart knows a distance.
  float signed_distance_m(float unit_m) const noexcept {
    if (!std::isfinite(nearest)) return std::numeric_limits<float>::quiet_NaN();
    return unit_m * ((is_inside() ? -nearest : nearest) - offset);
  }
};
/// The points of a chunk that lie in some superquadric, and what is known of them.
struct Findings {
  std::uint32_t count;
  std::uint16_t points[kChunkPoints];  ///< in the order they were found
  Finding of[kChunkPoints];            ///< by point; others are undefined
};

/// An affine map by rows: a body's placement, into units.
struct AffineF {
  Vec3f row[3], translation;
};

struct Kernels {
  /// Object::query(span).
  void (*query)(const Resident&, std::span<const Vec3f>, const Answers&, const QueryOptions&) noexcept;
  /// Object::query(body).
  void (*query_body)(const Resident&, const PointBody::Data&, const BodyPlacement&, const Answers&,
                     const QueryOptions&) noexcept;
  /// Object::contacts; without a budget where there is none.
  std::size_t (*contacts)(const Resident&, const PointBody::Data&, const BodyPlacement&, std::span<Contact>,
                          const ContactQuery&, WorkBudget*) noexcept;
};

/// The kernels of the instruction set in use.
const Kernels& kernels() noexcept;

}  // namespace sqmap::runtime
