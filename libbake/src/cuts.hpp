// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "curvature.hpp"
#include "surface.hpp"

namespace sqmap::bake {

/// What the border between two sets of faces is like.
struct Border {
  double length{};
  double length2{};    ///< sum of the squared lengths of its curves
  double concavity{};  ///< length-weighted mean of minus the curvature across it times the radius of the
                       ///< curve, each value clamped to [-1, 1]
};

/// Curvature across each link, > 0 convex; shape [links].
std::vector<double> bend_across_links(const Surface& surface, const Curvature& curvature);

/// The border formed by the given links.
Border measure_border(const Surface& surface, std::span<const double> link_bend,
                      std::span<const std::uint32_t> links);

/// How far a side of this area sticks out of its border: its area over that of flat discs with the same
/// border. 1 is flat, 2 a hemisphere, a limb of radius r and length l has 2 l / r.
double protrusion_ratio(double area, double length2);

/// Strength of a border as Hoffman and Singh 1997 rank parts, by turning and protrusion; at most 1, negative
/// for convex borders. `area` is that of the smaller side. The paper takes the area difference of consecutive
/// locales for it, which only sees thickness; measured on the border itself, it also tells a limb's root from
/// a mere swelling.
double border_strength(const Border& border, double area);

/// Moves the border of a face set to the cheapest place nearby: a minimum cut over the dual graph within a
/// band on both sides (Katz and Tal 2003), an edge costing its length, less where the surface is concave,
/// more where it is convex. `side` is 1 on one side, 0 on the other. Returned unchanged when the band would
/// swallow a whole side.
std::vector<std::uint8_t> refine_border(const Surface& surface, std::span<const double> link_bend,
                                        std::vector<std::uint8_t> side);

}  // namespace sqmap::bake
