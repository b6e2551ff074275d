// SPDX-License-Identifier: Apache-2.0
//
// What every effect works on. One frame of one body B against one object A, all vectors in A's frame:
//
//     find_touches        points of B inside A                                     -> contacts
//     effect.touch(...)   in the order of the model: contacts and forces are changed in place
//     total(...)          sum of the forces, and of the torques where Torque is named
//     effect.limit(...)   what is left of the total
//
// An effect is a class with its parameters and the hooks it needs; memory it keeps from frame to frame is
// allocated by prepare(). Nothing else here allocates, locks, logs or calls the system.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "sqmap/asset/result.hpp"
#include "sqmap/runtime/body.hpp"
#include "sqmap/runtime/budget.hpp"
#include "sqmap/runtime/contact.hpp"
#include "sqmap/runtime/instance.hpp"

namespace sqmap::runtime {

/// A, and how to ask it. Contacts are in the frame of the instance's answers. Where A moves, that should be a
/// frame that moves with it (an instance placed with a scale only), so that friction and texture do, too.
struct Field {
  const Instance* instance{};
  QueryOptions options;
};

/// Where B is in this frame, A's frame. What is pointed to belongs to the caller.
struct BodyState {
  std::span<const Vec3f> points_m;
  std::span<const float> weight_m2{};  ///< surface that each point stands for; empty: all the same
  Vec3f about_m{};                     ///< point the torque is about: where the device holds B
  float step_s = 1e-3F;                ///< since the frame before
  /// The points in blocks, and where the body stands in A's frame; points_m is then not read and may be
  /// empty. Blocks far from A cost next to nothing, so this is the way for a body of more than a few dozen
  /// points.
  const PointBody* body = nullptr;
  Placement at{};
  WorkBudget* budget = nullptr;  ///< of find_touches, only with `body`; null: as deep as Field::options asks
};

/// One frame of B against A.
struct Touches {
  Field field;
  BodyState body;
  std::span<Contact> contacts;  ///< of different points, in an order that is the same every time
  std::span<Vec3f> force_n;     ///< on B at each contact; as long as `contacts`
};

/// Force and torque on B.
struct Wrench {
  Vec3f force_n;
  Vec3f torque_nm;           ///< about BodyState::about_m; zero where Torque is not named
  bool is_finite = true;     ///< false: an input or a sum was not finite, and the rest is zero
  std::uint32_t contacts{};  ///< contacts that were summed
};

/// What find_touches came upon.
struct Found {
  std::size_t count{};    ///< contacts written
  bool is_finite = true;  ///< false: a point, or the body's place, was not finite; such points do not touch
};

/// All contacts, those without a depth among them: they push nothing, but Tracking can give them one. Where
/// `room` is shorter than the points, the last contacts may be left out.
Found find_touches(const Field& field, const BodyState& body, std::span<Contact> room) noexcept;

/// Sum of the forces. A sum that is not finite becomes zero and is flagged.
Wrench total(const Touches& touches) noexcept;

/// `wrench` where it is finite, else zero with is_finite = false.
Wrench finite_or_zero(const Wrench& wrench) noexcept;

/// A number that a user of effect E may set, and its range.
template <class E>
struct Parameter {
  const char* name;  ///< as in the struct and in scene files; ends in its unit
  float E::*member;
  float least, most;
  bool is_whole = false;
};

/// kBadOption unless `value` is a number in [least, most].
Outcome check_range(const char* effect, const char* name, float value, float least, float most,
                    bool is_whole);

template <class E>
concept HasParameters = requires {
  E::parameters();
};

/// kBadOption with the first parameter of the effect that is out of its range.
template <class E>
Outcome check_parameters(const E& effect) {
  if constexpr (HasParameters<E>)
    for (const Parameter<E>& p : E::parameters())
      if (Outcome ok = check_range(E::kName, p.name, effect.*p.member, p.least, p.most, p.is_whole); !ok)
        return ok;
  return Done{};
}

}  // namespace sqmap::runtime
