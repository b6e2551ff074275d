// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "sqmap/runtime/contact.hpp"
#include "sqmap/runtime/instance.hpp"

namespace sqmap::runtime {

/// Which of a batch of points are in contact with an instance. Points and answers are in the world frame,
/// metres. A point is in contact where its signed distance is negative, or where it is inside and no distance
/// is known, as in layer 1 (depth_m is then 0). A point that is not finite is in no contact.
///
/// Points outside the object's sphere are dropped before anything else is asked about them; each question
/// asks for no more than it needs and stops as soon as its answer is certain. No allocation.

/// What is known of one point as a contact; none where it does not touch. For users with answers of their
/// own.
std::optional<Contact> contact_of(std::uint32_t point, const Vec3f& p_m, const Answer& answer) noexcept;

/// Whether any point is in contact.
bool any_contact(const Instance& instance, std::span<const Vec3f> points_m,
                 const QueryOptions& options = {}) noexcept;

/// The contact of lowest point index.
std::optional<Contact> first_contact(const Instance& instance, std::span<const Vec3f> points_m,
                                     const QueryOptions& options = {}) noexcept;

/// The contact of largest depth_m; of equals that of lowest index.
std::optional<Contact> deepest_contact(const Instance& instance, std::span<const Vec3f> points_m,
                                       const QueryOptions& options = {}) noexcept;

struct ContactCount {
  std::size_t written{};  ///< contacts in the caller's span
  std::size_t found{};    ///< contacts there are
  bool fits() const noexcept { return written == found; }
};

/// All contacts, by ascending point index. Where they do not fit, `contacts` holds the first of them; all are
/// counted.
ContactCount all_contacts(const Instance& instance, std::span<const Vec3f> points_m,
                          std::span<Contact> contacts, const QueryOptions& options = {}) noexcept;

}  // namespace sqmap::runtime
