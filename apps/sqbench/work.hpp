// SPDX-License-Identifier: GPL-3.0-or-later
//
// What all peers are asked: poses of the probe and random points, the same for all, from fixed seeds.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cloud.hpp"
#include "model.hpp"

namespace sqmap::bench {

inline constexpr std::uint64_t kSeed = 20070101;

inline constexpr double kProbeSize = 0.5;  ///< R_max of the probe over that of the object

/// The probe in the size that goes with an object.
struct Probe {
  bake::Mesh mesh;
  Cloud cloud;
};
Probe scaled_probe(const bake::Mesh& unit, const Model& model);

enum class Contact { kTouching, kFar, kGrasp };
const char* name_of(Contact contact) noexcept;

/// A sequence of poses with what the exact mesh says of them.
struct Sequence {
  Contact contact{};
  std::vector<Placement> object_from_probe;
  double contacts_mean{};    ///< points of the probe inside the object
  double near_mean{};        ///< points within the band
  double deepest_percent{};  ///< greatest penetration in any pose, of R_max
  double nearest_percent{};  ///< least signed distance of any point in any pose, of R_max
};

/// Touching: slides along a spiral over the object, 1 % of R_max deep. Far: the boxes of the two overlap, no
/// point within the band. Grasp: of many poses less than 3 % deep, those with contacts nearest to 440.
Sequence make_sequence(const Model& model, const Probe& probe, Contact contact, std::size_t poses);

/// The probe coming from one side: first 1 % of R_max above the surface, last 20 % deep.
std::vector<Placement> make_press(const Model& model, const Probe& probe, std::size_t poses);

/// Random points around the surface, uniform over its area and over the signed distance along the normal,
/// those kept whose distance is within `share` of R_max.
struct Shell {
  double share{};
  std::vector<Vec3d> points_m;
  std::vector<double> distance_m;  ///< exact, signed
  std::vector<Vec3d> normal;       ///< exact gradient
};
/// Of R_max: the shell of the sample by which a peer states its error; other points than the suites draw.
inline constexpr double kOwnShell = 0.028;
inline constexpr double kSampleMargin = 1.25;  ///< for the sample's being another one
Shell make_shell(const Model& model, double share, std::size_t count);

}  // namespace sqmap::bench
