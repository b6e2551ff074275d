// SPDX-License-Identifier: Apache-2.0
//
// The batched engine: the same question as Object::query for many points, compiled once for each instruction
// set of SimdTarget. lanes.inl: tables and powers on vectors; look.inl: layers 2 and 3; batch.inl: the
// pipeline.
#pragma once

#include <cstdint>
#include <span>

#include "sqmap/runtime/body.hpp"
#include "sqmap/runtime/contact.hpp"
#include "sqmap/runtime/object.hpp"

#include "combine.hpp"
#include "resident.hpp"

namespace sqmap::runtime {

/// Points that the engine answers at a time, on its stack; blocks of kBlockPoints may be culled by part.
inline constexpr std::uint32_t kBlockPoints = 32;
inline constexpr std::uint32_t kChunkBlocks = 16;
inline constexpr std::uint32_t kChunkPoints = kBlockPoints * kChunkBlocks;
inline constexpr std::uint32_t kMostLanes = 16;
/// Length of arrays that vectors may write past the last point; a multiple of the widest vector, for
/// alignment.
inline constexpr std::uint32_t kPadded = kChunkPoints + kMostLanes;

struct Wants {
  bool normal = false, surface = false;
  bool suspects = false;
  float reach = 0;  ///< of suspects, in units
};

/// Points and what is found of them; structure of arrays. Points in units of the Resident, answers in metres.
struct alignas(64) Chunk {
  float x[kPadded], y[kPadded], z[kPadded];
  float signed_distance_m[kPadded];
  float normal[3][kPadded], surface_m[3][kPadded];
  std::int32_t part[kPadded], layer[kPadded], inside[kPadded];

  /// Of Object::contacts: a chart says the point is inside, or cannot rule out that it is within reach.
  std::int32_t suspect[kPadded];

  /// Balls around the blocks of kBlockPoints points, in units; none: nothing is known of where the points
  /// lie.
  float block_centre[3][kChunkBlocks], block_radius[kChunkBlocks];
  std::uint32_t block_first[kChunkBlocks];  ///< place of the block's first point in its body
  std::uint32_t block_count = 0;
  std::uint32_t count = 0;
};

/// An affine map by rows: a body's placement, into units.
struct AffineF {
  Vec3f row[3], translation;
};

struct Kernels {
  /// Answers the points of the chunk. Points outside the object's sphere get the default answer.
  void (*answer)(const Resident&, const QueryOptions&, const Wants&, Chunk&) noexcept;
  /// Object::query(span).
  void (*query)(const Resident&, std::span<const Vec3f>, const Answers&, const QueryOptions&) noexcept;
  /// Object::query(body).
  void (*query_body)(const Resident&, const PointBody::Data&, const BodyPlacement&, const Answers&,
                     const QueryOptions&) noexcept;
  /// Object::contacts.
  std::size_t (*contacts)(const Resident&, const PointBody::Data&, const BodyPlacement&, std::span<Contact>,
                          const ContactQuery&) noexcept;
};

/// The kernels of the instruction set in use.
const Kernels& kernels() noexcept;

}  // namespace sqmap::runtime
